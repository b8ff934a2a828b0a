#include "io/point_cache.h"

#include <gtest/gtest.h>

#include <random>

#include "io/write_file.h"
#include "retarget/error.h"
#include "tests/io/point_cache_file.h"
#include "tests/io/temporary_directory.h"

namespace hydrostat::io::point_cache_test {
namespace {

using namespace point_cache_file;

PointCourse random_course(unsigned seed, std::vector<Eigen::Matrix3Xd>& frames) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<> uniform(-10, 10);
  PointCourse course;
  course.points = 1 + random() % 9;
  course.frames = 1 + random() % 7;
  course.rate_hz = 24 + seed;
  for (Eigen::Index f = 0; f < course.frames; ++f)
    frames.push_back(Eigen::Matrix3Xd::NullaryExpr(3, course.points, [&] { return uniform(random); }));
  course.at = [&frames](Eigen::Index f) { return frames[static_cast<std::size_t>(f)]; };
  return course;
}

void expect_frames(const PointCache& cache, const std::vector<Eigen::Matrix3Xd>& frames) {
  ASSERT_EQ(cache.frames.size(), frames.size());
  for (std::size_t f = 0; f < frames.size(); ++f) EXPECT_EQ(cache.frames[f], frames[f].cast<float>()) << "frame " << f;
}

TEST(PointCache, HoldsEveryFrameInFloat) {
  const TemporaryDirectory directory;
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::vector<Eigen::Matrix3Xd> frames;
    const PointCourse course = random_course(seed, frames);
    write_pc2(directory.path / "a.pc2", course);
    write_mdd(directory.path / "a.mdd", course);
    expect_frames(parse_pc2(read_file(directory.path / "a.pc2")), frames);
    const PointCache mdd = parse_mdd(read_file(directory.path / "a.mdd"));
    expect_frames(mdd, frames);
    for (std::size_t f = 0; f < frames.size(); ++f)
      EXPECT_EQ(mdd.times_s[f], static_cast<float>(static_cast<double>(f) / course.rate_hz));
  }
  EXPECT_EQ(directory.count(), 2u) << "parts are left";
}

TEST(PointCache, RefusesAPlaceThatCannotBeWritten) {
  std::vector<Eigen::Matrix3Xd> frames;
  const PointCourse course = random_course(0, frames);
  for (const auto& write : {write_pc2, write_mdd}) {
    try {
      write("/proc/absent/a", course);
      FAIL() << "was written";
    } catch (const Error& error) {
      EXPECT_EQ(error.file, "/proc/absent/a");
    }
  }
}

}  // namespace
}  // namespace hydrostat::io::point_cache_test
