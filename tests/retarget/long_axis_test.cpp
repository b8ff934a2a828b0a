#include "retarget/long_axis.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "tests/physics/lattice_scene.h"

namespace hydrostat::retarget::long_axis_test {
namespace {

Motion still(const Eigen::Matrix3Xd& nodes) {
  Motion motion;
  motion.rate_hz = 30;
  motion.frames = nodes.reshaped();
  return motion;
}

TEST(LongAxis, IsThatOfTheBodyAsItLiesInTheTargetsFirstFrame) {
  const physics::Body body = physics::bar(8, 2, 3, 0.1);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> even(-1, 1);
  for (int k = 0; k < 20; ++k) {
    const double yaw = M_PI * even(random);
    const Eigen::Matrix3d turned = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()).toRotationMatrix();
    const Eigen::Matrix3Xd placed = (turned * body.rest).colwise() + Eigen::Vector3d(3, 0.2, even(random));
    const LongAxis axis = long_axis(body, still(placed));
    EXPECT_NEAR(std::abs(axis.along.dot(turned.col(0))), 1, 1e-3);
    EXPECT_NEAR(axis.along.norm(), 1, 1e-12);
    EXPECT_LT((axis.arms - (placed.colwise() - physics::centre_of_mass(body, placed))).norm(), 1e-9);
    EXPECT_GT(axis.slenderness, 2.2);  // 8 cells over 3: 2.67 for a solid bar
    EXPECT_LT(axis.slenderness, 3);
  }
}

TEST(LongAxis, OfABodyThatStandsUpIsNotSlenderHoweverTallItIs) {
  const physics::Body tall = physics::bar(2, 8, 2, 0.1);
  EXPECT_LT(long_axis(tall, still(tall.rest)).slenderness, 0.6);
}

TEST(LongAxis, BendsMakeTheBodyLongerOnOneSideAndShorterOnTheOther) {
  const physics::Body body = physics::bar(8, 2, 2, 0.1);
  const LongAxis axis = long_axis(body, still(body.rest));
  const Eigen::VectorXd bend = bends_across(axis, body.edges) * axis.along.cross(Eigen::Vector3d::UnitY());
  double left = 0, right = 0;
  for (int e = 0; e < body.edge_count(); ++e) {
    const double z = axis.arms(2, body.edges(0, e)) + axis.arms(2, body.edges(1, e));
    const Eigen::Vector3d edge = axis.arms.col(body.edges(1, e)) - axis.arms.col(body.edges(0, e));
    const bool is_across = std::abs(edge.normalized().x()) < 1e-6;
    EXPECT_LT(is_across ? std::abs(bend[e]) : 0, 1e-12);
    (z > 0 ? left : right) += bend[e];
  }
  EXPECT_GT(std::abs(left), 0.1);
  EXPECT_NEAR(left, -right, 0.02 * std::abs(left));
}

}  // namespace
}  // namespace hydrostat::retarget::long_axis_test
