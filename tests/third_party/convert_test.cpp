#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>

#include "tests/e2e/made_creature.h"

namespace hydrostat::convert_test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double kClipShape = 0.04;   // [per L] at most
constexpr double kCycles = 4.99;      // at least
constexpr double kMomentum = 1e-6;    // [mg]
constexpr double kHeading = 1.5;      // [deg a cycle], over five cycles
constexpr double kDrift = 0.003;      // [per L a cycle]

struct Clip {
  const char* file;
  const char* options;
};

/// Clips that nobody made for us; the defaults are those of every other clip, but that a coarser snake and a coarser slime are quicker.
constexpr Clip kClips[] = {
    {"gltf/fox.glb", "--clip Walk --height 0.6"},
    {"gltf/snake.glb", "--clip 'Side winding' --nodes 150"},
    {"fbx/slime.fbx", "--clip Slime_Walk --nodes 110"},
    {"gltf/spider_animated.gltf", "--from 1.375 --to 2.125 --height 0.3 --nodes 150"},  // its walk, of a timeline of five actions
};

fs::path assets() {
  const char* named = std::getenv("HYDROSTAT_ASSETS");
  return named != nullptr ? named : HYDROSTAT_DEFAULT_ASSETS;
}

/// Two of two minutes each. Convert::SpreadsTheLoad... does on a sample what one does; the other is the only one that is given fitted rest lengths.
bool is_left_out_as_long() { return std::getenv("HYDROSTAT_LONG") == nullptr; }

void expect_creature(const Clip& clip, const std::function<void(const fs::path&)>& look_at = {}, double least_cycles = kCycles) {
  const fs::path file = assets() / clip.file;
  if (!fs::exists(file)) GTEST_SKIP() << "left out: " << file << " is missing (set HYDROSTAT_ASSETS)";
  const TemporaryDirectory directory;
  const Outcome outcome = hydrostat_in(directory.path, "convert " + in_quotes(file) + " -o creature --quiet " + clip.options);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  ASSERT_TRUE(fs::exists(directory.path / "creature" / "replay.glb"));
  const json run = report_of(directory.path / "creature")["replay"]["closed_loop"];
  EXPECT_EQ(run["fell"], false);
  EXPECT_GE(run["cycles"], least_cycles);
  EXPECT_LE(run["clip_shape_rms_length"], kClipShape);
  EXPECT_EQ(run["external_assist_mg"], 0);
  EXPECT_LE(run["momentum_residual_mg"], kMomentum);
  EXPECT_EQ(run["inverted_elements"], 0);
  if (look_at) look_at(directory.path / "creature");
}

/// The JSON of a binary glTF file.
json gltf_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  std::uint32_t length = 0;
  std::memcpy(&length, bytes.data() + 12, sizeof length);
  return json::parse(bytes.substr(20, length));
}

TEST(ThirdPartyClips, TheFoxWalks) {
  expect_creature(kClips[0], [](const fs::path& creature) {
    // In its own coat, and faceted as its file has it.
    const fs::path again = creature.parent_path() / "again.glb";
    EXPECT_EQ(hydrostat_in(creature.parent_path(), "replay creature -o again.glb --duration 0.2 --quiet").exit_code, 0);
    for (const fs::path& file : {creature / "replay.glb", creature / "reference.glb", again}) {
      const json gltf = gltf_of(file);
      const json& primitive = gltf["meshes"][0]["primitives"][0];
      const json& image = gltf["images"].at(0);
      EXPECT_EQ(image["mimeType"], "image/png");
      EXPECT_EQ(gltf["bufferViews"].at(image["bufferView"].get<std::size_t>())["byteLength"], 26764);
      EXPECT_TRUE(primitive["attributes"].contains("TEXCOORD_0"));
      EXPECT_FALSE(primitive["attributes"].contains("NORMAL"));
      EXPECT_EQ(gltf["materials"].at(0)["pbrMetallicRoughness"]["roughnessFactor"], 0.58);
    }
  });
}
/// Of 184 nodes it falls at 3 s on the usual gain, and on every other that looks ahead by a horizon.
TEST(ThirdPartyClips, TheFoxWalksOnACoarseMeshByARegulator) {
  expect_creature({kClips[0].file, "--clip Walk --height 0.6 --nodes 150"}, [](const fs::path& creature) {
    const json report = report_of(creature), run = report["replay"]["closed_loop"];
    EXPECT_NE(report["warnings"].dump().find("where a regulator"), std::string::npos) << report["warnings"];
    EXPECT_NE(io::read_file(creature / "creature.toml").find("corrector_regulator = "), std::string::npos);
    EXPECT_LE(std::abs(run["drift_per_cycle_length"].get<double>()), kDrift);
    EXPECT_NEAR(run["travel_per_cycle_length"].get<double>() / run["clip_travel_per_cycle_length"].get<double>(), 1, 0.01);
    EXPECT_LE(run["shape_rms_length"], 0.005);
  });
}
TEST(ThirdPartyClips, TheSnakeWindsAndKeepsItsWay) {
  expect_creature(kClips[1], [](const fs::path& creature) {
    // Friction turns it by 3 degrees a cycle and more; what is left is how it turns back from the first.
    const json run = report_of(creature)["replay"]["closed_loop"];
    EXPECT_LE(std::abs(run["heading_deg_per_cycle"].get<double>()), kHeading);
    EXPECT_LE(std::abs(run["drift_per_cycle_length"].get<double>()), kDrift);
  });
}

/// As it is drawn it tips over the strip of belly that it stands on.
TEST(ThirdPartyClips, TheSnakeRaisesItsHeadOverASpreadLoad) {
  if (is_left_out_as_long()) GTEST_SKIP() << "left out: it takes two minutes (set HYDROSTAT_LONG)";
  const auto look_at = [](const fs::path& creature) {
    const json report = report_of(creature), run = report["replay"]["closed_loop"];
    EXPECT_NE(report["warnings"].dump().find("spreads its load"), std::string::npos) << report["warnings"];
    EXPECT_NE(io::read_file(creature / "creature.toml").find("load = 'spread'"), std::string::npos);
    EXPECT_LE(run["shape_rms_length"], 0.005);
    EXPECT_LE(std::abs(run["drift_per_cycle_length"].get<double>()), kDrift);
    const std::string motion = io::read_file(creature / "replay.glb");
    EXPECT_EQ(hydrostat_in(creature.parent_path(), "replay creature --quiet").exit_code, 0);
    EXPECT_EQ(io::read_file(creature / "replay.glb"), motion);
  };
  expect_creature({kClips[1].file, "--clip Idle --nodes 80"}, look_at, 3.99);
}

TEST(ThirdPartyClips, TheSlimeWalks) { expect_creature(kClips[2]); }

TEST(ThirdPartyClips, TheSpiderWalksWhoseBellyHangsOver) {
  expect_creature(kClips[3], [](const fs::path& creature) {
    const json report = report_of(creature), run = report["replay"]["closed_loop"];
    EXPECT_EQ(report["source"]["duration_s"], 0.75);
    EXPECT_NE(io::read_file(creature / "creature.toml").find("from = 1.375"), std::string::npos);
    EXPECT_NE(report["warnings"].dump().find("tip over its feet"), std::string::npos) << report["warnings"];
    EXPECT_LE(std::abs(run["heading_deg_per_cycle"].get<double>()), 0.3);
    EXPECT_LE(std::abs(run["drift_per_cycle_length"].get<double>()), kDrift);
    EXPECT_NEAR(run["travel_per_cycle_length"].get<double>() / run["clip_travel_per_cycle_length"].get<double>(), 1, 0.08);
    // Its masses come along to another mesh.
    EXPECT_EQ(hydrostat_in(creature.parent_path(), "replay creature --lod 100 -o coarse.glb --duration 3 --quiet").exit_code, 0);
  });
}

TEST(ThirdPartyClips, TheFrogHopsItsWay) {
  expect_creature({"fbx/frog.fbx", "--clip Frog_Jump --height 0.15"}, [](const fs::path& creature) {
    const json report = report_of(creature), run = report["replay"]["closed_loop"];
    EXPECT_LE(report["preparation"]["total_shift_rms_length"], 0.04);
    EXPECT_LE(std::abs(run["drift_per_cycle_length"].get<double>()), 0.01);  // over five cycles
    EXPECT_LE(std::abs(run["heading_deg_per_cycle"].get<double>()), kHeading);
    EXPECT_NEAR(run["travel_per_cycle_length"].get<double>() / run["clip_travel_per_cycle_length"].get<double>(), 1, 0.03);
    EXPECT_LE(run["held_slip_per_stance_length"], 0.045);  // where it landed two frames early 0.055
    EXPECT_NE(io::read_file(creature / "creature.toml").find("rest_lengths = 'usual'"), std::string::npos);
  });
}

/// Legs of so few cells that are bound folded, and that the clip stretches: from the rest lengths of its bind pose it makes a quarter of its way.
TEST(ThirdPartyClips, TheFrogHopsOnACoarseMeshFromRestLengthsThatItsLegsCanBeStretchedFrom) {
  if (is_left_out_as_long()) GTEST_SKIP() << "left out: it takes two minutes (set HYDROSTAT_LONG)";
  const fs::path file = assets() / "fbx/frog.fbx";
  if (!fs::exists(file)) GTEST_SKIP() << "left out: " << file << " is missing (set HYDROSTAT_ASSETS)";
  const TemporaryDirectory directory;
  const fs::path creature = directory.path / "creature";
  const Outcome outcome =
      hydrostat_in(directory.path, "convert " + in_quotes(file) + " -o creature --quiet --clip Frog_Jump --height 0.15 --nodes 170");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const json report = report_of(creature), run = report["replay"]["closed_loop"];
  EXPECT_NE(report["warnings"].dump().find("the middle of their lengths"), std::string::npos) << report["warnings"];
  EXPECT_NE(io::read_file(creature / "creature.toml").find("rest_lengths = 'fitted'"), std::string::npos);
  EXPECT_NEAR(run["travel_per_cycle_length"].get<double>() / run["clip_travel_per_cycle_length"].get<double>(), 1, 0.15);
  const std::string motion = io::read_file(creature / "replay.glb");
  EXPECT_EQ(hydrostat_in(directory.path, "replay creature --quiet").exit_code, 0);
  EXPECT_EQ(io::read_file(creature / "replay.glb"), motion);
}

}  // namespace
}  // namespace hydrostat::convert_test
