#include "retarget/com_path.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

namespace hydrostat::retarget::com_path_test {
namespace {

struct Case {
  Motion nodes;
  Eigen::VectorXd mass;
};

/// Nodes of uneven mass that jitter.
Case random_case(unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<> normal;
  Case made;
  made.nodes.frames = Eigen::MatrixXd::NullaryExpr(3 * 7, 20, [&] { return normal(random); });
  made.mass = Eigen::VectorXd::NullaryExpr(7, [&] { return 0.1 + std::abs(normal(random)); });
  return made;
}

/// A rigid body, the first frame of the case, put `lift[f]` higher in frame f.
Motion lifted(const Case& of, const Eigen::VectorXd& lift) {
  Motion motion = of.nodes;
  for (Eigen::Index f = 0; f < motion.count(); ++f) {
    motion.frames.col(f) = of.nodes.frames.col(0);
    motion.at(f).row(1).array() += lift[f];
  }
  return motion;
}

TEST(ComPath, HasEveryNodeByItsMass) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Case made = random_case(seed);
    const Eigen::Matrix3Xd path = com_path(made.nodes, made.mass);
    for (Eigen::Index f = 0; f < path.cols(); ++f) {
      Eigen::Vector3d moment = Eigen::Vector3d::Zero();
      for (Eigen::Index i = 0; i < 7; ++i) moment += made.mass[i] * (made.nodes.at(f).col(i) - path.col(f));
      EXPECT_LT(moment.norm(), 1e-12);
    }
    EXPECT_TRUE(com_path(made.nodes, 5 * made.mass).isApprox(path, 1e-12));
  }
}

TEST(ApexRise, ARigidlyLiftedMotionRisesByTheLift) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Case made = random_case(seed);
    std::mt19937 random(seed + 1000);
    std::uniform_real_distribution<> draw(-1, 1);
    Eigen::VectorXd lift = Eigen::VectorXd::NullaryExpr(made.nodes.count(), [&] { return draw(random); });
    lift[0] = 0;
    EXPECT_NEAR(apex_rise(com_path(lifted(made, lift), made.mass)), std::max(0.0, lift.maxCoeff()), 1e-12);
  }
}

TEST(ApexRise, LimbsThatAreThrownUpDoNotLiftTheBody) {
  // Half of the points fly up, the other half as far down: the mean of the mass stays where it was.
  Motion nodes;
  nodes.frames = Eigen::MatrixXd::Zero(6, 3);
  nodes.frames(1, 1) = 0.3, nodes.frames(4, 1) = -0.1;
  EXPECT_NEAR(apex_rise(com_path(nodes, Eigen::Vector2d(1, 3))), 0, 1e-15);
  EXPECT_NEAR(apex_rise(com_path(nodes, Eigen::Vector2d(1, 1))), 0.1, 1e-15);
}

TEST(ApexRise, OfAMotionThatOnlySinksIsNone) {
  Eigen::Matrix3Xd path = Eigen::Matrix3Xd::Zero(3, 5);
  path.row(1) << 1, 0.9, 0.5, 0.7, 0.99;
  EXPECT_EQ(apex_rise(path), 0);
  EXPECT_EQ(apex_rise(path.leftCols(0)), 0);
}

}  // namespace
}  // namespace hydrostat::retarget::com_path_test
