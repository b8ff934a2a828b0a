#include "io/npy.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "io/write_file.h"
#include "retarget/error.h"

namespace hydrostat::io::npy_test {
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
  write_file(folder / "text.npy", "time,height\n0,1\n");
  EXPECT_THROW(read_npy_double(folder / "text.npy"), Error);
  fs::resize_file(folder / "int.npy", fs::file_size(folder / "int.npy") - 1);
  EXPECT_THROW(read_npy_int(folder / "int.npy"), Error);
  fs::resize_file(folder / "int.npy", 20);
  EXPECT_THROW(read_npy_int(folder / "int.npy"), Error);
}

}  // namespace
}  // namespace hydrostat::io::npy_test
