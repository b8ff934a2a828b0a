#include "io/npy.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "io/trace_writer.h"
#include "io/whole_file.h"
#include "retarget/error.h"

namespace hydrostat::io {
namespace {

namespace fs = std::filesystem;

fs::path scratch(const std::string& name) {
  const fs::path folder = fs::path(testing::TempDir()) / ("hydrostat_" + name);
  fs::remove_all(folder);
  fs::create_directories(folder);
  return folder;
}

TEST(Npy, WritingThenReadingGivesTheSameBitsBack) {
  const fs::path folder = scratch("npy_round_trip");
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    std::vector<std::size_t> shape(1 + random() % 3);
    std::size_t size = 1;
    for (std::size_t& extent : shape) size *= extent = random() % 6;  // an extent of 0 is an empty array
    std::vector<double> numbers(size);
    std::vector<int> counts(size);
    for (double& number : numbers) number = std::normal_distribution<>(0, 1e3)(random);
    for (int& count : counts) count = static_cast<int>(random());
    write_npy(folder / "double.npy", shape, std::span<const double>(numbers));
    write_npy(folder / "int.npy", shape, std::span<const int>(counts));
    EXPECT_EQ(read_npy_double(folder / "double.npy").shape, shape);
    EXPECT_EQ(read_npy_double(folder / "double.npy").values, numbers);
    EXPECT_EQ(read_npy_int(folder / "int.npy").values, counts);
  }
}

TEST(Npy, TheHeaderIsTheOneOfTheFormat) {
  const fs::path path = scratch("npy_header") / "a.npy";
  write_npy(path, {2, 3}, std::span<const double>(std::vector<double>(6, 1.5)));
  std::ifstream stream(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  EXPECT_EQ(bytes.substr(0, 8), std::string("\x93NUMPY\x01\x00", 8));
  const std::size_t body = bytes.size() - 6 * sizeof(double);
  EXPECT_EQ(body % 64, 0u);
  EXPECT_EQ(bytes[body - 1], '\n');
  EXPECT_EQ(bytes.substr(10, 61), "{'descr': '<f8', 'fortran_order': False, 'shape': (2,3,), }  ");
}

TEST(Npy, RefusesWhatIsNoSuchFile) {
  const fs::path folder = scratch("npy_refusal");
  write_npy(folder / "int.npy", {2}, std::span<const int>(std::vector<int>{1, 2}));
  EXPECT_THROW(read_npy_double(folder / "int.npy"), Error);
  EXPECT_THROW(read_npy_double(folder / "absent.npy"), Error);
  write_whole_file(folder / "text.npy", "time,height\n0,1\n");
  EXPECT_THROW(read_npy_double(folder / "text.npy"), Error);
  fs::resize_file(folder / "int.npy", fs::file_size(folder / "int.npy") - 1);
  EXPECT_THROW(read_npy_int(folder / "int.npy"), Error);
  fs::resize_file(folder / "int.npy", 20);
  EXPECT_THROW(read_npy_int(folder / "int.npy"), Error);
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
  write_whole_file(folder / "t" / "old.npy", "");
  write_trace(folder / "t/", small_trace());
  EXPECT_FALSE(fs::exists(folder / "t" / "old.npy"));
  EXPECT_TRUE(fs::exists(folder / "t" / "time.npy"));

  fs::create_directories(folder / "photos");
  write_whole_file(folder / "photos" / "cat.png", "cat");
  EXPECT_THROW(write_trace(folder / "photos", small_trace()), Error);
  EXPECT_TRUE(fs::exists(folder / "photos" / "cat.png"));
  EXPECT_THROW(write_trace(folder / "photos" / "cat.png" / "t", small_trace()), Error);
  EXPECT_FALSE(fs::exists(folder / "photos.part"));
}

}  // namespace
}  // namespace hydrostat::io
