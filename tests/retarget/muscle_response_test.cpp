#include "retarget/muscle_response.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/retarget/box_creature.h"

namespace hydrostat::retarget::muscle_response_test {
namespace {

constexpr double kHorizon = 1.0 / 30;

struct Touched {
  BoxCreature creature = make_box_creature();
  Muscles muscles = make_muscles(creature.scene.body, creature.skeleton, creature.bone_weights);
  physics::State state{creature.scene.body.rest, Eigen::Matrix3Xd::Zero(3, creature.scene.body.node_count())};
  physics::InternalForces<3> forces{creature.scene.body};
  double stiffness = creature.mass() * 9.81 / (5e-4 * BoxCreature::kLength);

  Touched() { forces.set_activation(Eigen::VectorXd::Ones(creature.scene.body.edge_count())); }

  MuscleResponse response() const {
    const physics::Body& body = creature.scene.body;
    return {creature.scene, muscles, kHorizon, stiffness, body.mass.transpose().replicate<3, 1>().reshaped()};
  }

  std::vector<ContactState> touching(std::mt19937& random) const {
    std::vector<ContactState> states(static_cast<std::size_t>(creature.scene.contact_points.count()));
    for (ContactState& one : states) one = static_cast<ContactState>(std::uniform_int_distribution(0, 2)(random));
    return states;
  }
};

/// Some points touch otherwise than before.
void change_some(std::vector<ContactState>& states, std::mt19937& random) {
  for (int k = 0; k < 6; ++k) {
    const std::size_t p = std::uniform_int_distribution<std::size_t>(0, states.size() - 1)(random);
    states[p] = static_cast<ContactState>(std::uniform_int_distribution(0, 2)(random));
  }
}

double farthest(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) { return (a - b).norm() / b.norm(); }

TEST(MuscleResponse, what_comes_and_goes_on_the_ground_is_as_if_it_were_made_anew) {
  Touched touched;
  for (unsigned seed = 0; seed < 8; ++seed) {
    std::mt19937 random(seed);
    MuscleResponse kept = touched.response();
    std::vector<ContactState> states = touched.touching(random);
    ASSERT_TRUE(kept.update(touched.state, touched.forces, states, 100));
    for (int call = 0; call < 4; ++call) {
      change_some(states, random);
      ASSERT_TRUE(kept.update(touched.state, touched.forces, states, 100));
      MuscleResponse anew = touched.response();
      ASSERT_TRUE(anew.update(touched.state, touched.forces, states, 1));
      EXPECT_LT(farthest(kept.velocities(), anew.velocities()), 1e-8) << seed;
      EXPECT_LT(farthest(kept.node_normal().triangularView<Eigen::Lower>(), anew.node_normal().triangularView<Eigen::Lower>()), 1e-8)
          << seed;
      Eigen::VectorXd push = Eigen::VectorXd::NullaryExpr(kept.velocities().rows(), [&] { return std::normal_distribution()(random); });
      Eigen::VectorXd same = push;
      kept.solve_in_place(push);
      anew.solve_in_place(same);
      EXPECT_LT(farthest(push, same), 1e-8) << seed;
    }
  }
}

TEST(MuscleResponse, is_kept_for_so_many_calls_and_then_follows_the_body) {
  Touched touched;
  std::mt19937 random(1);
  const std::vector<ContactState> states = touched.touching(random);
  MuscleResponse kept = touched.response();
  ASSERT_TRUE(kept.update(touched.state, touched.forces, states, 3));
  const Eigen::MatrixXd first = kept.velocities();
  touched.state.x.row(0) *= 1.1;
  for (int call = 0; call < 2; ++call) {
    ASSERT_TRUE(kept.update(touched.state, touched.forces, states, 3));
    EXPECT_EQ(kept.velocities(), first);
  }
  ASSERT_TRUE(kept.update(touched.state, touched.forces, states, 3));
  EXPECT_GT(farthest(kept.velocities(), first), 1e-3);
}

TEST(MuscleResponse, where_everything_lets_go_at_once_it_is_made_anew) {
  Touched touched;
  const auto points = static_cast<std::size_t>(touched.creature.scene.contact_points.count());
  MuscleResponse kept = touched.response(), anew = touched.response();
  ASSERT_TRUE(kept.update(touched.state, touched.forces, std::vector(points, ContactState::kStick), 100));
  ASSERT_TRUE(kept.update(touched.state, touched.forces, std::vector(points, ContactState::kOff), 100));
  ASSERT_TRUE(anew.update(touched.state, touched.forces, std::vector(points, ContactState::kOff), 100));
  EXPECT_LT(farthest(kept.velocities(), anew.velocities()), 1e-8);
}

}  // namespace
}  // namespace hydrostat::retarget::muscle_response_test
