#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "cli/make_performer.h"
#include "io/import.h"
#include "io/import_worker.h"
#include "retarget/inverse_dynamics.h"
#include "retarget/limbs.h"

namespace hydrostat::ablation_test {
namespace {

// Gates of a trot. Per L; per L a cycle; per L a stance; of the clip's; of the whole body.
constexpr double kShape = 0.01, kDrift = 0.003, kSlip = 0.03, kTravel = 0.08, kVolume = 0.02;
constexpr double kRootResidual = 0.01;  // [mg] of net force that the plan may lack
constexpr double kCycles = 5;

struct Attempt {
  retarget::InverseReport inverse;
  retarget::Performances runs;
};

/// The trot on its usual body, brought to the ground once; what comes behind is done anew for every ablation.
class Ablation : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    io::set_import_worker_executable((std::filesystem::path(HYDROSTAT_BINARY).parent_path() / "hydrostat-import").string());
    io::ImportOptions import;
    retarget::CreatureOptions options;
    import.sample_rate_hz = options.rate_hz;
    const retarget::Character dog =
        io::import_character((std::filesystem::path(HYDROSTAT_SAMPLES) / "boxdog_trot.fbx").string(), "", import);
    creature_ = std::make_unique<retarget::Creature>(retarget::make_creature(dog, options));
    motion_ = std::make_unique<retarget::ImportedMotion>(retarget::import_motion(*creature_, options));
  }
  static void TearDownTestSuite() {
    creature_.reset();
    motion_.reset();
  }

  static Attempt let_go(const retarget::PrepareOptions& options, bool baselines, double cycles = kCycles) {
    const retarget::Creature& creature = *creature_;
    retarget::PreparedTarget prepared =
        retarget::prepare(motion_->nodes, retarget::preparation_scene(creature), retarget::bones_of(creature.contacts),
                          creature.character.skeleton.names, creature.mesh.bone_weights, creature.length, creature.size, options);
    retarget::find_legs(creature.character.skeleton, prepared.contacts);
    const retarget::InverseDynamics inverse = retarget::solve_within_automatic_limit(prepared, creature.scene, creature.length, {});
    const retarget::Performer performer = cli::make_performer(creature, *motion_, std::move(prepared));
    retarget::PerformOptions go;
    go.replay.duration_s = cycles * performer.prepared.target.duration_s();
    go.baselines = baselines;
    return {inverse.report, retarget::perform(performer, cli::solved_signals(inverse, performer, "boxdog_trot.fbx", ""), go)};
  }
  static retarget::PrepareOptions usual() { return retarget::prepare_options(*motion_); }

  static std::unique_ptr<retarget::Creature> creature_;
  static std::unique_ptr<retarget::ImportedMotion> motion_;
};

std::unique_ptr<retarget::Creature> Ablation::creature_;
std::unique_ptr<retarget::ImportedMotion> Ablation::motion_;

/// The gates that a run misses; empty where it is a good trot.
std::string missed_gates(const retarget::Replay& replay) {
  const retarget::ReplayReport& run = replay.report;
  std::string missed;
  if (run.fell || replay.termination == physics::Termination::kDiverged) missed += "falls ";
  if (run.shape_rms_length > kShape) missed += "shape ";
  if (std::abs(run.drift_per_cycle_length) > kDrift) missed += "drift ";
  if (run.slip_per_stance_length > kSlip) missed += "slip ";
  if (std::abs(run.travel_per_cycle_length / run.clip_travel_per_cycle_length - 1) > kTravel) missed += "travel ";
  if (run.volume_error_max > kVolume) missed += "volume ";
  return missed;
}

TEST_F(Ablation, WithoutInverseDynamicsOrCorrectorATrotMissesGatesThatTheWholeRoadMeets) {
  const Attempt whole = let_go(usual(), true);
  EXPECT_EQ(missed_gates(*whole.runs.closed_loop), "");
  EXPECT_LE(whole.inverse.root_residual_mg, kRootResidual);
  EXPECT_NE(missed_gates(*whole.runs.naive).find("falls"), std::string::npos);
  EXPECT_NE(missed_gates(*whole.runs.open_loop).find("drift"), std::string::npos);
}

TEST_F(Ablation, WithoutTheVolumeStepItFalls) {
  retarget::PrepareOptions options = usual();
  options.volume = false;
  EXPECT_NE(missed_gates(*let_go(options, false).runs.closed_loop).find("falls"), std::string::npos);
}

/// On legs that step freely the corrector makes up for it, and shows it.
TEST_F(Ablation, WithoutTheMomentumStepThePlanLacksAForceThatNothingGives) {
  retarget::PrepareOptions options = usual();
  options.momentum = false;
  const double lacked = let_go(options, false, /*cycles=*/1).inverse.root_residual_mg;
  EXPECT_GT(lacked, kRootResidual);
  EXPECT_GT(lacked, 10 * let_go(usual(), false, /*cycles=*/1).inverse.root_residual_mg);
}

}  // namespace
}  // namespace hydrostat::ablation_test
