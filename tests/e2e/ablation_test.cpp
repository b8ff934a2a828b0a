#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "cli/make_performer.h"
#include "io/import.h"
#include "retarget/inverse_dynamics.h"
#include "retarget/limbs.h"

namespace hydrostat {
namespace {

// Of the trot, closed loop.
constexpr double kShape = 0.01, kDrift = 0.003, kSlip = 0.03, kTravel = 0.08;  // per L, per L a cycle, per L a stance, of the clip's
constexpr double kVolume = 0.02;
constexpr double kCycles = 8;

/// The trot on a body of few nodes, brought to the ground once; what comes behind is done anew for every ablation.
class Ablation : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    io::ImportOptions import;
    retarget::CreatureOptions options;
    import.sample_rate_hz = options.rate_hz;
    options.nodes = 120;
    const retarget::Character dog =
        io::import_character((std::filesystem::path(HYDROSTAT_SAMPLES) / "boxdog_trot.fbx").string(), "", import);
    creature_ = std::make_unique<retarget::Creature>(retarget::make_creature(dog, options));
    motion_ = std::make_unique<retarget::ImportedMotion>(retarget::import_motion(*creature_, options));
  }
  static void TearDownTestSuite() {
    creature_.reset();
    motion_.reset();
  }

  static retarget::Performances let_go(bool volume, bool momentum, bool baselines) {
    const retarget::Creature& creature = *creature_;
    retarget::PrepareOptions options = retarget::prepare_options(*motion_);
    options.volume = volume;
    options.momentum = momentum;
    retarget::PreparedTarget prepared =
        retarget::prepare(motion_->nodes, retarget::preparation_scene(creature), retarget::bones_of(creature.contacts),
                          creature.character.skeleton.names, creature.mesh.bone_weights, creature.length, creature.size, options);
    retarget::find_legs(creature.character.skeleton, prepared.contacts);
    retarget::InverseOptions inverse_options;
    inverse_options.limit = retarget::automatic_limit(creature.scene.body, prepared.target);
    const retarget::InverseDynamics inverse =
        retarget::solve_inverse_dynamics(prepared, creature.scene, creature.length, inverse_options);
    std::printf("miss %.5f root %.4f sat %.3f vol %.4f\n", inverse.report.miss_rms_length, inverse.report.root_residual_mg, inverse.report.saturated, prepared.report.volume_error_rms);
    const retarget::Performer performer = cli::make_performer(creature, *motion_, std::move(prepared));
    retarget::PerformOptions go;
    go.replay.duration_s = kCycles * performer.prepared.target.duration_s();
    go.baselines = baselines;
    return retarget::perform(performer, cli::solved_signals(inverse, performer, "boxdog_trot.fbx", ""), go);
  }

  static std::unique_ptr<retarget::Creature> creature_;
  static std::unique_ptr<retarget::ImportedMotion> motion_;
};

std::unique_ptr<retarget::Creature> Ablation::creature_;
std::unique_ptr<retarget::ImportedMotion> Ablation::motion_;

/// The gates that a run misses; empty where it is a good trot.
std::string missed_gates(const retarget::Replay& replay) {
  const retarget::ReplayReport& run = replay.report;
  std::printf("fell %d %.2f shape %.4f clipshape %.4f drift %.4f slip %.4f travel %.4f/%.4f vol %.4f head %.3f corr %.4f\n", run.fell, run.fall_time_s, run.shape_rms_length, run.clip_shape_rms_length, run.drift_per_cycle_length, run.slip_per_stance_length, run.travel_per_cycle_length, run.clip_travel_per_cycle_length, run.volume_error_max, run.heading_deg_per_cycle, run.correction_rms);
  std::string missed;
  if (run.fell || replay.termination == physics::Termination::kDiverged) missed += "falls ";
  if (run.shape_rms_length > kShape) missed += "shape ";
  if (std::abs(run.drift_per_cycle_length) > kDrift) missed += "drift ";
  if (run.slip_per_stance_length > kSlip) missed += "slip ";
  if (std::abs(run.travel_per_cycle_length / run.clip_travel_per_cycle_length - 1) > kTravel) missed += "travel ";
  if (run.volume_error_max > kVolume) missed += "volume ";
  return missed;
}

TEST_F(Ablation, OfTheWholeRoadNothingIsMissedAndWithoutInverseDynamicsOrCorrectorMuchIs) {
  const retarget::Performances runs = let_go(true, true, true);
  EXPECT_EQ(missed_gates(*runs.closed_loop), "");
  EXPECT_NE(missed_gates(*runs.naive), "");
  EXPECT_NE(missed_gates(*runs.open_loop), "");
}

TEST_F(Ablation, WithoutTheVolumeStepAGateIsMissed) { EXPECT_NE(missed_gates(*let_go(false, true, false).closed_loop), ""); }

TEST_F(Ablation, WithoutTheMomentumStepAGateIsMissed) { EXPECT_NE(missed_gates(*let_go(true, false, false).closed_loop), ""); }

}  // namespace
}  // namespace hydrostat
