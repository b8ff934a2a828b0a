#include "retarget/cost_to_go.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <future>
#include <random>

#include "retarget/contact_loads.h"
#include "retarget/cost_source.h"
#include "retarget/equilibrium.h"
#include "retarget/linear_step.h"
#include "retarget/muscle_response.h"
#include "retarget/replay.h"
#include "retarget/sag.h"
#include "tests/retarget/box_performer.h"

namespace hydrostat::retarget::cost_to_go_test {
namespace {

constexpr double kStep = 1.0 / 120;  // [s]

struct Regulated {
  Performer performer;
  SignalSet signals = signals_of(performer);
  signal::Synthesiser player{activations(signals)};
  Eigen::VectorXd off = Eigen::VectorXd::Zero(performer.scene.body.edge_count());  // E: of the signals, which leave the plan by it

  explicit Regulated(Performer of = make_box_performer()) : performer(std::move(of)) {}
  RegulatedMotion motion() {
    return {performer.scene, performer.muscles, performer.prepared, performer.path,
            [this](double time_s, Eigen::VectorXd& activation) {
              player.at(time_s, activation);
              activation += off;
            },
            performer.length};
  }
  PlannedMoment moment(long step, ContactState touch) {
    PlannedMoment moment;
    const MotionCurve curve(performer.prepared.target);
    curve.at(static_cast<double>(step) * kStep, moment.state.x, moment.state.v);
    moment.activation.resize(performer.scene.body.edge_count());
    player.at(static_cast<double>(step) * kStep, moment.activation);
    moment.touching.assign(static_cast<std::size_t>(performer.scene.contact_points.count()), touch);
    moment.patch.assign(moment.touching.size(), -1);
    const std::vector<Patch>& patches = performer.prepared.contacts.patches;
    for (std::size_t k = 0; k < patches.size(); ++k) {
      for (const int p : patches[k].points) moment.patch[static_cast<std::size_t>(p)] = static_cast<int>(k);
    }
    return moment;
  }
  /// Halfway through the step, as the regulator takes it but for its settling.
  PlannedMoment planned(long step) {
    PlannedMoment moment = this->moment(step, ContactState::kStick);
    const double time_s = (static_cast<double>(step) + 0.5) * kStep;
    MotionCurve(performer.prepared.target).at(time_s, moment.state.x, moment.state.v);
    player.at(time_s, moment.activation);
    moment.activation += off;
    return moment;
  }
  Eigen::Matrix3Xd acceleration(long step) const {
    const Motion& target = performer.prepared.target;
    const MotionCurve curve(target);
    const double time_s = (static_cast<double>(step) + 0.5) * kStep;
    physics::State before, after;
    curve.at(time_s - 0.5 / target.rate_hz, before.x, before.v);
    curve.at(time_s + 0.5 / target.rate_hz, after.x, after.v);
    return (after.v - before.v) * target.rate_hz;
  }
  PlannedMoment settled(long step) {
    PlannedMoment moment = planned(step);
    Equilibrium(performer.scene, performer.length).settle(acceleration(step), moment);
    return moment;
  }
  /// R: what the step's model makes of the speeds of a body on the plan.
  Eigen::VectorXd drift(long step, const LinearStep& linear, const ReducedModes& modes) {
    const Eigen::Matrix3Xd settling = settled(step).state.x - planned(step).state.x;
    return -linear.carry.leftCols(modes.count()) * (modes.project * settling.reshaped()) / performer.length;
  }
};

/// 2R x muscles: what muscles make of places and speeds in a step.
Eigen::MatrixXd whole_drive(const LinearStep& step) {
  Eigen::MatrixXd drive(2 * step.drive.rows(), step.drive.cols());
  drive << step.advance * step.drive, step.drive;
  return drive;
}

/// 2R: what a change of speeds makes of places and speeds in a step.
Eigen::VectorXd of_speeds(const Eigen::VectorXd& change, const LinearStep& step) {
  Eigen::VectorXd both(2 * change.size());
  both << step.advance * change, change;
  return both;
}

Eigen::VectorXd random_vector(Eigen::Index size, std::mt19937& random) {
  Eigen::VectorXd vector(size);
  std::normal_distribution<double> normal;
  for (double& value : vector) value = normal(random);
  return vector;
}

TEST(ReducedModes, AreOrthonormalByMassAndHaveAllRigidMovesAndAllThatMusclesDo) {
  Regulated box;
  const physics::Body& body = box.performer.scene.body;
  const std::vector<PlannedMoment> moments{box.moment(0, ContactState::kStick), box.moment(10, ContactState::kStick)};
  const ReducedModes modes = find_reduced_modes(box.performer.scene, box.performer.muscles, moments, box.performer.length, 90);
  ASSERT_EQ(modes.count(), 90);
  EXPECT_LE((modes.project * modes.fields - Eigen::MatrixXd::Identity(90, 90)).cwiseAbs().maxCoeff(), 1e-10);
  const auto lost = [&](const Eigen::VectorXd& move) { return (move - modes.fields * (modes.project * move)).norm() / move.norm(); };
  for (const PlannedMoment& moment : moments) {
    for (int c = 0; c < 3; ++c) {
      Eigen::Matrix3Xd turn = moment.state.x;
      for (auto point : turn.colwise()) point = Eigen::Vector3d::Unit(c).cross(Eigen::Vector3d(point)).eval();
      EXPECT_LE(lost(turn.reshaped()), 1e-3) << "turn " << c;
      EXPECT_LE(lost(Eigen::Vector3d::Unit(c).replicate(body.node_count(), 1)), 1e-4) << "move " << c;
    }
  }
  physics::InternalForces<3> forces(body);
  forces.set_activation(moments[0].activation);
  MuscleResponse response(box.performer.scene, box.performer.muscles, 1.0 / 30, contact_stiffness(box.performer.scene, box.performer.length, 1.0 / 30),
                          Eigen::VectorXd::Ones(3 * body.node_count()));
  ASSERT_TRUE(response.update(moments[0].state, forces, moments[0].touching, 1));
  for (const auto muscle : response.velocities().colwise()) EXPECT_LE(lost(muscle), 0.1);
}

/// What muscles do slowly to a soft body, too: without it a creature of 250 nodes that stood on its toes slid apart over 15 s. Of a box so soft
/// that it swings at a few Hz less than 0.19 of an answer is lost, and 0.21 where modes are answers of up to 0.1 s.
TEST(ReducedModes, HaveWhatMusclesDoSlowly) {
  Regulated box;
  physics::Scene& scene = box.performer.scene;
  stiffen(0.02, scene.body);
  const std::vector<PlannedMoment> moments{box.moment(0, ContactState::kStick), box.moment(10, ContactState::kStick)};
  const ReducedModes modes = find_reduced_modes(scene, box.performer.muscles, moments, box.performer.length, 90);
  physics::InternalForces<3> forces(scene.body);
  forces.set_activation(moments[0].activation);
  MuscleResponse response(scene, box.performer.muscles, 1, contact_stiffness(scene, box.performer.length, 1),
                          Eigen::VectorXd::Ones(3 * scene.body.node_count()));
  ASSERT_TRUE(response.update(moments[0].state, forces, moments[0].touching, 1));
  for (const auto answer : response.velocities().colwise()) {
    EXPECT_LE((answer - modes.fields * (modes.project * answer)).norm(), 0.19 * answer.norm());
  }
}

/// A clip in which nothing touches the ground has no answers of contact.
TEST(ReducedModes, AreFoundWhereNothingEverTouches) {
  Regulated box;
  const std::vector<PlannedMoment> moments{box.moment(0, ContactState::kOff), box.moment(10, ContactState::kOff)};
  const ReducedModes modes = find_reduced_modes(box.performer.scene, box.performer.muscles, moments, box.performer.length, 40);
  ASSERT_EQ(modes.count(), 40);
  EXPECT_TRUE((modes.project * modes.fields).isIdentity(1e-9));
}

/// Of all modes and in the air a linear step is what the implicit integrator makes of a small difference.
TEST(LinearSteps, AreTheDerivativeOfAStepInTheAir) {
  Regulated box;
  const physics::Body& body = box.performer.scene.body;
  const double length = box.performer.length, wave_speed = std::sqrt(9.81 * length), h = kStep / 512;
  const PlannedMoment moment = box.moment(3, ContactState::kOff);
  const Eigen::VectorXd root_mass = body.mass.transpose().replicate<3, 1>().reshaped().cwiseSqrt();
  const ReducedModes modes{Eigen::MatrixXd(root_mass.cwiseInverse().asDiagonal()), Eigen::MatrixXd(root_mass.asDiagonal())};
  const LinearStep step = LinearSteps(box.performer.scene, box.performer.muscles, modes, length, h).at(moment);
  physics::Scene flying = box.performer.scene;
  flying.has_ground = false;
  const auto stepped = [&](physics::State state, const Eigen::VectorXd& muscles) {
    const auto stepper = physics::make_implicit_stepper<3>(flying);
    physics::Impulses impulses = physics::make_impulses(flying);
    const Eigen::VectorXd activation = moment.activation + box.performer.muscles.fields * muscles;
    EXPECT_EQ(stepper->step(h, activation, nullptr, state, impulses), physics::Termination::kDone);
    return state;
  };
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(box.performer.muscles.fields.cols());
  const physics::State planned = stepped(moment.state, none);
  for (unsigned seed = 0; seed < 6; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    physics::State state = moment.state;
    state.x += 1e-6 * random_vector(3 * body.node_count(), random).reshaped(3, body.node_count());
    state.v += 1e-4 * random_vector(3 * body.node_count(), random).reshaped(3, body.node_count());
    const Eigen::VectorXd muscles = 1e-4 * random_vector(none.size(), random);
    const auto along = [&](const physics::State& one, const physics::State& other) {
      return deviation_along(modes, Eigen::Matrix3d::Identity(), one, other, length, wave_speed);
    };
    const Eigen::VectorXd expected = along(stepped(state, muscles), planned);
    const Eigen::VectorXd told = step.after(along(state, moment.state), muscles);
    EXPECT_LE((told - expected).norm(), 0.03 * expected.norm());
  }
}

/// Of one foot's touching points only the middle is held: no torque of the ground ends its turning, for soles cannot pull.
TEST(LinearSteps, HoldAFootInPlaceAndLetItTurn) {
  Regulated box;
  const physics::Body& body = box.performer.scene.body;
  const physics::ContactPoints& contacts = box.performer.scene.contact_points;
  const Eigen::VectorXd root_mass = body.mass.transpose().replicate<3, 1>().reshaped().cwiseSqrt();
  const ReducedModes modes{Eigen::MatrixXd(root_mass.cwiseInverse().asDiagonal()), Eigen::MatrixXd(root_mass.asDiagonal())};
  LinearSteps steps(box.performer.scene, box.performer.muscles, modes, box.performer.length, kStep);
  PlannedMoment moment = box.moment(0, ContactState::kStick);
  const LinearStep in_air = steps.at(box.moment(0, ContactState::kOff));
  std::vector<int> foot;
  for (int p = 0; p < contacts.count(); ++p) {
    if (moment.patch[static_cast<std::size_t>(p)] == 0) foot.push_back(p);
    else moment.touching[static_cast<std::size_t>(p)] = ContactState::kOff;
  }
  ASSERT_GT(foot.size(), 2U);
  const LinearStep standing = steps.at(moment);
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const int p : foot) middle += contacts.of(moment.state.x, p) / static_cast<double>(foot.size());

  /// What becomes of the foot's moving as `wanted` (of a place off its middle) tells, when the whole body moves so.
  const auto left_of = [&](const LinearStep& step, const auto& wanted) {
    Eigen::Matrix3Xd speeds(3, body.node_count());
    for (int i = 0; i < body.node_count(); ++i) speeds.col(i) = wanted(Eigen::Vector3d(moment.state.x.col(i) - middle));
    Eigen::VectorXd z = Eigen::VectorXd::Zero(2 * modes.count());
    z.tail(modes.count()) = modes.project * speeds.reshaped();
    const Eigen::VectorXd after = step.after(z, Eigen::VectorXd::Zero(step.drive.cols()));
    const Eigen::Matrix3Xd moved = (modes.fields * after.tail(modes.count())).reshaped(3, body.node_count());
    double left = 0;
    for (const int p : foot) left += contacts.of(moved, p).dot(wanted(Eigen::Vector3d(contacts.of(moment.state.x, p) - middle)));
    return left;
  };
  for (int c = 0; c < 3; ++c) {
    const auto turn = [c](const Eigen::Vector3d& r) -> Eigen::Vector3d { return Eigen::Vector3d::Unit(c).cross(r); };
    const auto shift = [c](const Eigen::Vector3d&) -> Eigen::Vector3d { return Eigen::Vector3d::Unit(c); };
    EXPECT_GT(left_of(standing, turn), 0.7 * left_of(in_air, turn)) << "about axis " << c;
    EXPECT_LT(left_of(standing, shift), 0.3 * left_of(in_air, shift)) << "along axis " << c;
  }
}

/// What is promised is what the best muscles come to: of any others the next cost and the step's own are together more.
TEST(CostToGo, IsTheLeastThatADeviationComesTo) {
  Regulated box;
  std::mt19937 noise(1);
  box.off = 0.02 * random_vector(box.off.size(), noise);
  RegulatorOptions options;
  options.modes = 60;
  const CostToGo cost = find_cost_to_go(box.motion(), kStep, options);
  ASSERT_TRUE(cost.is_sound());
  ASSERT_EQ(cost.modes().count(), 60);
  LinearSteps steps(box.performer.scene, box.performer.muscles, cost.modes(), box.performer.length, kStep);
  const double mass = box.performer.scene.body.mass.sum();
  const long period = std::lround(box.performer.prepared.target.duration_s() / kStep);
  for (const long k : {0L, period / 3, period - 2}) {
    SCOPED_TRACE("step " + std::to_string(k));
    const LinearStep step = steps.at(box.settled(k));
    const double now_s = static_cast<double>(k) * kStep;
    const Eigen::MatrixXd next = cost.at(now_s + kStep).cast<double>();
    const Eigen::VectorXd next_pull = cost.pull(now_s + kStep).cast<double>(), drift = of_speeds(box.drift(k, step, cost.modes()), step);
    const Eigen::MatrixXd drive = whole_drive(step);
    Eigen::MatrixXd left = drive.transpose() * next * drive;
    left.diagonal().array() += options.effort;
    for (unsigned seed = 0; seed < 10; ++seed) {
      std::mt19937 random(seed);
      const Eigen::VectorXd z = 0.01 * random_vector(120, random);
      const Eigen::VectorXd none = Eigen::VectorXd::Zero(120);
      const double here = (options.place * z.head(60).squaredNorm() + options.speed * z.tail(60).squaredNorm()) / mass;
      const auto comes_to = [&](const Eigen::VectorXd& from, const Eigen::VectorXd& muscles) {
        const Eigen::VectorXd after = step.after(from, muscles) + drift;
        return options.effort * muscles.squaredNorm() + cost.of(after, now_s + kStep) + 2 * next_pull.dot(after);
      };
      const auto best = [&](const Eigen::VectorXd& from) -> Eigen::VectorXd {
        const Eigen::VectorXd free = step.after(from, Eigen::VectorXd::Zero(drive.cols())) + drift;
        return -left.ldlt().solve(drive.transpose() * (next * free + next_pull));
      };
      const double told = cost.of(z, now_s) + 2 * cost.pull(now_s).cast<double>().dot(z), least = comes_to(z, best(z));
      EXPECT_NEAR(here + least - comes_to(none, best(none)), told, 2e-3 * cost.of(z, now_s));
      EXPECT_GT(comes_to(z, best(z) + 0.1 * best(z).norm() * random_vector(drive.cols(), random).normalized()), least);
      EXPECT_GT(cost.of(z, now_s), here);
    }
  }
}

/// What a lasting disturbance adds to the cost of a deviation is what the best muscles come to, too.
TEST(CostToGo, KnowsWhatALastingDisturbanceAdds) {
  Regulated box;
  RegulatorOptions options;
  options.modes = 60;
  const CostToGo cost = find_cost_to_go(box.motion(), kStep, options);
  LinearSteps steps(box.performer.scene, box.performer.muscles, cost.modes(), box.performer.length, kStep);
  const long k = 5;
  const LinearStep step = steps.at(box.settled(k));
  const Eigen::MatrixXd next = cost.at((k + 1) * kStep).cast<double>(), beside = options.last * cost.at_disturbed((k + 1) * kStep).cast<double>();
  const Eigen::MatrixXd drive = whole_drive(step);
  Eigen::MatrixXd left = drive.transpose() * next * drive;
  left.diagonal().array() += options.effort;
  const auto least = [&](const Eigen::VectorXd& z, const Eigen::VectorXd& disturbance) {
    const Eigen::VectorXd free = step.after(z, Eigen::VectorXd::Zero(drive.cols())) + disturbance;
    const Eigen::VectorXd muscles = -left.ldlt().solve(drive.transpose() * (next * free + beside * disturbance));
    const Eigen::VectorXd after = free + drive * muscles;
    return options.effort * muscles.squaredNorm() + after.dot(next * after) + 2 * after.dot(beside * disturbance);
  };
  for (unsigned seed = 0; seed < 10; ++seed) {
    std::mt19937 random(seed);
    const Eigen::VectorXd z = 0.01 * random_vector(120, random), none = Eigen::VectorXd::Zero(120);
    const Eigen::VectorXd disturbance = 0.01 * random_vector(120, random);
    const double added = least(z, disturbance) - least(z, none) - least(none, disturbance);
    const double told = 2 * z.dot(cost.at_disturbed(k * kStep).cast<double>() * disturbance);
    EXPECT_NEAR(told, added, 2e-3 * std::sqrt(least(z, none) * least(none, disturbance)));
  }
}

/// The box that bobs as it turns by `yaw` a period.
Performer turning_box(double yaw) {
  Performer performer = make_box_performer(24);
  Motion& target = performer.prepared.target;
  for (Eigen::Index f = 0; f < target.count(); ++f) {
    const double turned = yaw * static_cast<double>(f) / static_cast<double>(target.count());
    target.at(f) = (Eigen::AngleAxisd(turned, Eigen::Vector3d::UnitY()).toRotationMatrix() * target.at(f)).eval();
  }
  target.yaw = yaw;
  return performer;
}

/// What a loop that turns has left over at its end costs what it costs in the next period, which begins turned: seen as a replay sees it.
TEST(CostToGo, PassesTheSeamOfATurningLoop) {
  constexpr int kModes = 60;
  constexpr double kFarOff = 0.02;  // share of the costs that lies further ahead than a second
  for (const double yaw : {0.3, -0.5, 0.7}) {
    SCOPED_TRACE("yaw " + std::to_string(yaw));
    Regulated box(turning_box(yaw));
    std::mt19937 noise(1);
    box.off = 0.02 * random_vector(box.off.size(), noise);
    RegulatorOptions options;
    options.modes = kModes;
    options.effort = 1e-4;  // most of it is met within that second
    options.place = 0;  // a place that nothing brings back would cost the more the further one looks ahead
    const CostToGo cost = find_cost_to_go(box.motion(), kStep, options);
    ASSERT_TRUE(cost.is_sound());
    LinearSteps steps(box.performer.scene, box.performer.muscles, cost.modes(), box.performer.length, kStep);
    const Eigen::Matrix3d heading = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()).toRotationMatrix();
    const physics::State reference = box.moment(0, ContactState::kStick).state;
    const auto in_next_period = [&](const Eigen::VectorXd& z) {
      physics::State state = reference;
      state.x += (cost.modes().fields * z.head(kModes)).reshaped(3, state.x.cols());
      state.v += (cost.modes().fields * z.tail(kModes)).reshaped(3, state.v.cols());
      return deviation_along(cost.modes(), heading, state, reference, 1, 1);
    };
    const long last = std::lround(box.performer.prepared.target.duration_s() / kStep) - 1;
    const double last_s = static_cast<double>(last) * kStep, mass = box.performer.scene.body.mass.sum();
    const LinearStep step = steps.at(box.settled(last));
    const Eigen::MatrixXd next = cost.at(0).cast<double>(), beside = options.last * cost.at_disturbed(0).cast<double>();
    const Eigen::VectorXd next_pull = cost.pull(0).cast<double>();
    const Eigen::VectorXd drift = in_next_period(of_speeds(box.drift(last, step, cost.modes()), step));
    Eigen::MatrixXd drive = whole_drive(step);
    for (auto column : drive.colwise()) column = in_next_period(column).eval();
    Eigen::MatrixXd left = drive.transpose() * next * drive;
    left.diagonal().array() += options.effort;
    const auto least = [&](const Eigen::VectorXd& z, const Eigen::VectorXd& disturbance) {
      const Eigen::VectorXd held = in_next_period(disturbance);
      const Eigen::VectorXd free = in_next_period(step.after(z, Eigen::VectorXd::Zero(drive.cols()))) + drift + held;
      const Eigen::VectorXd beside_it = next_pull + beside * held;
      const Eigen::VectorXd muscles = -left.ldlt().solve(drive.transpose() * (next * free + beside_it));
      const Eigen::VectorXd after = free + drive * muscles;
      return options.effort * muscles.squaredNorm() + after.dot(next * after) + 2 * after.dot(beside_it);
    };
    double off = 0, all = 0, off_disturbed = 0, all_disturbed = 0;
    for (unsigned seed = 0; seed < 5; ++seed) {
      std::mt19937 random(seed);
      const Eigen::VectorXd z = 0.01 * random_vector(2 * kModes, random), none = Eigen::VectorXd::Zero(2 * kModes);
      const Eigen::VectorXd disturbance = 0.01 * random_vector(2 * kModes, random);
      const double here = (options.place * z.head(kModes).squaredNorm() + options.speed * z.tail(kModes).squaredNorm()) / mass;
      off += std::abs(here + least(z, none) - least(none, none) - cost.of(z, last_s) - 2 * cost.pull(last_s).cast<double>().dot(z));
      all += cost.of(z, last_s);
      const double added = least(z, disturbance) - least(z, none) - least(none, disturbance) + least(none, none);
      const double told = 2 * z.dot(cost.at_disturbed(last_s).cast<double>() * disturbance);
      off_disturbed += std::abs(told - added);
      all_disturbed += std::sqrt(cost.of(z, last_s) * cost.of(disturbance, last_s));
    }
    EXPECT_LE(off, kFarOff * all);
    EXPECT_LE(off_disturbed, kFarOff * all_disturbed);
  }
}

TEST(CostToGo, OfALoopReturnsAndOfAOneShotStands) {
  Regulated box;
  RegulatorOptions options;
  options.modes = 30;
  const CostToGo loop = find_cost_to_go(box.motion(), kStep, options);
  const double period = box.performer.prepared.target.duration_s();
  EXPECT_EQ(loop.at(0.3 * period), loop.at(2.3 * period));
  box.performer.prepared.target.loop = false;
  const CostToGo once = find_cost_to_go(box.motion(), kStep, options);
  EXPECT_EQ(once.at(period), once.at(5 * period));
  EXPECT_NE(once.at(0), once.at(period));
}

RegulatorOptions reaching(double reach) {
  RegulatorOptions options;
  options.modes = 30;
  options.reach = reach;
  return options;
}

TEST(CostSource, IsFoundOnceWhoeverAsksAndHoweverFarARegulatorReaches) {
  Regulated box;
  const CostSource costs(box.motion());
  EXPECT_EQ(costs.times_found(), 0) << "nobody asked";
  auto beside = std::async(std::launch::async, [&] { return costs.cost(kStep, reaching(1e-3)); });
  const std::shared_ptr<const CostToGo> cost = costs.cost(kStep, reaching(1));
  ASSERT_NE(cost, nullptr);
  EXPECT_EQ(beside.get(), cost);
  EXPECT_EQ(costs.cost(kStep, reaching(1e-2)), cost);
  EXPECT_EQ(costs.times_found(), 1);
}

TEST(CostSource, IsFoundAnewForOtherSettingsAndAsByAnyoneElse) {
  Regulated box;
  const CostSource costs(box.motion());
  RegulatorOptions other[6];
  for (RegulatorOptions& options : other) options = reaching(1);
  other[1].modes = 20;
  other[2].place = 2;
  other[3].speed = 0.2;
  other[4].effort = 1e-2;
  other[5].last = 0.2;
  int times = 0;
  for (const double step_s : {kStep, kStep / 2}) {
    for (const RegulatorOptions& options : other) {
      SCOPED_TRACE(++times);
      const std::shared_ptr<const CostToGo> cost = costs.cost(step_s, options);
      const CostToGo alone = find_cost_to_go(box.motion(), step_s, options);
      EXPECT_EQ(cost->at(0.05), alone.at(0.05));
      EXPECT_EQ(cost->at_disturbed(0.05), alone.at_disturbed(0.05));
      EXPECT_EQ(costs.times_found(), times);
    }
  }
  costs.cost(kStep, other[5]);
  EXPECT_EQ(costs.times_found(), times + 1) << "another control step alone";
}

TEST(CostSource, KnowsItsMotion) {
  Regulated box, twin;
  const CostSource costs(box.motion());
  const Performer &own = box.performer, &other = twin.performer;
  EXPECT_TRUE(costs.is_of(own.scene, own.muscles, own.prepared, &own.path));
  EXPECT_FALSE(costs.is_of(other.scene, own.muscles, own.prepared, &own.path));
  EXPECT_FALSE(costs.is_of(own.scene, other.muscles, own.prepared, &own.path));
  EXPECT_FALSE(costs.is_of(own.scene, own.muscles, other.prepared, &own.path));
  EXPECT_FALSE(costs.is_of(own.scene, own.muscles, own.prepared, nullptr));
}

/// The moments of internal forces cancel, wherever nodes have moved, dashpots at work among them.
TEST(LinearSteps, TurnNoBodyFromInside) {
  Regulated box;
  const physics::Body& body = box.performer.scene.body;
  const Eigen::VectorXd root_mass = body.mass.transpose().replicate<3, 1>().reshaped().cwiseSqrt();
  const ReducedModes modes{Eigen::MatrixXd(root_mass.cwiseInverse().asDiagonal()), Eigen::MatrixXd(root_mass.asDiagonal())};
  constexpr double kShort = kStep / 4096;  // [s] in which nothing but forces changes speeds
  LinearSteps steps(box.performer.scene, box.performer.muscles, modes, box.performer.length, kShort);
  physics::InternalForces<3> forces(body);
  for (const long k : {1L, 7L, 15L}) {
    const PlannedMoment moment = box.moment(k, ContactState::kOff);
    forces.set_activation(moment.activation);
    Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, body.node_count());
    forces.add_forces(moment.state, force);
    const LinearStep step = steps.at(moment);
    for (unsigned seed = 0; seed < 5; ++seed) {
      SCOPED_TRACE("step " + std::to_string(k) + ", seed " + std::to_string(seed));
      std::mt19937 random(seed);
      const Eigen::Matrix3Xd moved = 1e-3 * random_vector(3 * body.node_count(), random).reshaped(3, body.node_count());
      Eigen::VectorXd z = Eigen::VectorXd::Zero(2 * modes.count());
      z.head(modes.count()) = modes.project * moved.reshaped() / box.performer.length;
      const Eigen::VectorXd after = step.after(z, Eigen::VectorXd::Zero(step.drive.cols()));
      const double per_speed = std::sqrt(9.81 * box.performer.length) / kShort;
      const Eigen::Matrix3Xd changed = per_speed * (modes.fields * after.tail(modes.count())).reshaped(3, body.node_count()) * body.mass.asDiagonal();
      Eigen::Vector3d turning = Eigen::Vector3d::Zero();
      double lever = 0;
      for (int i = 0; i < body.node_count(); ++i) {
        turning += Eigen::Vector3d(moment.state.x.col(i)).cross(Eigen::Vector3d(changed.col(i))) +
                   Eigen::Vector3d(moved.col(i)).cross(Eigen::Vector3d(force.col(i)));
        lever += moved.col(i).norm() * force.col(i).norm();
      }
      EXPECT_LE(turning.norm(), 1e-3 * lever);
    }
  }
}

/// Tipped about the line that it stands on, a body is turned further by its weight and by what its plan accelerates, and by nothing else;
/// about the plan itself, where forces do not balance, it would be turned by these.
TEST(LinearSteps, TipABodyOverALineByItsWeightAloneWhereForcesBalance) {
  Regulated box(make_box_performer(12, make_tiptoe_box()));
  const physics::Body& body = box.performer.scene.body;
  const Eigen::VectorXd root_mass = body.mass.transpose().replicate<3, 1>().reshaped().cwiseSqrt();
  const ReducedModes modes{Eigen::MatrixXd(root_mass.cwiseInverse().asDiagonal()), Eigen::MatrixXd(root_mass.asDiagonal())};
  constexpr double kShort = kStep / 256;  // [s]
  LinearSteps steps(box.performer.scene, box.performer.muscles, modes, box.performer.length, kShort);
  const Eigen::Vector3d line = Eigen::Vector3d(0.5, 0, 0.4).normalized();
  double off = 0, off_plan = 0, all = 0;
  for (long k = 0; k < 24; k += 3) {
    const Eigen::Matrix3Xd acceleration = box.acceleration(k);
    const auto moment_of_tip = [&](const PlannedMoment& moment, double& expected) {
      Eigen::Matrix3Xd tip(3, body.node_count());
      for (int i = 0; i < body.node_count(); ++i) tip.col(i) = line.cross(Eigen::Vector3d(moment.state.x.col(i)));
      Eigen::VectorXd z = Eigen::VectorXd::Zero(2 * modes.count());
      z.head(modes.count()) = modes.project * tip.reshaped() / box.performer.length;
      const Eigen::VectorXd after = steps.at(moment).after(z, Eigen::VectorXd::Zero(box.performer.muscles.fields.cols()));
      const double per_speed = std::sqrt(9.81 * box.performer.length) / kShort;
      const Eigen::Matrix3Xd changed = per_speed * (modes.fields * after.tail(modes.count())).reshaped(3, body.node_count());
      double turned = 0;
      expected = 0;
      for (int i = 0; i < body.node_count(); ++i) {
        turned += body.mass[i] * line.dot(Eigen::Vector3d(moment.state.x.col(i)).cross(Eigen::Vector3d(changed.col(i))));
        const Eigen::Vector3d load = box.performer.scene.gravity - acceleration.col(i);
        expected += body.mass[i] * line.dot(Eigen::Vector3d(tip.col(i)).cross(load));
      }
      return turned;
    };
    double expected = 0, expected_on_plan = 0;
    off += std::abs(moment_of_tip(box.settled(k), expected) - expected);
    off_plan += std::abs(moment_of_tip(box.planned(k), expected_on_plan) - expected_on_plan);
    all += std::abs(expected);
  }
  EXPECT_LE(off, 0.005 * all);
  EXPECT_GT(off_plan, 0.1 * all) << "the plan balances by itself: this tests nothing";
}

/// The same deviation in a world that is turned about the vertical is answered by the same muscles.
TEST(Regulate, DoesNotHangOnWhereTheMotionHeads) {
  Regulated box;
  CorrectorOptions options;
  options.regulator.modes = 60;
  const CostToGo cost = find_cost_to_go(box.motion(), kStep, options.regulator);
  options.regulator.reach = 1;
  options.horizon_s = kStep;
  const PlannedMoment moment = box.moment(2, ContactState::kStick);
  ContactNow contact;
  contact.touching = moment.touching;
  contact.bearing.assign(moment.touching.size(), false);
  contact.on_leg = contact.bearing;
  contact.force.setZero(3, box.performer.scene.contact_points.count());
  std::mt19937 random(5);
  physics::State seen = moment.state;
  seen.x += 1e-3 * random_vector(seen.x.size(), random).reshaped(3, seen.x.cols());
  const auto muscles_at = [&](double yaw) {
    const Eigen::Matrix3d heading = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()).toRotationMatrix();
    Corrector corrector(box.performer.scene, box.performer.muscles, box.performer.length, 0.3, options);
    Eigen::VectorXd activation = moment.activation;
    const auto turned = [&](const physics::State& state) { return physics::State{heading * state.x, heading * state.v}; };
    corrector.regulate(cost, 2 * kStep, heading, turned(seen), turned(moment.state), contact, activation);
    return Eigen::VectorXd(corrector.muscles_now());
  };
  const Eigen::VectorXd ahead = muscles_at(0);
  ASSERT_GT(ahead.norm(), 1e-4);
  for (const double yaw : {0.7, -2.0, 3.0}) EXPECT_LE((muscles_at(yaw) - ahead).norm(), 1e-6 * ahead.norm()) << yaw;
}

/// A second of a body that is up to `variation` off the plan, pushed by `push` [m/s]; regulator 0: by the usual corrector.
ReplayReport varied_box(Regulated& box, unsigned seed, double variation, double push, double regulator, double learn) {
  PerformOptions options;
  options.replay.duration_s = 1;
  options.baselines = false;
  options.seed = seed;
  options.variation = variation;
  if (push > 0) options.replay.pushes.push_back({0.2, 0, push * Eigen::Vector3d(std::cos(seed), 0, std::sin(seed))});
  options.feedback.regulator = regulator;
  options.replay.corrector.regulator.modes = 60;
  options.replay.corrector.regulator.learn = learn;
  return perform(box.performer, box.signals, options).main().report;
}

/// A body of other mass, friction and stiffness is pushed: it comes back nearer to the plan than by the corrector, by nothing but muscles.
TEST(Regulator, HoldsPushedBodiesNearerToThePlanThanTheCorrectorAndPushesNothingFromOutside) {
  Regulated box;
  double by_corrector = 0, by_regulator = 0;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const ReplayReport usual = varied_box(box, seed, 0.1, 0.1, 0, 0), regulated = varied_box(box, seed, 0.1, 0.1, 1, RegulatorOptions().learn);
    EXPECT_FALSE(regulated.fell);
    EXPECT_LT(regulated.shape_rms_length, 1.5 * usual.shape_rms_length);
    by_corrector += usual.shape_rms_length, by_regulator += regulated.shape_rms_length;
    EXPECT_GT(regulated.correction_rms, usual.correction_rms) << "it was not the corrector that acted";
    EXPECT_LE(regulated.momentum_residual_mg, 1e-6);
    EXPECT_LE(regulated.angular_residual_mgl, 1e-6);
    EXPECT_EQ(regulated.external_assist_mg, 0);
  }
  EXPECT_LT(by_regulator, 0.9 * by_corrector);
}

/// A body on two points stands on a line: by the usual corrector it tips over, by a regulator it keeps to its plan, whether this sways fast, as
/// where dashpots push hard, or slowly.
TEST(Regulator, HoldsWhatStandsOnALine) {
  struct Bob {
    Eigen::Index frames;
    double amplitude;
  };
  for (const Bob& bob : {Bob{12, 0.03}, Bob{12, 0.01}, Bob{60, 0.01}}) {
    SCOPED_TRACE(std::to_string(bob.frames) + " frames, by " + std::to_string(bob.amplitude));
    Regulated box(make_box_performer(bob.frames, make_tiptoe_box(), bob.amplitude));
    const Act act(box.performer, box.signals);
    PerformOptions options;
    options.replay.duration_s = 3;
    options.baselines = false;
    EXPECT_TRUE(perform(act, options).main().report.fell) << "it stands by itself";
    for (const double reach : {1e-3, 1.0}) {
      options.feedback.regulator = reach;
      for (options.seed = 0; options.seed < 3; ++options.seed) {
        SCOPED_TRACE("reach " + std::to_string(reach) + ", seed " + std::to_string(options.seed));
        const ReplayReport report = perform(act, options).main().report;
        EXPECT_FALSE(report.fell);
        EXPECT_LE(report.shape_rms_length, 1e-3);
        EXPECT_LE(report.held_slip_per_stance_length, 1e-6);
        EXPECT_LE(report.angular_residual_mgl, 1e-6);
      }
    }
    options.feedback = {};
  }
}

/// What very different bodies do otherwise all the time is learned as a disturbance, and met.
TEST(Regulator, HoldsOtherBodiesNearerWhereItLearnsHowTheyDiffer) {
  Regulated box;
  double learned = 0, not_learned = 0;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    learned += varied_box(box, seed, 0.4, 0, 1, RegulatorOptions().learn).shape_rms_length;
    not_learned += varied_box(box, seed, 0.4, 0, 1, 0).shape_rms_length;
  }
  EXPECT_LT(learned, 0.75 * not_learned);
}

}  // namespace
}  // namespace hydrostat::retarget::cost_to_go_test
