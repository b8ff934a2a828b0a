#include "retarget/world.h"

#include <gtest/gtest.h>

#include <random>

#include "retarget/obstacle_moves.h"

namespace hydrostat::retarget::world_test {
namespace {

using Eigen::Vector3d;

World turned_world(unsigned seed) {
  std::mt19937 random(seed);
  const auto next = [&] { return static_cast<double>(random()) / 4294967296.0 - 0.5; };
  World world;
  world.turn = Eigen::AngleAxisd(next(), Vector3d(next(), next(), next()).normalized()).toRotationMatrix();
  world.pivot = Vector3d(10 * next(), 0, 10 * next());
  return world;
}

TEST(World, TurnsForcesAndMomentsWithTheBody) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const World world = turned_world(seed);
    std::srand(seed);
    Trace trace;
    trace.time_s = Eigen::VectorXd::LinSpaced(3, 0, 1);
    for (Eigen::MatrixXd* course : {&trace.position, &trace.velocity, &trace.contact_force, &trace.effect_force, &trace.correction_impulse}) {
      *course = Eigen::MatrixXd::Random(12, 3);
    }
    const auto moments = [](const Eigen::MatrixXd& x, const Eigen::MatrixXd& f) {
      Eigen::Matrix3Xd sum = Eigen::Matrix3Xd::Zero(3, x.cols());
      for (Eigen::Index s = 0; s < x.cols(); ++s) {
        for (Eigen::Index r = 0; r < x.rows(); r += 3) sum.col(s) += Vector3d(x.col(s).segment<3>(r)).cross(Vector3d(f.col(s).segment<3>(r)));
      }
      return sum;
    };
    trace.contact_moment = moments(trace.position, trace.contact_force);
    trace.effect_moment = moments(trace.position, trace.effect_force);
    const Trace seen = in_world(world, trace);
    EXPECT_LT((seen.contact_moment - moments(seen.position, seen.contact_force)).norm(), 1e-12);
    EXPECT_LT((seen.effect_moment - moments(seen.position, seen.effect_force)).norm(), 1e-12);
    const Vector3d first = trace.position.col(0).head<3>(), there = seen.position.col(0).head<3>();
    EXPECT_LT((there - world.pivot - world.turn * (first - world.pivot)).norm(), 1e-12);
  }
}

TEST(World, WritesALoopOutAndLeavesALevelOneAsItIs) {
  Motion loop;
  loop.loop = true;
  loop.rate_hz = 10;
  loop.frames = Eigen::MatrixXd::Random(6, 5);
  loop.travel = Vector3d(0.3, 0, 0.1);
  loop.yaw = 0.2;
  EXPECT_TRUE(in_world({}, loop, 2).loop);
  const World world = turned_world(3);
  const Motion seen = in_world(world, loop, 2);
  EXPECT_FALSE(seen.loop);
  ASSERT_EQ(seen.count(), 21);
  const Eigen::Matrix3Xd flat = after_cycles(loop, 3) * loop.at(2);
  EXPECT_LT((seen.at(17) - ((world.turn * (flat.colwise() - world.pivot)).colwise() + world.pivot)).norm(), 1e-12);
}

TEST(World, TravelsOfObstaclesAreTheSumOfTheirSteps) {
  const std::vector<MoveOf<3>> moves{{1, 0.13, 0.61, {1, 0, 0}}, {1, 0.4, 1e300, {0, 2, 0}}, {0, 0, 1e300, {0, 0, 3}}};
  std::vector<physics::ObstacleOf<3>> obstacles(2, {physics::Ball{1}});
  const double dt = 0.01;
  Vector3d way = Vector3d::Zero();
  const Motion travel = travel_of(moves, 1, 100, 101);
  for (int step = 0; step < 100; ++step) {
    EXPECT_LT((travel.frames.col(step) - way).norm(), 1e-9) << step;
    move_obstacles(moves, step * dt, dt, obstacles);
    way += dt * obstacles[1].velocity;
  }
}

}  // namespace
}  // namespace hydrostat::retarget::world_test
