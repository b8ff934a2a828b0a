#include "retarget/inverse_dynamics.h"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <ctime>
#include <string>

#include "physics/elastic_forces.h"
#include "physics/internal_forces.h"
#include "tests/retarget/box_creature.h"
#include "tests/sanitizers.h"

namespace hydrostat::retarget::inverse_dynamics_test {
namespace {

constexpr double kLength = BoxCreature::kLength;

Eigen::Vector3d ground_force(const InverseDynamics& inverse, Eigen::Index frame) {
  return inverse.contact_force.col(frame).reshaped(3, inverse.contact_force.rows() / 3).rowwise().sum();
}

InverseDynamics solve_standing(const BoxCreature& creature, const Motion& motion, const InverseOptions& options = {}) {
  return solve_inverse_dynamics(as_prepared(motion, always_standing(creature, motion.count())), creature.scene, kLength, options);
}

/// A place in the box made longer along y by `share`, of the same volume.
Eigen::Vector3d stretched(const Eigen::Vector3d& x, double share) {
  const double across = 1 / std::sqrt(1 + share);
  return {across * x.x(), (1 + share) * x.y(), across * x.z()};
}

/// One frame of the free body under the solved activations and contact forces, from the target's state at frame f: how far it is from the
/// target's next frame [m], mass-weighted RMS.
double one_frame_error(const BoxCreature& creature, const Motion& target, const InverseDynamics& inverse, Eigen::Index f) {
  physics::Scene scene = creature.scene;
  scene.has_ground = false;
  const int nodes = scene.body.node_count();
  Eigen::Matrix3Xd contact = Eigen::Matrix3Xd::Zero(3, nodes);
  for (int p = 0; p < scene.contact_points.count(); ++p) {
    for (int k = 0; k < 4; ++k) {
      contact.col(scene.contact_points.nodes(k, p)) += scene.contact_points.weights(k, p) * inverse.contact_force.col(f).segment<3>(3 * p);
    }
  }
  const double ts = 1 / target.rate_hz;
  // Under a steady acceleration the central velocity is the one at the frame.
  physics::State state{target.at(f), Eigen::Map<const Eigen::Matrix3Xd>(velocities(target).col(f).eval().data(), 3, nodes)};
  const auto stepper = physics::make_explicit_stepper(scene);
  physics::Impulses impulses = physics::make_impulses(scene);
  for (int k = 0; k < 4; ++k) stepper->step(ts / 4, inverse.activation.col(f), &contact, state, impulses);
  const Eigen::Matrix3Xd miss = state.x - target.at(f + 1);
  return std::sqrt(miss.colwise().squaredNorm().dot(scene.body.mass) / creature.mass());
}

TEST(InverseDynamics, HoldABodyThatStands) {
  const BoxCreature creature = make_box_creature();
  const InverseDynamics inverse = solve_standing(creature, standing(creature, 3));
  const double weight = creature.mass() * 9.81;
  EXPECT_LT(inverse.report.miss_rms_length, 3e-5);
  EXPECT_LT(inverse.report.root_residual_mg, 0.01);
  EXPECT_LT(inverse.report.kkt_residual, 1e-6);
  EXPECT_EQ(inverse.report.saturated, 0);
  for (Eigen::Index f = 0; f < 3; ++f) {
    EXPECT_LT((ground_force(inverse, f) - Eigen::Vector3d(0, weight, 0)).norm(), 0.01 * weight);
    for (int p = 0; p < creature.scene.contact_points.count(); ++p) {
      const Eigen::Vector3d force = inverse.contact_force.col(f).segment<3>(3 * p);
      EXPECT_GE(force.y(), 0);
      EXPECT_LE(std::hypot(force.x(), force.z()), creature.scene.ground.friction * force.y() + 1e-12);
    }
  }
}

TEST(InverseDynamics, PushTheGroundHarderToRiseFaster) {
  const BoxCreature creature = make_box_creature();
  for (const double rise : {-3.0, 0.0, 4.0}) {
    SCOPED_TRACE("acceleration " + std::to_string(rise));
    const Motion motion = played(creature, 7, false, [&](const Eigen::Vector3d& x, Eigen::Index f) {
      const double t = static_cast<double>(f) / 60;
      return Eigen::Vector3d(x + Eigen::Vector3d(0, 0.5 * rise * t * t, 0));
    });
    const InverseDynamics inverse = solve_standing(creature, motion);
    const double wanted = creature.mass() * (9.81 + rise);
    EXPECT_NEAR(ground_force(inverse, 3).y(), wanted, 0.01 * wanted);
  }
}

TEST(InverseDynamics, AtRestingEndsTheGroundGivesTheSpeedAndTakesIt) {
  const BoxCreature creature = make_box_creature();
  const double weight = creature.mass() * 9.81, speed = 0.05, push = creature.mass() * speed * 60;  // within a frame
  const Motion rising = played(creature, 7, false, [&](const Eigen::Vector3d& x, Eigen::Index f) {
    return Eigen::Vector3d(x + Eigen::Vector3d(0, speed * static_cast<double>(f) / 60, 0));
  });
  for (const RestingEnds ends : {RestingEnds{}, RestingEnds{true, false}, RestingEnds{false, true}, RestingEnds{true, true}}) {
    SCOPED_TRACE(std::string(ends.first ? "from rest, " : "") + (ends.last ? "to rest" : ""));
    PreparedTarget plan = as_prepared(rising, always_standing(creature, rising.count()));
    plan.ends = ends;
    const InverseDynamics inverse = solve_inverse_dynamics(plan, creature.scene, kLength, {});
    EXPECT_NEAR(ground_force(inverse, 0).y(), weight + (ends.first ? push : 0), 0.02 * weight);
    EXPECT_NEAR(ground_force(inverse, 3).y(), weight, 0.02 * weight);
    EXPECT_NEAR(ground_force(inverse, 6).y(), weight - (ends.last ? push : 0), 0.02 * weight);
  }
}

/// A box that stretches on its soles and takes off in frame `last`, with `speed` [m/s] from there on.
PreparedTarget taking_off(const BoxCreature& creature, Eigen::Index last, double speed) {
  constexpr Eigen::Index kFlight = 8;
  const double height = creature.height(), stretch = speed / height * static_cast<double>(last) / 60 / 2;
  const Motion motion = played(creature, last + kFlight, false, [&](const Eigen::Vector3d& x, Eigen::Index f) {
    const double done = static_cast<double>(std::min(f, last)) / static_cast<double>(last);
    const double fly_s = static_cast<double>(std::max<Eigen::Index>(0, f - last)) / 60;
    return Eigen::Vector3d(x.x(), x.y() * (1 + stretch * (done * done - 1)) + speed * fly_s, x.z());
  });
  ContactSchedule contacts = always_standing(creature, motion.count());
  for (Eigen::Index f = last + 1; f < motion.count(); ++f) {
    contacts.touching.col(f).setConstant(false);
    for (std::vector<ContactState>& states : contacts.state) states[static_cast<std::size_t>(f)] = ContactState::kOff;
  }
  return as_prepared(motion, contacts);
}

TEST(InverseDynamics, PressFeetThatTakeOffUntilTheyDo) {
  const BoxCreature creature = make_box_creature();
  const physics::Body& body = creature.scene.body;
  const double weight = creature.mass() * 9.81;
  constexpr Eigen::Index kLast = 6;
  for (const double speed : {0.5, 1.0, 1.5}) {
    SCOPED_TRACE("speed " + std::to_string(speed));
    const PreparedTarget plan = taking_off(creature, kLast, speed);
    const InverseDynamics inverse = solve_inverse_dynamics(plan, creature.scene, kLength, {});
    physics::InternalForces<3> internal(body);
    internal.set_activation(inverse.activation.col(kLast));
    // How hard the body presses its soles down, beyond what the ground is to give, if these move so.
    const auto pressed = [&](bool stand) {
      const Eigen::Matrix3Xd x = plan.target.at(kLast);
      Eigen::Matrix3Xd v = velocities(plan.target).col(kLast).reshaped(3, x.cols()), force = Eigen::Matrix3Xd::Zero(3, x.cols());
      double down = -ground_force(inverse, kLast).y();
      for (int i = 0; stand && i < body.node_count(); ++i) {
        if (body.rest(1, i) < 0.05) v.col(i).setZero();
      }
      internal.add_elastic_forces(x, force);
      physics::add_damping_forces(body, x, v, force);
      for (int i = 0; i < body.node_count(); ++i) {
        if (body.rest(1, i) < 0.05) down -= force(1, i) - body.mass[i] * (9.81 + accelerations(plan.target).col(kLast)[3 * i + 1]);
      }
      return down / weight;
    };
    const double lifted = pressed(false);
    EXPECT_GT(lifted, 1);
    EXPECT_LT(std::abs(pressed(true)), 0.03 * lifted);
  }
}

TEST(InverseDynamics, KeepTheirBoundsExactly) {
  // A shape whose constraints are stretched by up to 15 % under a limit of 5 %.
  const BoxCreature creature = make_box_creature();
  InverseOptions options;
  options.limit = 0.05;
  const InverseDynamics inverse = solve_standing(creature, bobbing(creature, 8, 0.15), options);
  EXPECT_LE((inverse.activation.array() - 1).abs().maxCoeff(), 0.05 + 1e-15);
  EXPECT_GT(inverse.report.saturated, 0.05);
  EXPECT_LT(inverse.report.kkt_residual, 1e-6);
  EXPECT_EQ(inverse.report.limit, 0.05);
}

TEST(InverseDynamics, UseTheShareOfFrictionThatTheirPlanDoes) {
  // It stands on a slope of 27 degrees, which takes half of its weight's force sideways.
  BoxCreature creature = make_box_creature();
  creature.scene.gravity = {0.5 * 9.81, -9.81, 0};
  const double friction = creature.scene.ground.friction;
  for (const double needed : {0.6, 0.8, 1.2, 1.5}) {
    SCOPED_TRACE(needed);
    PreparedTarget plan = as_prepared(standing(creature, 3), always_standing(creature, 3));
    plan.support_friction = 0.5 / friction * needed;
    const InverseDynamics inverse = solve_inverse_dynamics(plan, creature.scene, kLength, {});
    for (int p = 0; p < creature.scene.contact_points.count(); ++p) {
      const Eigen::Vector3d force = inverse.contact_force.col(1).segment<3>(3 * p);
      EXPECT_LE(std::hypot(force.x(), force.z()), plan.support_friction * friction * force.y() + 1e-9);
    }
    if (needed < 1) {
      EXPECT_GT(inverse.report.root_residual_mg, 0.3 * (1 - needed));
    } else {
      EXPECT_LT(inverse.report.root_residual_mg, 0.02);
    }
  }
}

TEST(InverseDynamics, DoNotHangOnTheNumberOfThreads) {
  const BoxCreature creature = make_box_creature();
  const Motion motion = bobbing(creature, 5, 0.05);
  InverseOptions one, two;
  one.threads = 1;
  two.threads = 2;
  const InverseDynamics a = solve_standing(creature, motion, one), b = solve_standing(creature, motion, two);
  EXPECT_EQ(a.activation, b.activation);
  EXPECT_EQ(a.contact_force, b.contact_force);
  EXPECT_EQ(a.miss, b.miss);
}

void expect_forces_to_move_the_body(const BoxCreature& creature) {
  // Held out of its rest shape the target is hurled up and forward, ever faster.
  const Eigen::Vector3d acceleration(2, 3, 0);
  const Motion motion = played(creature, 7, false, [&](const Eigen::Vector3d& x, Eigen::Index f) {
    const double t = static_cast<double>(f) / 60;
    return Eigen::Vector3d(stretched(x, 0.05) + 0.5 * t * t * acceleration);
  });
  const InverseDynamics inverse = solve_standing(creature, motion);
  const double moved = 0.5 * acceleration.norm() / 3600;  // [m] what the acceleration makes in a frame
  for (const Eigen::Index f : {2, 3, 4}) {
    const double error = one_frame_error(creature, motion, inverse, f);
    EXPECT_LT(error, std::max(10 * inverse.miss[f], 0.05 * moved)) << "frame " << f << ", predicted " << inverse.miss[f];
  }
}

TEST(InverseDynamics, FromTheirForcesTheFreeBodyMovesAsTheTargetDoes) {
  expect_forces_to_move_the_body(make_box_creature());
  for (const BoxCreature& creature : element_box_creatures()) expect_forces_to_move_the_body(creature);
}

TEST(InverseDynamics, HoldElementsThatStandOutOfShape) {
  // Forces that are not linear in the activations leave no more behind than springs do, and the limit holds.
  for (const BoxCreature& creature : element_box_creatures()) {
    InverseOptions options;
    options.limit = 0.2;
    const InverseDynamics inverse = solve_standing(
        creature, played(creature, 3, true, [](const Eigen::Vector3d& x, Eigen::Index) { return stretched(x, 0.12); }),
        options);
    EXPECT_LT(inverse.report.miss_rms_length, 3e-5);
    EXPECT_LT(inverse.report.root_residual_mg, 0.01);
    EXPECT_LT(inverse.report.kkt_residual, 1e-6);
    EXPECT_GT((inverse.activation.array() - 1).abs().maxCoeff(), 0.1);
    EXPECT_LE((inverse.activation.array() - 1).abs().maxCoeff(), 0.2 + 1e-15);
  }
}

TEST(InverseDynamics, ReportTheForceThatNothingGives) {
  // It hovers: no contact, so all of its weight is missing, and it falls by g Ts^2 in a frame.
  const BoxCreature creature = make_box_creature();
  ContactSchedule contacts = always_standing(creature, 3);
  for (auto& states : contacts.state) std::fill(states.begin(), states.end(), ContactState::kOff);
  contacts.touching.setConstant(false);
  const InverseDynamics inverse = solve_inverse_dynamics(as_prepared(standing(creature, 3), contacts), creature.scene, kLength, {});
  EXPECT_NEAR(inverse.report.root_residual_mg, 1, 1e-6);
  EXPECT_NEAR(inverse.miss[1], 9.81 / 3600, 0.1 * 9.81 / 3600);
  EXPECT_EQ(inverse.contact_force.norm(), 0);
}

TEST(InverseDynamics, TellThePenaltyForcesOfTheirActivations) {
  const BoxCreature creature = make_box_creature();
  const Motion motion = bobbing(creature, 4, 0.05);
  const InverseDynamics inverse = solve_standing(creature, motion);
  const physics::Body& body = creature.scene.body;
  for (Eigen::Index f = 0; f < 4; ++f) {
    for (int e = 0; e < body.edge_count(); ++e) {
      const double length = (motion.at(f).col(body.edges(0, e)) - motion.at(f).col(body.edges(1, e))).norm();
      EXPECT_NEAR(inverse.penalty_force(e, f), body.edge_stiffness[e] * (length - inverse.activation(e, f) * body.rest_length[e]), 1e-8);
    }
  }
}

TEST(InverseDynamics, SmoothnessTakesJumpsOutOfTheActivations) {
  const BoxCreature creature = make_box_creature();
  const Motion motion = bobbing(creature, 10, 0.08);
  InverseOptions rough, smooth_options;
  rough.smooth_weight = 0;
  smooth_options.smooth_weight = 3;
  const auto bend = [](const InverseDynamics& inverse) {
    double squared = 0;
    for (Eigen::Index f = 0; f < 10; ++f) {
      squared += (inverse.activation.col((f + 1) % 10) - 2 * inverse.activation.col(f) + inverse.activation.col((f + 9) % 10)).squaredNorm();
    }
    return squared;
  };
  EXPECT_LT(bend(solve_standing(creature, motion, smooth_options)), bend(solve_standing(creature, motion, rough)));
}

TEST(InverseDynamics, WishForTheKinematicActivation) {
  // The constraints are more than the nodes can tell apart: of all that balance, those nearest to the target's own lengths are
  // taken, and what they differ in carries the weight alone.
  const BoxCreature creature = make_box_creature();
  const Motion motion = played(creature, 3, true, [](const Eigen::Vector3d& x, Eigen::Index) { return stretched(x, 0.06); });
  const Eigen::VectorXd upright = solve_standing(creature, motion).activation.col(1);
  const physics::Body& body = creature.scene.body;
  Eigen::VectorXd wish(body.edge_count());
  for (int e = 0; e < body.edge_count(); ++e) {
    wish[e] = (motion.at(1).col(body.edges(0, e)) - motion.at(1).col(body.edges(1, e))).norm() / body.rest_length[e];
  }
  EXPECT_GT((wish.array() - 1).matrix().norm(), 5 * (upright - wish).norm());
}

TEST(InverseDynamics, LeaveTheirWishAsLittleAsBalanceNeeds) {
  // Where no bound holds and nothing smooths, what u differs from its wish is orthogonal to every self-stress: B d = 0 makes no force.
  const BoxCreature creature = make_box_creature();
  const Motion motion = bobbing(creature, 8, 0.05);
  InverseOptions options;
  options.smooth_weight = 0;
  options.limit = 0.6;
  const InverseDynamics inverse = solve_standing(creature, motion, options);
  ASSERT_EQ(inverse.report.saturated, 0);
  const physics::Body& body = creature.scene.body;
  for (const Eigen::Index f : {1, 4, 6}) {
    Eigen::MatrixXd force = Eigen::MatrixXd::Zero(3 * body.node_count(), body.edge_count());
    Eigen::VectorXd away(body.edge_count());
    for (int e = 0; e < body.edge_count(); ++e) {
      const Eigen::Vector3d along = motion.at(f).col(body.edges(1, e)) - motion.at(f).col(body.edges(0, e));
      const Eigen::Vector3d push = body.edge_stiffness[e] * body.rest_length[e] * along.normalized();
      force.col(e).segment<3>(3 * body.edges(1, e)) = push;
      force.col(e).segment<3>(3 * body.edges(0, e)) = -push;
      away[e] = inverse.activation(e, f) - along.norm() / body.rest_length[e];
    }
    const Eigen::VectorXd needed = force.completeOrthogonalDecomposition().solve(force * away);
    EXPECT_LT((away - needed).norm(), 1e-3 * away.norm()) << "frame " << f;
  }
}

TEST(InverseDynamics, MoreWeightOnTheShapeIsPaidWithMiss) {
  // A shape that is 3 % too large, which its wish alone does not hold.
  const BoxCreature creature = make_box_creature();
  const Motion motion = played(creature, 3, true, [](const Eigen::Vector3d& x, Eigen::Index) { return Eigen::Vector3d(x.x(), 1.03 * x.y(), x.z()); });
  double last = 0;
  for (const double weight : {0.001, 0.1, 10.0, 1000.0}) {
    InverseOptions options;
    options.shape_weight = weight;
    options.smooth_weight = 0;
    const double miss = solve_standing(creature, motion, options).report.miss_rms_length;
    EXPECT_GT(miss, 2 * last);
    if (weight == 0.1) {
      EXPECT_LT(miss, 2e-6);
    }
    last = miss;
  }
}

/// Processor time [s] of the whole process.
double process_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

// A clip four times as long takes four times as long: its frames are coupled by sweeps alone, never by one system of all of them, which would
// take sixteen times as long and more. Other work on the machine only adds to a time, so that the least of three counts.
TEST(InverseDynamics, TakeTimeInProportionToTheFrames) {
  if (kSanitized) return;
  const BoxCreature creature = make_box_creature();
  InverseOptions options;
  options.threads = 1;
  const auto swaying = [&creature](Eigen::Index frames) {
    Motion motion = standing(creature, frames);
    for (Eigen::Index f = 0; f < frames; ++f) {
      const double share = 0.05 * std::sin(2 * M_PI * static_cast<double>(f) / 12);
      const Eigen::Matrix3Xd rest = motion.at(f);
      for (Eigen::Index i = 0; i < rest.cols(); ++i) motion.at(f).col(i) = stretched(rest.col(i), share);
    }
    return motion;
  };
  const Motion few = swaying(24), many = swaying(96);
  double of_few = 1e300, of_many = 1e300;
  for (int run = 0; run < 3; ++run) {
    const double start = process_seconds();
    solve_standing(creature, few, options);
    const double between = process_seconds();
    solve_standing(creature, many, options);
    of_few = std::min(of_few, between - start);
    of_many = std::min(of_many, process_seconds() - between);
  }
  EXPECT_GT(of_many / of_few, 2.5);
  EXPECT_LT(of_many / of_few, 6);
}

TEST(AutomaticLimit, IsThe99thPercentileWithinItsBounds) {
  const BoxCreature creature = make_box_creature();
  EXPECT_EQ(automatic_limit(creature.scene.body, standing(creature, 3)), 0.1);
  EXPECT_EQ(automatic_limit(creature.scene.body, bobbing(creature, 8, 0.9)), 0.4);
  const double between = automatic_limit(creature.scene.body, bobbing(creature, 8, 0.2));
  EXPECT_GT(between, 0.19);  // upright constraints see all of the stretch in the highest frame
  EXPECT_LE(between, 0.2 + 1e-12);
}

TEST(AutomaticLimit, IsWidenedByHalvesOnlyWhereLoadsHoldMoreThanThreePercentAtIt) {
  int widened = 0;
  for (const double softer : {1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0}) {
    BoxCreature creature = make_box_creature();
    creature.scene.body.edge_stiffness /= softer;
    const PreparedTarget plan = as_prepared(standing(creature, 3), always_standing(creature, 3));
    const double least = automatic_limit(creature.scene.body, plan.target);
    InverseOptions narrow;
    narrow.limit = least;
    const InverseDynamics at_first = solve_inverse_dynamics(plan, creature.scene, kLength, narrow);
    const InverseDynamics found = solve_within_automatic_limit(plan, creature.scene, kLength, {});
    SCOPED_TRACE("softer " + std::to_string(softer) + ", held " + std::to_string(at_first.report.saturated));
    if (at_first.report.saturated <= 0.03) {
      EXPECT_EQ(found.report.limit, least);
      EXPECT_EQ(found.activation, at_first.activation);
      continue;
    }
    ++widened;
    double expected = least;
    for (double held = 1; held > 0.03 && expected < 0.4;) {
      expected = std::min(0.4, 1.5 * expected);
      InverseOptions wider;
      wider.limit = expected;
      held = solve_inverse_dynamics(plan, creature.scene, kLength, wider).report.saturated;
    }
    EXPECT_EQ(found.report.limit, expected) << "the first of 1.5, 2.25, ... times as much that holds few enough, or the most";
    EXPECT_LT(found.report.miss_rms_length, at_first.report.miss_rms_length);
  }
  EXPECT_GT(widened, 0);
  EXPECT_LT(widened, 7);
}

}  // namespace
}  // namespace hydrostat::retarget::inverse_dynamics_test
