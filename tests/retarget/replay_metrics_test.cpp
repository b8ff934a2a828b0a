#include "retarget/replay_metrics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "tests/retarget/box_creature.h"

namespace hydrostat::retarget::replay_metrics_test {
namespace {

constexpr double kStep = 1.0 / 120;

/// The box bent sideways, its ends along z by `way` [m] from its middle.
Eigen::Matrix3Xd swayed(const BoxCreature& creature, double way) {
  Eigen::Matrix3Xd x = creature.scene.body.rest;
  const double middle = (x.row(2).minCoeff() + x.row(2).maxCoeff()) / 2, half = x.row(2).maxCoeff() - middle;
  for (Eigen::Index i = 0; i < x.cols(); ++i) x(0, i) += way * std::pow((x(2, i) - middle) / half, 2);
  return x;
}

/// The box held against a target that stands, one control step after the other. Its clip sways by `sway` [m] once a period.
class Measured {
 public:
  explicit Measured(long frames = 6, double sway = 0) : frames_(frames), sway_(sway), metrics_(input_, kStep, 100, state) {
    impulses.contact.colwise() = creature.mass() / points() * kStep * up();
  }

  Eigen::Index points() const { return creature.scene.contact_points.count(); }
  Eigen::Vector3d up() const { return -creature.scene.gravity; }
  void step() {
    ++steps_;
    const Eigen::VectorXd shares = creature.scene.body.mass / creature.mass();
    const RigidFit fit = best_rigid_fit(creature.scene.body.rest, state.x, shares);
    const ContactThresholds thresholds = contact_thresholds(creature.scene, BoxCreature::kLength, kStep);
    const auto touching = point_states(creature.scene, state, impulses.contact, thresholds);
    impulses.contact_nodes.setZero();
    for (int p = 0; p < points(); ++p) {
      for (int k = 0; k < 4; ++k) {
        impulses.contact_nodes.col(creature.scene.contact_points.nodes(k, p)) += creature.scene.contact_points.weights(k, p) * impulses.contact.col(p);
      }
    }
    metrics_.add({steps_ * kStep, state, target_state_, fit, activation, feedback, correction, impulses, touching});
  }
  ReplayReport figures() const { return metrics_.figures(); }
  ReplayCourse course() const { return metrics_.course(); }

  BoxCreature creature = make_box_creature();
  physics::State state{creature.scene.body.rest, Eigen::Matrix3Xd::Zero(3, creature.scene.body.node_count())};
  physics::Impulses impulses = physics::make_impulses(creature.scene);
  Eigen::VectorXd activation = Eigen::VectorXd::Ones(creature.scene.body.edge_count());
  Eigen::VectorXd feedback = Eigen::VectorXd::Zero(creature.scene.body.edge_count());
  Eigen::VectorXd correction =
      Eigen::VectorXd::Zero(make_muscles(creature.scene.body, creature.skeleton, creature.bone_weights).fields.cols());

 private:
  Motion clip() const {
    Motion nodes = standing(creature, frames_);
    for (Eigen::Index f = 0; f < nodes.count(); ++f) {
      nodes.at(f) = swayed(creature, sway_ * std::sin(2 * M_PI * static_cast<double>(f) / static_cast<double>(frames_)));
    }
    return point_motion(creature.scene.contact_points, nodes);
  }

  long frames_;
  double sway_;
  physics::State target_state_ = state;
  Muscles muscles_ = make_muscles(creature.scene.body, creature.skeleton, creature.bone_weights);
  PreparedTarget target_ = as_prepared(standing(creature, frames_), always_standing(creature, frames_));
  ReplayInput input_{creature.scene, creature.scene, target_, muscles_, {}, clip(),
                     creature.scene.contact_points, 0, BoxCreature::kLength, creature.size(), 0.3};
  ReplayMetrics metrics_;
  int steps_ = 0;
};

TEST(ReplayMetrics, ABodyThatIsItsTargetHasNoError) {
  Measured run;
  for (int k = 0; k < 60; ++k) run.step();
  const ReplayReport report = run.figures();
  EXPECT_NEAR(report.duration_s, 0.5, 1e-12);
  EXPECT_NEAR(report.cycles, 5, 1e-12);
  for (const double error : {report.shape_rms_length, report.clip_shape_rms_length, report.world_rms_length, report.drift_per_cycle_length,
                             report.heading_deg_per_cycle, report.slip_per_stance_length, report.sole_gap_length, report.penetration_max_size,
                             report.volume_error_max, report.momentum_residual_mg, report.correction_rms, report.apex_rise_length}) {
    EXPECT_NEAR(error, 0, 1e-9);
  }
  EXPECT_EQ(report.inverted_elements, 0);
  EXPECT_EQ(run.course().time_s.size(), 60);
}

TEST(ReplayMetrics, ACreatureThatMovesLessThanItsClipLosesStyle) {
  constexpr double kSway = 0.05;
  for (const double share : {1.0, 0.5, 0.0, 1.5}) {
    Measured run(48, kSway);
    for (int k = 1; k <= 96; ++k) {
      run.state.x = swayed(run.creature, share * kSway * std::sin(2 * M_PI * k / 96));
      run.step();
    }
    EXPECT_NEAR(run.figures().style_range, share, 0.03);
    EXPECT_NEAR(run.figures().style_range_least, share, 0.06);
  }
}

TEST(ReplayMetrics, OfTheCorrectionWhatIsFastIsTold) {
  for (const double hz : {1.0, 40.0}) {
    Measured run;
    for (int k = 1; k <= 96; ++k) {
      run.correction.setConstant(0.1 * std::sin(2 * M_PI * hz * k * kStep));
      run.step();
    }
    const ReplayReport report = run.figures();
    EXPECT_GT(report.correction_rms, 0.05);
    EXPECT_NEAR(report.correction_buzz_rms / report.correction_rms, hz > 10 ? 1 : 0, 0.1) << hz;
  }
}

TEST(ReplayMetrics, AnElementThatInvertsForOneStepIsNotForgotten) {
  const physics::Body body = make_box_creature().scene.body;
  for (unsigned seed = 0; seed < 10; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Measured run;
    std::mt19937 random(seed);
    const Eigen::Matrix3Xd sound = run.state.x;
    Eigen::Index most = 0;
    for (int k = 0; k < 6; ++k) {
      if (k == 2 || k == 3) {  // a corner pushed through the face opposite
        const Eigen::Vector4i tet = body.tets.col(static_cast<Eigen::Index>(random() % static_cast<unsigned>(body.tet_count())));
        const Eigen::Vector3d face = (sound.col(tet[1]) + sound.col(tet[2]) + sound.col(tet[3])) / 3;
        run.state.x.col(tet[0]) = 2 * face - sound.col(tet[0]);
      }
      run.step();
      most = std::max(most, (physics::jacobians(body, run.state.x).array() <= 0).count());
      run.state.x = sound;
    }
    EXPECT_GT(most, 0);
    EXPECT_EQ(run.figures().inverted_elements, most);
  }
}

TEST(ReplayMetrics, AForceThatIsNotBookedIsSeen) {
  Measured run;
  run.step();
  run.state.v.row(2).array() += 0.01 * 9.81 * kStep;  // a hidden hand of 0.01 mg
  run.step();
  EXPECT_NEAR(run.figures().momentum_residual_mg, 0.01, 1e-9);
}

TEST(ReplayMetrics, DriftAndHeadingAreSlopesPerCycle) {
  Measured run;
  const Eigen::Matrix3Xd rest = run.state.x;
  for (int k = 1; k <= 96; ++k) {  // eight cycles of a tenth of a second
    const double cycles = k / 12.0;
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(1.3 * cycles, Eigen::Vector3d::UnitY()).toRotationMatrix();  // beyond half a turn
    const Eigen::Vector3d com = rest * run.creature.scene.body.mass / run.creature.mass();
    run.state.x = (turn * (rest.colwise() - com)).colwise() + (com + Eigen::Vector3d(0.03, 0, 0.04) * cycles);
    run.step();
  }
  EXPECT_NEAR(run.figures().drift_per_cycle_length, 0.05 / BoxCreature::kLength, 1e-9);
  EXPECT_NEAR(run.figures().heading_deg_per_cycle, 1.3 * 180 / M_PI, 1e-6);
}

/// A cycle lasts twelve steps.
TEST(ReplayMetrics, ALoopSeenForTwoCyclesTellsNeitherDriftNorHeading) {
  Measured run;
  const Eigen::Matrix3Xd rest = run.state.x;
  for (int k = 1; k <= 26; ++k) {
    run.state.x = rest.colwise() + Eigen::Vector3d(0.003, 0, 0.004) * k;
    run.step();
    const bool is_told = k > 24;
    EXPECT_EQ(std::isfinite(run.figures().drift_per_cycle_length), is_told) << k;
    EXPECT_EQ(std::isfinite(run.figures().heading_deg_per_cycle), is_told) << k;
  }
  EXPECT_NEAR(run.figures().drift_per_cycle_length, 12 * 0.005 / BoxCreature::kLength, 1e-9);
}

TEST(ReplayMetrics, AnAssistIsToldWithItsTime) {
  Measured run;
  for (int k = 1; k <= 6; ++k) {
    run.impulses.correction_nodes.setZero();
    if (k == 3 || k == 5) run.impulses.correction_nodes.col(0).x() = (k == 3 ? 2 : 1) * run.creature.mass() * 9.81 * kStep;
    run.step();
  }
  EXPECT_NEAR(run.figures().external_assist_mg, 2, 1e-9);
  EXPECT_NEAR(run.figures().external_assist_time_s, 3 * kStep, 1e-12);
}

TEST(ReplayMetrics, OfNoStepsAreNone) {
  const Measured run;
  EXPECT_EQ(run.figures().duration_s, 0);
  EXPECT_TRUE(std::isnan(run.figures().drift_per_cycle_length));
  EXPECT_EQ(run.course().time_s.size(), 0);
  EXPECT_EQ(run.course().com.cols(), 0);
}

}  // namespace
}  // namespace hydrostat::retarget::replay_metrics_test
