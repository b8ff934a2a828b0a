#include "io/trace_writer.h"

#include <gtest/gtest.h>

#include "io/npy.h"
#include "io/write_file.h"
#include "retarget/error.h"

namespace hydrostat::io::trace_writer_test {
namespace {

namespace fs = std::filesystem;

fs::path scratch(const std::string& name) {
  const fs::path folder = fs::path(testing::TempDir()) / ("hydrostat_" + name);
  fs::remove_all(folder);
  fs::create_directories(folder);
  return folder;
}

/// Three steps of a tet whose numbers tell their own place: 100 * step + 10 * node + axis.
retarget::Trace small_trace() {
  retarget::Trace trace;
  constexpr int kSteps = 3, kNodes = 4;
  trace.time_s = Eigen::Vector3d(0, 0.5, 1);
  trace.mass_kg = Eigen::Vector4d(1, 2, 3, 4);
  trace.position.resize(3 * kNodes, kSteps);
  for (int s = 0; s < kSteps; ++s) {
    for (int n = 0; n < kNodes; ++n) {
      for (int axis = 0; axis < 3; ++axis) trace.position(3 * n + axis, s) = 100 * s + 10 * n + axis;
    }
  }
  trace.velocity = trace.contact_force = trace.effect_force = trace.correction_impulse = 2 * trace.position;
  trace.contact_moment = Eigen::Matrix3Xd::Random(3, kSteps);
  trace.effect_moment = Eigen::Matrix3Xd::Zero(3, kSteps);
  trace.activation = Eigen::MatrixXd::Ones(6, kSteps);
  trace.edges.resize(2, 6);
  trace.edges << 0, 0, 0, 1, 1, 2, 1, 2, 3, 2, 3, 3;
  trace.rest_length_m = Eigen::VectorXd::Ones(6);
  trace.elements.resize(4, 1);
  trace.elements << 0, 1, 2, 3;
  return trace;
}

TEST(WriteTrace, RowsAreStepsThenNodesThenAxes) {
  const fs::path folder = scratch("trace") / "t";
  write_trace(folder, small_trace());
  using Shape = std::vector<std::size_t>;
  EXPECT_EQ(read_npy_double(folder / "time.npy").shape, (Shape{3}));
  EXPECT_EQ(read_npy_double(folder / "mass.npy").shape, (Shape{4}));
  for (const char* name : {"position", "velocity", "contact_force", "effect_force", "correction_impulse"}) {
    EXPECT_EQ(read_npy_double(folder / (std::string(name) + ".npy")).shape, (Shape{3, 4, 3})) << name;
  }
  EXPECT_EQ(read_npy_double(folder / "contact_moment.npy").shape, (Shape{3, 3}));
  EXPECT_EQ(read_npy_double(folder / "effect_moment.npy").shape, (Shape{3, 3}));
  EXPECT_EQ(read_npy_double(folder / "activation.npy").shape, (Shape{3, 6}));
  EXPECT_EQ(read_npy_double(folder / "rest_length.npy").shape, (Shape{6}));
  EXPECT_EQ(read_npy_int(folder / "elements.npy").values, (std::vector<int>{0, 1, 2, 3}));
  const NpyArray<int> edges = read_npy_int(folder / "edges.npy");
  EXPECT_EQ(edges.shape, (Shape{6, 2}));
  EXPECT_EQ(edges.values[2], 0);
  EXPECT_EQ(edges.values[3], 2);
  const NpyArray<double> position = read_npy_double(folder / "position.npy");
  EXPECT_EQ(position.values[(2 * 4 + 3) * 3 + 1], 231);  // step 2, node 3, y
}

TEST(WriteTrace, ReplacesATraceAndNothingElse) {
  const fs::path folder = scratch("trace_again");
  write_trace(folder / "t", small_trace());
  write_file(folder / "t" / "old.npy", "");
  write_trace(folder / "t/", small_trace());
  EXPECT_FALSE(fs::exists(folder / "t" / "old.npy"));
  EXPECT_TRUE(fs::exists(folder / "t" / "time.npy"));

  fs::create_directories(folder / "photos");
  write_file(folder / "photos" / "cat.png", "cat");
  EXPECT_THROW(write_trace(folder / "photos", small_trace()), Error);
  EXPECT_TRUE(fs::exists(folder / "photos" / "cat.png"));
  EXPECT_THROW(write_trace(folder / "photos" / "cat.png" / "t", small_trace()), Error);
  EXPECT_FALSE(fs::exists(folder / "photos.part"));
}

}  // namespace
}  // namespace hydrostat::io::trace_writer_test
