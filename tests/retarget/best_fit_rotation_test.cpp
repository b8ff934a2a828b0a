#include "retarget/best_fit_rotation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

namespace hydrostat::retarget::best_fit_rotation_test {
namespace {

struct Cloud {
  Eigen::Matrix3Xd points;
  Eigen::VectorXd mass;
  Eigen::Matrix3d turn;
};

Cloud random_cloud(unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<> normal;
  const auto draw = [&] { return normal(random); };
  Cloud cloud;
  cloud.points = Eigen::Matrix3Xd::NullaryExpr(3, 12, draw);
  cloud.mass = Eigen::VectorXd::NullaryExpr(12, [&] { return 0.1 + std::abs(draw()); });
  cloud.turn = Eigen::Quaterniond(draw(), draw(), draw(), draw()).normalized().toRotationMatrix();
  return cloud;
}

double misfit(const Cloud& cloud, const Eigen::Matrix3Xd& moved, const Eigen::Matrix3d& turn) {
  const Eigen::Matrix3Xd difference = moved - turn * cloud.points;
  const Eigen::Vector3d mean = difference * cloud.mass / cloud.mass.sum();
  return (difference.colwise() - mean).colwise().squaredNorm() * cloud.mass;
}

TEST(BestFitRotation, FindsTheTurnOfARigidMove) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Cloud cloud = random_cloud(seed);
    const Eigen::Matrix3Xd moved = (cloud.turn * cloud.points).colwise() + Eigen::Vector3d(3, -1, 2);
    EXPECT_LT((best_fit_rotation(cloud.points, moved, cloud.mass) - cloud.turn).norm(), 1e-12);
  }
}

TEST(BestFitRotation, NoNearbyTurnFitsBetter) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Cloud cloud = random_cloud(seed);
    const Eigen::Matrix3Xd moved = cloud.turn * cloud.points + 0.3 * random_cloud(seed + 1000).points;
    const Eigen::Matrix3d best = best_fit_rotation(cloud.points, moved, cloud.mass);
    EXPECT_NEAR(best.determinant(), 1, 1e-12);
    for (int axis = 0; axis < 3; ++axis) {
      for (double angle : {-0.01, 0.01}) {
        const Eigen::Matrix3d other = Eigen::AngleAxisd(angle, Eigen::Vector3d::Unit(axis)).toRotationMatrix() * best;
        EXPECT_GT(misfit(cloud, moved, other), misfit(cloud, moved, best));
      }
    }
  }
}

TEST(BestFitRotation, AMirroredBodyIsStillOnlyTurned) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Cloud cloud = random_cloud(seed);
    EXPECT_NEAR(best_fit_rotation(cloud.points, -cloud.points, cloud.mass).determinant(), 1, 1e-12);
  }
}

TEST(BestRigidFit, IsTheBestRotationWithWhatItLeaves) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Cloud cloud = random_cloud(seed);
    const Eigen::VectorXd weights = cloud.mass / cloud.mass.sum();
    const Eigen::Vector3d offset(3, -1, 2);
    const Eigen::Matrix3Xd moved = (cloud.turn * cloud.points).colwise() + offset;
    const RigidFit exact = best_rigid_fit(cloud.points, moved, weights);
    EXPECT_LT((exact.rotation - cloud.turn).norm(), 1e-12);
    EXPECT_LT((exact.mean_b - cloud.turn * exact.mean_a - offset).norm(), 1e-12);
    EXPECT_LT(exact.rms, 1e-12);
    const Eigen::Matrix3Xd bent = moved + 0.3 * random_cloud(seed + 1000).points;
    const RigidFit fit = best_rigid_fit(cloud.points, bent, weights);
    EXPECT_LT((fit.rotation - best_fit_rotation(cloud.points, bent, cloud.mass)).norm(), 1e-10);
    EXPECT_NEAR(fit.rms * fit.rms, misfit(cloud, bent, fit.rotation) / cloud.mass.sum(), 1e-12);
  }
}

TEST(BestFitRotations, StayOnOneHemisphereOverManyTurns) {
  const Cloud cloud = random_cloud(7);
  Motion motion;
  motion.frames.resize(cloud.points.size(), 60);
  for (Eigen::Index f = 0; f < 60; ++f) {
    const Eigen::AngleAxisd turn(0.5 * static_cast<double>(f), Eigen::Vector3d::UnitY());
    motion.at(f) = turn.toRotationMatrix() * cloud.points;
  }
  const std::vector<Eigen::Quaterniond> turns = best_fit_rotations(cloud.points, motion, cloud.mass);
  for (std::size_t f = 1; f < turns.size(); ++f) {
    EXPECT_NEAR(turns[f].dot(turns[f - 1]), std::cos(0.25), 1e-12);
  }
}

}  // namespace
}  // namespace hydrostat::retarget::best_fit_rotation_test
