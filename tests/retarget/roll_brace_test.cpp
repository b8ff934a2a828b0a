#include "retarget/roll_brace.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>
#include <string>

#include "retarget/long_axis.h"
#include "tests/retarget/box_creature.h"

namespace hydrostat::retarget::roll_brace_test {
namespace {

constexpr double kStep = 1.0 / 120, kCell = 0.03, kGravity = 9.81, kPeriod = 2;
const Eigen::Vector3d kUp = Eigen::Vector3d::UnitY();

Eigen::Matrix3d turn(double angle, const Eigen::Vector3d& about) { return Eigen::AngleAxisd(angle, about).toRotationMatrix(); }

/// A round log along x: 12 x 3 x 3 cells without those at its four long edges.
physics::Scene log_on_ground() {
  const auto is_round = [](int, int j, int k) { return j == 1 || k == 1; };
  physics::Material material;
  material.youngs_modulus = material.density * kGravity * 12 * kCell / 0.02;
  physics::Body body = physics::body_of(physics::make_lattice(12, 3, 3, kCell, is_round), material);
  std::vector<int> all(static_cast<std::size_t>(body.node_count()));
  for (int i = 0; i < body.node_count(); ++i) all[static_cast<std::size_t>(i)] = i;
  return physics::scene_of(std::move(body), all);
}

/// The body lies on patches in `state` and turns by `yaw` [rad] in a cycle.
PreparedTarget lying(const physics::Body& body, ContactState state, double yaw = 0) {
  PreparedTarget plan;
  plan.target.rate_hz = 30;
  plan.target.loop = true;
  plan.target.frames = body.rest.reshaped().replicate(1, 60);
  plan.target.yaw = yaw;
  plan.contacts.patches.resize(1);
  plan.contacts.state = {std::vector<ContactState>(60, state)};
  return plan;
}

const physics::Scene& the_log() {
  static const physics::Scene scene = log_on_ground();
  return scene;
}

/// The log as it lies, turned by `rotation` about its centre.
physics::State at_rest(const Eigen::Matrix3d& rotation = Eigen::Matrix3d::Identity()) {
  const physics::Body& body = the_log().body;
  const Eigen::Vector3d centre = physics::centre_of_mass(body, body.rest);
  return {(rotation * (body.rest.colwise() - centre)).colwise() + centre, Eigen::Matrix3Xd::Zero(3, body.node_count())};
}

/// The log moves as if it rolled on the ground by `rate` [rad/s], or slides across itself with `speed` [m/s].
physics::State moving(double rate, double speed) {
  physics::State state = at_rest();
  state.v.row(2).setConstant(speed);
  Eigen::Vector3d below = physics::centre_of_mass(the_log().body, state.x);
  below.y() = the_log().ground.offset;
  for (int i = 0; i < state.x.cols(); ++i) state.v.col(i) += rate * Eigen::Vector3d::UnitX().cross(state.x.col(i) - below);
  return state;
}

/// A brace of the log once it has lain for a second, turned by `rotation` from its target.
RollBrace after(const PreparedTarget& plan, const Eigen::Matrix3d& rotation, double time_s = 0) {
  RollBrace brace(plan, the_log());
  const RigidFit fit{rotation, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), 0};
  for (int k = 0; k < 120; ++k) brace.follow(fit, at_rest(), at_rest(rotation), time_s, kStep);
  return brace;
}

/// A brace of the log that lies as it should, after a tenth of a second of such velocities.
RollBrace after(const physics::State& reference, const physics::State& state) {
  RollBrace brace(lying(the_log().body, ContactState::kSlide), the_log());
  const RigidFit fit{Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), 0};
  for (int k = 0; k < 12; ++k) brace.follow(fit, reference, state, 0, kStep);
  return brace;
}

Eigen::VectorXd change(const RollBrace& brace, const physics::Body& body) {
  Eigen::VectorXd activation = Eigen::VectorXd::Ones(body.edge_count());
  brace.apply(activation);
  return activation.array() - 1;
}

/// The direction, seen from the body, in which constraints along its axis are commanded the longer the farther they lie.
Eigen::Vector3d side_of(const Eigen::VectorXd& change, const physics::Body& body) {
  const LongAxis axis = long_axis(body, lying(body, ContactState::kSlide).target);
  const Eigen::MatrixX3d bends = bends_across(axis, body.edges);
  return (bends.transpose() * bends).ldlt().solve(bends.transpose() * change).normalized();
}

TEST(RollBrace, LeavesAloneLegsStockyBodiesAndWhatHasNoWeight) {
  const physics::Scene& log = the_log();
  const physics::Scene box = make_box_creature().scene;
  physics::Scene weightless = log;
  weightless.gravity.setZero();
  EXPECT_TRUE(RollBrace(lying(log.body, ContactState::kSlide), log).is_needed());
  EXPECT_FALSE(RollBrace(lying(log.body, ContactState::kStick), log).is_needed());
  EXPECT_FALSE(RollBrace(lying(log.body, ContactState::kSlide), weightless).is_needed());
  RollBrace stocky(lying(box.body, ContactState::kSlide), box);
  EXPECT_FALSE(stocky.is_needed());
  const physics::State state{box.body.rest, Eigen::Matrix3Xd::Random(3, box.body.node_count())};
  stocky.follow({turn(1, Eigen::Vector3d::UnitX()), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), 0}, state, state, 0, kStep);
  EXPECT_TRUE(change(stocky, box.body).isZero(0));
}

TEST(RollBrace, LetsACrawlRollALittleAndBendsAgainstMoreButNoFurtherThanItMay) {
  const PreparedTarget plan = lying(the_log().body, ContactState::kSlide);
  for (const double side : {-1.0, 1.0}) {
    const auto bend = [&](double roll) { return side * after(plan, turn(side * roll, Eigen::Vector3d::UnitX())).bend(); };
    EXPECT_EQ(bend(0), 0);
    EXPECT_NEAR(bend(0.15), 0, 1e-12);
    EXPECT_GT(std::abs(bend(0.5)), 0.15);
    EXPECT_NEAR(std::abs(bend(0.7)) - std::abs(bend(0.5)), 0.6 * 0.2, 1e-9);
    EXPECT_NEAR(std::abs(bend(3.0)), 0.5, 1e-9);
    EXPECT_EQ(std::signbit(bend(0.5)), std::signbit(bend(3.0)));
    const RollBrace most = after(plan, turn(side * 3, Eigen::Vector3d::UnitX()));
    EXPECT_LE(change(most, the_log().body).cwiseAbs().maxCoeff(), 0.5 * 1.5);
  }
  EXPECT_NE(std::signbit(after(plan, turn(0.5, Eigen::Vector3d::UnitX())).bend()),
            std::signbit(after(plan, turn(-0.5, Eigen::Vector3d::UnitX())).bend()));
}

TEST(RollBrace, AnswersAFastRollBeforeItHasComeFar) {
  const double rolled = after(lying(the_log().body, ContactState::kSlide), turn(0.6, Eigen::Vector3d::UnitX())).bend();
  for (const double side : {-1.0, 1.0}) {
    const RollBrace brace = after(at_rest(), moving(10 * side, 0));
    EXPECT_EQ(brace.roll(), 0);
    EXPECT_GT(side * std::copysign(1, rolled) * brace.bend(), 0.1);
  }
}

TEST(RollBrace, AnswersAPushBeforeItRolls) {
  for (const double side : {-1.0, 1.0}) {
    // What slides to +z is about to roll by the ground's friction to +x, as a wheel would.
    const RollBrace slides = after(at_rest(), moving(0, side)), rolls = after(at_rest(), moving(10 * side, 0));
    EXPECT_GT(std::abs(slides.bend()), 0.1);
    EXPECT_EQ(std::signbit(slides.bend()), std::signbit(rolls.bend()));
  }
}

TEST(RollBrace, LeavesAloneWhatThePlanItselfDoes) {
  for (const double speed : {-0.7, 0.7}) EXPECT_EQ(after(moving(0, speed), moving(0, speed)).bend(), 0);
  for (const double rate : {-8.0, 8.0}) EXPECT_EQ(after(moving(rate, 0), moving(rate, 0)).bend(), 0);
}

TEST(RollBrace, BendsBetweenTheGroundAndItsOwnPlaneWhateverItsHeading) {
  const physics::Body body = log_on_ground().body;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> even(-1, 1);
  for (int k = 0; k < 50; ++k) {
    const double roll = (k % 2 ? 1 : -1) * (0.7 + 0.3 * even(random)), yaw = M_PI * even(random), target_yaw = even(random);
    SCOPED_TRACE("roll " + std::to_string(roll) + " yaw " + std::to_string(yaw) + " of the target " + std::to_string(target_yaw));
    const Eigen::Matrix3d rolled = turn(yaw, kUp) * turn(roll, Eigen::Vector3d::UnitX());
    const RollBrace brace = after(lying(body, ContactState::kSlide), rolled);
    EXPECT_NEAR(std::abs(brace.roll()), std::abs(roll), 1e-9);
    const Eigen::VectorXd bent = change(brace, body);
    const Eigen::Vector3d side = rolled * side_of(bent, body);  // in the world
    EXPECT_LT(std::abs(side.dot(rolled.col(0))), 1e-6);
    const double lift = std::abs(std::asin(side.y()));
    EXPECT_GT(lift, 0.2 * std::abs(roll));
    EXPECT_LT(lift, 0.6 * std::abs(roll));
    // As much and to the same side for a target that has turned on, and the body with it.
    const Eigen::Matrix3d on = turn(1.5 * target_yaw, kUp);
    const RollBrace later = after(lying(body, ContactState::kSlide, target_yaw), rolled * on.transpose(), 1.5 * kPeriod);
    EXPECT_LT((change(later, body) - bent).norm(), 1e-9);
  }
}

/// How far [rad] a log has rolled that was pushed from the side with `speed` [m/s], after a second.
double rolled(double speed, bool is_braced) {
  const physics::Scene& scene = the_log();
  const physics::Body& body = scene.body;
  const PreparedTarget plan = lying(body, ContactState::kSlide);
  const Eigen::VectorXd shares = body.mass / body.mass.sum();
  RollBrace brace(plan, scene);
  physics::State state = physics::laid_down(scene);
  const auto stepper = physics::make_stepper(physics::Method::kExplicit, scene);
  physics::Impulses impulses = physics::make_impulses(scene);
  double roll = 0, before = 0;
  for (int k = 0; k < 180; ++k) {
    if (k == 60) state.v.row(2).array() += speed;
    const RigidFit fit = best_rigid_fit(body.rest, state.x, shares);
    brace.follow(fit, at_rest(), state, 0, kStep);
    roll += std::remainder(brace.roll() - before, 2 * M_PI);
    before = brace.roll();
    Eigen::VectorXd activation = Eigen::VectorXd::Ones(body.edge_count());
    if (is_braced) brace.apply(activation);
    for (int s = 0; s < 2; ++s) {
      if (stepper->step(kStep / 2, activation, nullptr, state, impulses) == physics::Termination::kDiverged) return std::nan("");
    }
  }
  return std::abs(roll);
}

TEST(RollBrace, ALogThatIsPushedFromTheSideRollsOnUnlessItBends) {
  for (const double speed : {-1.2, -1.0, -0.8, -0.6, 0.6, 0.8, 1.0, 1.2}) {
    SCOPED_TRACE(speed);
    EXPECT_GT(rolled(speed, false), 2);
    EXPECT_LT(rolled(speed, true), 0.4);
  }
}

}  // namespace
}  // namespace hydrostat::retarget::roll_brace_test
