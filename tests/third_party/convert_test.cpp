#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/e2e/made_creature.h"

namespace hydrostat {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double kClipShape = 0.04;   // [per L] at most
constexpr double kCycles = 4.99;      // at least
constexpr double kMomentum = 1e-6;    // [mg]

struct Clip {
  const char* file;
  const char* options;
};

/// Clips that nobody made for us; the defaults are those of every other clip.
constexpr Clip kClips[] = {
    {"gltf/fox.glb", "--clip Walk --height 0.6"},
    {"gltf/snake.glb", "--clip 'Side winding'"},
    {"fbx/slime.fbx", "--clip Slime_Walk"},
};

fs::path assets() {
  const char* named = std::getenv("HYDROSTAT_ASSETS");
  return named != nullptr ? named : HYDROSTAT_DEFAULT_ASSETS;
}

void expect_creature(const Clip& clip) {
  const fs::path file = assets() / clip.file;
  if (!fs::exists(file)) GTEST_SKIP() << "left out: " << file << " is missing (set HYDROSTAT_ASSETS)";
  const TemporaryDirectory directory;
  const Outcome outcome = hydrostat_in(directory.path, "convert " + in_quotes(file) + " -o creature --quiet " + clip.options);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  ASSERT_TRUE(fs::exists(directory.path / "creature" / "replay.glb"));
  const json run = report_of(directory.path / "creature")["replay"]["closed_loop"];
  EXPECT_EQ(run["fell"], false);
  EXPECT_GE(run["cycles"], kCycles);
  EXPECT_LE(run["clip_shape_rms_length"], kClipShape);
  EXPECT_EQ(run["external_assist_mg"], 0);
  EXPECT_LE(run["momentum_residual_mg"], kMomentum);
  EXPECT_EQ(run["inverted_elements"], 0);
}

TEST(ThirdPartyClips, TheFoxWalks) { expect_creature(kClips[0]); }
TEST(ThirdPartyClips, TheSnakeWinds) { expect_creature(kClips[1]); }
TEST(ThirdPartyClips, TheSlimeWalks) { expect_creature(kClips[2]); }

TEST(ThirdPartyClips, TheFrogThatCannotHopSaysWhatStopsIt) {
  const fs::path file = assets() / "fbx/frog.fbx";
  if (!fs::exists(file)) GTEST_SKIP() << "left out: " << file << " is missing (set HYDROSTAT_ASSETS)";
  const TemporaryDirectory directory;
  const Outcome outcome = hydrostat_in(directory.path, "convert " + in_quotes(file) + " -o creature --quiet --clip Frog_Jump");
  EXPECT_EQ(outcome.exit_code, 3) << outcome.err;
  const json report = report_of(directory.path / "creature");
  const std::string cause = report["replay"]["closed_loop"]["fall_cause"], warnings = report["warnings"].dump();
  EXPECT_NE(cause.find("frame "), std::string::npos) << cause;
  EXPECT_NE(cause.find("limb '"), std::string::npos) << cause;
  EXPECT_NE(cause.find("limit"), std::string::npos) << cause;
  EXPECT_NE(warnings.find("rises by"), std::string::npos) << warnings;
  EXPECT_NE(warnings.find("give --height 0."), std::string::npos) << "the mend; " << warnings;
}

}  // namespace
}  // namespace hydrostat
