#include "io/wobble_file.h"

#include <gtest/gtest.h>

#include "retarget/error.h"

namespace hydrostat::io::wobble_file_test {
namespace {

/// A body of two nodes with three vertices, and two modes of it.
retarget::Performer performer() {
  retarget::Performer made;
  made.mesh.nodes = Eigen::Matrix3Xd::Zero(3, 2);
  made.skin.vertices = Eigen::Matrix3Xd::Zero(3, 3);
  made.wobble.shapes = Eigen::MatrixXd::Random(9, 2);
  made.wobble.drive = Eigen::MatrixXd::Random(6, 2);
  made.wobble.frequency_hz = Eigen::Vector2d(1.0 / 3, 7);
  made.wobble.mean_load = Eigen::Vector2d(-1e-300, 5);
  made.wobble.most = Eigen::Vector2d(0.01, 0.2);
  made.wobble.start = Eigen::Matrix2d::Random();
  made.wobble.reason = "asked for; and how";
  return made;
}

TEST(WobbleFile, GivesModesBackToTheBit) {
  const retarget::Performer made = performer();
  const retarget::Wobble back = parse_wobble(wobble_bytes(made.wobble), "wobble.bin", made);
  EXPECT_EQ(back.shapes, made.wobble.shapes);
  EXPECT_EQ(back.drive, made.wobble.drive);
  EXPECT_EQ(back.frequency_hz, made.wobble.frequency_hz);
  EXPECT_EQ(back.mean_load, made.wobble.mean_load);
  EXPECT_EQ(back.most, made.wobble.most);
  EXPECT_EQ(back.start, made.wobble.start);
  EXPECT_EQ(back.reason, made.wobble.reason);
  const retarget::Wobble off = result_of<retarget::Wobble>(record_of(retarget::Wobble()));
  EXPECT_FALSE(off.is_on());
}

TEST(WobbleFile, RefusesWhatIsDamagedOrAboutAnotherBody) {
  const retarget::Performer made = performer();
  const std::string bytes = wobble_bytes(made.wobble);
  std::string spoiled = bytes;
  spoiled[spoiled.size() / 2] ^= 1;
  EXPECT_THROW(parse_wobble(spoiled, "wobble.bin", made), Error);
  EXPECT_THROW(parse_wobble(bytes.substr(0, bytes.size() - 9), "wobble.bin", made), Error);
  retarget::Performer other = made;
  other.mesh.nodes.resize(3, 4);
  EXPECT_THROW(parse_wobble(bytes, "wobble.bin", other), Error);
  retarget::Wobble still = made.wobble;
  still.frequency_hz[1] = 0;
  EXPECT_THROW(parse_wobble(wobble_bytes(still), "wobble.bin", made), Error);
}

}  // namespace
}  // namespace hydrostat::io::wobble_file_test
