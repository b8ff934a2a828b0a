#include "retarget/corrector.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <string>

#include "tests/retarget/box_creature.h"

namespace hydrostat::retarget::corrector_test {
namespace {

constexpr double kLimit = 0.3;

struct Controlled {
  explicit Controlled(const BoxCreature& box = make_box_creature()) : creature(box) {}

  BoxCreature creature;
  Muscles muscles = make_muscles(creature.scene.body, creature.skeleton, creature.bone_weights);
  physics::State rest{creature.scene.body.rest, Eigen::Matrix3Xd::Zero(3, creature.scene.body.node_count())};
  ContactNow standing = everywhere(ContactState::kStick), flying = everywhere(ContactState::kOff);
  Patch lifted = first_foot();
  Eigen::VectorXd passive = Eigen::VectorXd::Ones(creature.scene.body.edge_count());

  /// No point is to bear load.
  ContactNow everywhere(ContactState state) const {
    const int points = creature.scene.contact_points.count();
    ContactNow contact;
    contact.touching.assign(static_cast<std::size_t>(points), state);
    contact.bearing.assign(contact.touching.size(), false);
    contact.on_leg.assign(contact.touching.size(), true);
    contact.force.setZero(3, points);
    return contact;
  }

  /// All points bear the same share of the weight.
  ContactNow bearing() const {
    ContactNow contact = standing;
    contact.bearing.assign(contact.touching.size(), true);
    contact.force.row(1).setConstant(creature.mass() * 9.81 / static_cast<double>(contact.touching.size()));
    return contact;
  }

  /// As bearing(), but the first patch, the back right foot, is in the air.
  ContactNow on_three_legs() const {
    ContactNow contact = bearing();
    for (const int p : lifted.points) {
      contact.touching[static_cast<std::size_t>(p)] = ContactState::kOff;
      contact.bearing[static_cast<std::size_t>(p)] = false;
      contact.force.col(p).setZero();
    }
    contact.in_air = {&lifted};
    return contact;
  }

  Patch first_foot() const {
    Patch foot{creature.skeleton.names[1], {}};
    for (int p = 0; p < creature.scene.contact_points.count(); ++p) {
      if (creature.patch_bone[static_cast<std::size_t>(p)] == 1) foot.points.push_back(p);
    }
    return foot;
  }

  Corrector corrector(const CorrectorOptions& options = {}) const {
    return Corrector(creature.scene, muscles, BoxCreature::kLength, kLimit, options);
  }

  /// The momentum [N s] along `direction` that the body has more after `seconds` under `activation` than under the passive one.
  double gained(const physics::State& state, const Eigen::VectorXd& activation, const Eigen::Vector3d& direction, double seconds) const {
    double momentum[2];
    for (int k = 0; k < 2; ++k) {
      physics::State now = state;
      const auto stepper = physics::make_explicit_stepper(creature.scene);
      physics::Impulses impulses = physics::make_impulses(creature.scene);
      for (int s = 0; s < 10; ++s) stepper->step(seconds / 10, k == 0 ? passive : activation, nullptr, now, impulses);
      momentum[k] = direction.dot(physics::momentum(creature.scene.body, now.v));
    }
    return momentum[1] - momentum[0];
  }
};

TEST(Corrector, DoesNothingOnTheNominalPath) {
  const Controlled controlled;
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    physics::State state = controlled.rest;
    state.x += physics::random_points(random, state.x.cols(), 0.01);
    state.v += physics::random_points(random, state.x.cols(), 1);
    const Eigen::VectorXd given = physics::random_activation(random, controlled.creature.scene.body, 0.2);
    Eigen::VectorXd activation = given;
    Corrector corrector = controlled.corrector();
    EXPECT_EQ(corrector.correct(state, state, controlled.bearing(), activation), 0);
    EXPECT_EQ(corrector.correct(state, state, controlled.on_three_legs(), activation), 0);
    EXPECT_EQ(activation, given);
  }
}

TEST(Corrector, PushesBackAgainstAnErrorOfVelocity) {
  const Controlled controlled;
  for (const Eigen::Vector3d& direction : {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(-1, 0, 0), Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0, 0, -1)}) {
    SCOPED_TRACE(::testing::Message() << "error along " << direction.transpose());
    physics::State state = controlled.rest;
    state.v.colwise() += 0.2 * direction;
    Corrector corrector = controlled.corrector();
    Eigen::VectorXd activation = controlled.passive;
    EXPECT_GT(corrector.correct(state, controlled.rest, controlled.standing, activation), 0);
    EXPECT_LT(controlled.gained(state, activation, direction, 1.0 / 30), 0);
  }
}

TEST(Corrector, PushesBackThroughElementsToo) {
  for (const BoxCreature& creature : element_box_creatures()) {
    const Controlled controlled(creature);
    physics::State state = controlled.rest;
    Corrector corrector = controlled.corrector();
    Eigen::VectorXd activation = controlled.passive;
    EXPECT_EQ(corrector.correct(state, controlled.rest, controlled.standing, activation), 0);
    EXPECT_EQ(activation, controlled.passive);
    const Eigen::Vector3d direction(1, 0, 0);
    state.v.colwise() += 0.2 * direction;
    EXPECT_GT(corrector.correct(state, controlled.rest, controlled.standing, activation), 0);
    EXPECT_LT(controlled.gained(state, activation, direction, 1.0 / 30), 0);
  }
}

TEST(Corrector, PushesBackAgainstAnErrorOfPlace) {
  const Controlled controlled;
  for (const Eigen::Vector3d& direction : {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 0, -1)}) {
    physics::State reference = controlled.rest;
    reference.x.colwise() -= 0.02 * direction;
    Corrector corrector = controlled.corrector();
    Eigen::VectorXd activation = controlled.passive;
    corrector.correct(controlled.rest, reference, controlled.standing, activation);
    EXPECT_LT(controlled.gained(controlled.rest, activation, direction, 1.0 / 30), 0);
  }
}

TEST(Corrector, LeavesPitchAndRollAloneWhereTheyWeighNothingButNoOtherTurn) {
  const Controlled controlled;
  CorrectorOptions options;
  options.node_weight = 0;
  for (int axis = 0; axis < 3; ++axis) {
    SCOPED_TRACE("axis " + std::to_string(axis));
    physics::State state = controlled.rest;
    const Eigen::Vector3d com = physics::centre_of_mass(controlled.creature.scene.body, state.x);
    for (Eigen::Index i = 0; i < state.x.cols(); ++i) state.v.col(i) = Eigen::Vector3d::Unit(axis).cross(state.x.col(i) - com);
    double effort[2];
    for (const int upright : {0, 1}) {
      ContactNow contact = controlled.standing;
      contact.upright = upright;
      Corrector corrector = controlled.corrector(options);
      Eigen::VectorXd activation = controlled.passive;
      effort[upright] = corrector.correct(state, controlled.rest, contact, activation);
    }
    ASSERT_GT(effort[1], 0);
    // Of pitch and roll the centre of mass's own rows still see a part.
    if (axis == 1) EXPECT_NEAR(effort[0] / effort[1], 1, 1e-3);
    else EXPECT_LT(effort[0] / effort[1], 0.6);
  }
}

TEST(Corrector, CannotMoveTheCentreOfMassInTheAir) {
  // Activations are internal: in flight the momentum rows see no muscle, so an error of the whole body's velocity makes none work.
  const Controlled controlled;
  physics::State state = controlled.rest;
  state.v.colwise() += Eigen::Vector3d(0.2, 0, 0);
  Eigen::VectorXd in_flight = controlled.passive, on_feet = controlled.passive;
  Corrector a = controlled.corrector(), b = controlled.corrector();
  EXPECT_LT(a.correct(state, controlled.rest, controlled.flying, in_flight), 0.01 * b.correct(state, controlled.rest, controlled.standing, on_feet));
}

TEST(Corrector, DoesNotPullAtTheGround) {
  // A body that rolls over its left feet would be held by a pull at the right ones, which the ground cannot give.
  const Controlled controlled;
  const ContactNow contact = controlled.bearing();
  const double share = 1 / static_cast<double>(contact.touching.size());
  for (const double speed : {0.2, 0.5, 1.0}) {
    physics::State state = controlled.rest;
    for (Eigen::Index i = 0; i < state.x.cols(); ++i) {
      state.v.col(i) = Eigen::Vector3d(speed / 0.2, 0, 0).cross(state.x.col(i) - Eigen::Vector3d(0, 0, 0.4));
    }
    double least[2];
    for (const bool with_cones : {false, true}) {
      CorrectorOptions options;
      options.calm = 0;
      if (!with_cones) options.cone_weight = 0;
      Corrector corrector = controlled.corrector(options);
      Eigen::VectorXd activation = controlled.passive;
      corrector.correct(state, controlled.rest, contact, activation);
      least[with_cones] = corrector.least_margin() / share;
    }
    EXPECT_LT(least[0], -0.2) << "speed " << speed;
    EXPECT_GT(least[1], 0.1 * least[0]) << "speed " << speed;
  }
}

TEST(Corrector, SendsAFootInTheAirWhereItCatchesTheBody) {
  const Controlled controlled;
  const ContactNow contact = controlled.on_three_legs();
  for (const Eigen::Vector3d& direction : {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(-1, 0, 0), Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0, 0, -1)}) {
    SCOPED_TRACE(::testing::Message() << "error along " << direction.transpose());
    physics::State state = controlled.rest;
    state.v.colwise() += 0.1 * direction;
    double way[2];
    for (const bool with_steps : {false, true}) {
      CorrectorOptions options;
      if (!with_steps) options.step = 0;
      Corrector corrector = controlled.corrector(options);
      Eigen::VectorXd activation = controlled.passive;
      corrector.correct(state, controlled.rest, contact, activation);
      physics::State now = state;
      now.x.row(1).array() += 0.05;  // clear of the ground
      const auto stepper = physics::make_explicit_stepper(controlled.creature.scene);
      physics::Impulses impulses = physics::make_impulses(controlled.creature.scene);
      for (int s = 0; s < 8; ++s) stepper->step(1.0 / 240, activation, nullptr, now, impulses);
      Eigen::Vector3d foot = Eigen::Vector3d::Zero();
      for (const int p : controlled.lifted.points) foot += controlled.creature.scene.contact_points.of(now.x, p);
      foot /= static_cast<double>(controlled.lifted.points.size());
      way[with_steps] = direction.dot(foot - physics::centre_of_mass(controlled.creature.scene.body, now.x));
    }
    EXPECT_GT(way[1], way[0] + 1e-4);
  }
}

/// Height [m] of the first foot over the centre of mass after `activation` was held for a while in the air.
double foot_after(const Controlled& controlled, const Eigen::VectorXd& activation, physics::State state) {
  const physics::Scene& scene = controlled.creature.scene;
  state.x.row(1).array() += 0.05;
  const auto stepper = physics::make_explicit_stepper(scene);
  physics::Impulses impulses = physics::make_impulses(scene);
  for (int s = 0; s < 8; ++s) stepper->step(1.0 / 240, activation, nullptr, state, impulses);
  double height = 0;
  for (const int p : controlled.lifted.points) height += scene.contact_points.of(state.x, p).y();
  return height / static_cast<double>(controlled.lifted.points.size()) - (scene.body.mass.transpose() * state.x.row(1).transpose())(0) / scene.body.mass.sum();
}

TEST(Corrector, ALongStepIsTakenAtOnceAndAShortOneAsPlanned) {
  const Controlled controlled;
  const physics::Body& body = controlled.creature.scene.body;
  physics::State reference = controlled.rest;
  reference.x.row(1).array() += 0.03;  // feet are up by plan
  const double height = (reference.x.row(1) * body.mass)(0) / body.mass.sum() - controlled.creature.scene.ground.offset;
  const double ahead_s = CorrectorOptions().step_ahead * std::sqrt(height / 9.81);
  for (const Eigen::Vector3d& direction : {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(-1, 0, 0), Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0, 0, -1)}) {
    for (const double long_steps : {0.9, 2.5}) {
      physics::State state = reference;
      state.v.colwise() += long_steps * CorrectorOptions().long_step * height / ahead_s * direction;
      double foot[2];
      for (const bool at_once : {false, true}) {
        CorrectorOptions options;
        options.cone_weight = 0;
        if (!at_once) options.long_step = std::numeric_limits<double>::infinity();
        Corrector corrector = controlled.corrector(options);
        Eigen::VectorXd activation = controlled.passive;
        corrector.correct(state, reference, controlled.on_three_legs(), activation);
        foot[at_once] = foot_after(controlled, activation, state);
      }
      SCOPED_TRACE(::testing::Message() << long_steps << " long steps along " << direction.transpose());
      if (long_steps < 1) {
        EXPECT_EQ(foot[1], foot[0]);
      } else {
        EXPECT_LT(foot[1], foot[0] - 1e-4);
      }
    }
  }
}

TEST(Corrector, AFootThatTouchesAgainstThePlanIsNotPulledAtWhileALongStepIsTaken) {
  // As in DoesNotPullAtTheGround, but nothing is to bear load: the left feet do, and the others are off the ground by plan.
  const Controlled controlled;
  ContactNow contact = controlled.bearing();
  contact.bearing.assign(contact.bearing.size(), false);
  const double share = 1 / static_cast<double>(contact.touching.size());
  physics::State state = controlled.rest;
  for (Eigen::Index i = 0; i < state.x.cols(); ++i) {
    state.v.col(i) = Eigen::Vector3d(5, 0, 0).cross(state.x.col(i) - Eigen::Vector3d(0, 0, 0.4));
  }
  Eigen::VectorXd activation = controlled.passive;
  Corrector corrector = controlled.corrector();
  corrector.correct(state, controlled.rest, contact, activation);
  EXPECT_NE(corrector.least_margin(), 0);
  EXPECT_GT(corrector.least_margin() / share, -0.05);
  contact.on_leg.assign(contact.on_leg.size(), false);
  Corrector trunk = controlled.corrector();
  trunk.correct(state, controlled.rest, contact, activation);
  EXPECT_EQ(trunk.least_margin(), 0) << "what is on no leg does not step";
}

TEST(Corrector, KeepsToTheLimit) {
  const Controlled controlled;
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    physics::State state = controlled.rest;
    state.v += physics::random_points(random, state.x.cols(), 20);
    state.v.colwise() += Eigen::Vector3d(8, 0, 0);
    Eigen::VectorXd activation = physics::random_activation(random, controlled.creature.scene.body, kLimit);
    Corrector corrector = controlled.corrector();
    corrector.correct(state, controlled.rest, controlled.standing, activation);
    EXPECT_LE(activation.maxCoeff(), 1 + kLimit);
    EXPECT_GE(activation.minCoeff(), 1 - kLimit);
    EXPECT_GT((activation.array() - 1).abs().maxCoeff(), 0.999 * kLimit);
  }
}

TEST(Corrector, AnswersTwiceTheErrorWithTwiceTheMusclesOrWithMoreWhereItIsCalm) {
  const Controlled controlled;
  const auto answer = [&](double share, double calm) {
    physics::State state = controlled.rest;
    state.v.colwise() += share * Eigen::Vector3d(0.05, 0, 0.02);
    CorrectorOptions options;
    options.calm = calm;
    options.long_step = std::numeric_limits<double>::infinity();  // cones are not linear
    Corrector corrector = controlled.corrector(options);
    Eigen::VectorXd activation = controlled.passive;
    corrector.correct(state, controlled.rest, controlled.standing, activation);
    return corrector.muscles_now();
  };
  EXPECT_LT((2 * answer(1, 0) - answer(2, 0)).norm(), 1e-9 * answer(2, 0).norm());
  const double usual = CorrectorOptions().calm;
  EXPECT_GT(answer(2, usual).norm(), 2.1 * answer(1, usual).norm());
  EXPECT_LT(answer(0.01, usual).norm(), 0.9 * answer(0.01, 0).norm());
  EXPECT_GT(answer(10, usual).norm(), 0.98 * answer(10, 0).norm());
}

TEST(Corrector, LessEffortIsSpentWhereItCostsMore) {
  const Controlled controlled;
  physics::State state = controlled.rest;
  state.v.colwise() += Eigen::Vector3d(0.2, 0, 0);
  double last = 1e300;
  for (const double effort : {0.1, 0.8, 6.0, 50.0}) {
    CorrectorOptions options;
    options.effort = effort;
    Corrector corrector = controlled.corrector(options);
    Eigen::VectorXd activation = controlled.passive;
    const double spent = corrector.correct(state, controlled.rest, controlled.standing, activation);
    EXPECT_LT(spent, last);
    last = spent;
  }
}

TEST(Corrector, ForgetsWhenReset) {
  const Controlled controlled;
  physics::State state = controlled.rest;
  state.v.colwise() += Eigen::Vector3d(0.2, 0, 0);
  Corrector corrector = controlled.corrector();
  Eigen::VectorXd first = controlled.passive, again = controlled.passive;
  corrector.correct(state, controlled.rest, controlled.standing, first);
  corrector.reset();
  corrector.correct(state, controlled.rest, controlled.standing, again);
  EXPECT_EQ(first, again);
}

}  // namespace
}  // namespace hydrostat::retarget::corrector_test
