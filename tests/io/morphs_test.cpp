#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "io/import.h"
#include "io/read_scene.h"
#include "io/stage_records.h"
#include "tests/io/temporary_directory.h"
#include "tests/io/tiny_gltf_file.h"

namespace hydrostat::io::morphs_test {
namespace {

using Json = nlohmann::json;
constexpr int kFloat = 5126;

/// The tiny strip with two morph targets: "smile" moves its two top vertices, "wink" the left one of the middle.
struct MorphedStrip {
  std::vector<float> times{0, 0.5f, 1};
  std::vector<float> weights{0, 0, 1, 0.5f, 0.25f, 1};  // of each key: smile, wink
  std::string interpolation = "LINEAR";
  std::vector<float> at_rest{};
  std::vector<float> smile{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0.2f, 0, 0.3f, 0.2f, 0, 0.3f};
  std::vector<float> wink{0, 0, 0, 0, 0, 0, 0, 0.1f, 0.4f, 0, 0, 0, 0, 0, 0, 0, 0, 0};
  bool is_animated = true, is_named = true;
  std::function<void(Json& file, GltfBuffer& buffer)> amend;

  TinyGltf file() const {
    TinyGltf tiny;
    tiny.amend = [*this](Json& file, GltfBuffer& buffer) {
      Json& mesh = file["meshes"][0];
      mesh["primitives"][0]["targets"] = {{{"POSITION", buffer.add(smile, kFloat, "VEC3", 3)}},
                                          {{"POSITION", buffer.add(wink, kFloat, "VEC3", 3)}}};
      if (is_named) mesh["extras"] = {{"targetNames", {"smile", "wink"}}};
      if (!at_rest.empty()) mesh["weights"] = at_rest;
      Json& clip = file["animations"][0];
      if (is_animated) {
        clip["samplers"].push_back({{"input", buffer.add(times, kFloat, "SCALAR", 1)},
                                    {"output", buffer.add(weights, kFloat, "SCALAR", 1)},
                                    {"interpolation", interpolation}});
        clip["channels"].push_back({{"sampler", 1}, {"target", {{"node", 3}, {"path", "weights"}}}});
      }
      if (amend) amend(file, buffer);
    };
    return tiny;
  }
};

struct Read {
  retarget::Character character;
  std::vector<std::string> warnings;
};

Read read(const MorphedStrip& strip) {
  const TemporaryDirectory directory;
  Read result;
  result.character = import_character(strip.file().write(directory.path.string()), "", {}, &result.warnings);
  return result;
}

/// The strip's vertex nearest to a place of the bind pose.
Eigen::Index vertex_near(const retarget::Character& character, const Eigen::Vector3d& place) {
  Eigen::Index nearest = 0;
  (character.skin.vertices.colwise() - place).colwise().squaredNorm().minCoeff(&nearest);
  return nearest;
}

/// Where a top vertex stands: "high" turns by `turn` [rad] about z at y = 1.
Eigen::Vector3d turned(const Eigen::Vector3d& place, double turn) {
  return Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()) * (place - Eigen::Vector3d::UnitY()) + Eigen::Vector3d::UnitY();
}

TEST(Morphs, AClipMovesTheSkinByItsWeightsAndTheBonesTurnWhatTheyMove) {
  for (const std::string interpolation : {"LINEAR", "STEP", "CUBICSPLINE"}) {
    SCOPED_TRACE(interpolation);
    MorphedStrip strip;
    strip.interpolation = interpolation;
    if (interpolation == "CUBICSPLINE")  // in-tangents, values, out-tangents of both targets
      strip.weights = {0, 0, 0, 0, 2, 0, /**/ 0, 0, 1, 0.5f, 0, 0, /**/ 0, 0, 0.25f, 1, 0, 0};
    const Read got = read(strip);
    EXPECT_TRUE(got.warnings.empty());
    ASSERT_EQ(got.character.skin.morphs.size(), 2u);
    EXPECT_EQ(got.character.skin.morphs[0].name, "smile");
    EXPECT_EQ(got.character.skin.morphs[1].name, "wink");
    const Eigen::Vector3d top(0.1, 2, 0);
    const Eigen::Index vertex = vertex_near(got.character, top);
    for (const int f : {0, 6, 15, 29, 30, 45, 60}) {
      const double t = f / 60.0, s = std::fmod(t, 0.5) / 0.5;
      double smile = t < 0.5 ? s : t < 1 ? 1 - 0.75 * s : 0.25;
      if (interpolation == "STEP") smile = t < 0.5 ? 0 : t < 1 ? 1 : 0.25;
      if (interpolation == "CUBICSPLINE" && t < 0.5)
        smile = (3 * s * s - 2 * s * s * s) + 0.5 * 2 * (s * s * s - 2 * s * s + s);
      if (interpolation == "CUBICSPLINE" && t >= 0.5 && t < 1) smile = 1 - 0.75 * (3 * s * s - 2 * s * s * s);
      const Eigen::Vector3d expected = turned(top + smile * Eigen::Vector3d(0.2, 0, 0.3), M_PI / 2 * t);
      EXPECT_LT((skin_positions(got.character, f).col(vertex) - expected).norm(), 1e-6) << "frame " << f;
    }
  }
}

TEST(Morphs, WhatIsWornAtRestIsInTheBindPoseAndCountsOnce) {
  MorphedStrip strip;
  strip.at_rest = {0.5f, 0};
  const Read got = read(strip);
  const Eigen::Index vertex = vertex_near(got.character, {0.2, 2, 0.15});
  EXPECT_LT((got.character.skin.vertices.col(vertex) - Eigen::Vector3d(0.2, 2, 0.15)).norm(), 1e-6);
  EXPECT_LT((skin_positions(got.character, 0).col(vertex) - Eigen::Vector3d(0.1, 2, 0)).norm(), 1e-6);
  EXPECT_LT((skin_positions(got.character, 30).col(vertex) - turned({0.3, 2, 0.3}, M_PI / 4)).norm(), 1e-6);
}

TEST(Morphs, VerticesThatAMorphTakesApartAreNotWelded) {
  // The lower half of the strip ends where the upper one begins: as lips do, they part.
  MorphedStrip strip;
  strip.amend = [](Json& file, GltfBuffer& buffer) {
    std::vector<float> positions, weights, open;
    std::vector<std::uint8_t> joints;
    for (int half = 0; half < 2; ++half) {
      for (int v = 0; v < 4; ++v) {
        positions.insert(positions.end(), {v % 2 == 0 ? -0.1f : 0.1f, static_cast<float>(half + v / 2), 0});
        const bool is_lip = half + v / 2 == 1;
        open.insert(open.end(), {0, 0, is_lip ? 0.1f - 0.2f * static_cast<float>(half) : 0});
        joints.insert(joints.end(), {0, 1, 0, 0});
        weights.insert(weights.end(), {half + v / 2 < 1 ? 1.0f : 0, half + v / 2 < 1 ? 0 : 1.0f, 0, 0});
      }
    }
    Json& primitive = file["meshes"][0]["primitives"][0];
    primitive["attributes"] = {{"POSITION", buffer.add(positions, kFloat, "VEC3", 3)},
                               {"JOINTS_0", buffer.add(joints, 5121, "VEC4", 4)},
                               {"WEIGHTS_0", buffer.add(weights, kFloat, "VEC4", 4)}};
    primitive["indices"] = buffer.add(std::vector<std::uint8_t>{0, 1, 3, 0, 3, 2, 4, 5, 7, 4, 7, 6}, 5121, "SCALAR", 1);
    const int moved = buffer.add(open, kFloat, "VEC3", 3);
    primitive["targets"] = {{{"POSITION", moved}}, {{"POSITION", moved}}};
  };
  EXPECT_EQ(read(strip).character.skin.vertices.cols(), 8);
  strip.is_animated = false;
  EXPECT_EQ(read(strip).character.skin.vertices.cols(), 6) << "a still target parts nothing";
}

TEST(Morphs, InfoNamesTheTargetsTellsWhichMoveAndItsBoxesHoldThem) {
  const TemporaryDirectory directory;
  MorphedStrip strip;
  strip.weights = {0, 0, 1, 0, 0.25f, 0};  // wink stays
  strip.times = {0, 0.4f, 1};
  const FileInfo info = inspect(strip.file().write(directory.path.string()));
  ASSERT_EQ(info.meshes.at(0).morphs, (std::vector<std::string>{"smile", "wink"}));
  ASSERT_EQ(info.clips.at(0).morphs.size(), 1u);
  EXPECT_EQ(info.clips[0].morphs[0].name, "smile");
  EXPECT_EQ(info.clips[0].morphs[0].mesh, "strip");
  EXPECT_EQ(info.clips[0].morphs[0].max, 1);
  EXPECT_NEAR(info.clips[0].bbox.at(2).max.z(), 0.3, 1e-6) << "at 0.4 of the clip";
  const Json json = Json::parse(to_json(info));
  EXPECT_EQ(json["meshes"][0]["morph_targets"][1], "wink");
  EXPECT_EQ(json["clips"][0]["morph_targets"][0]["name"], "smile");
  strip.is_named = false;
  EXPECT_EQ(inspect(strip.file().write(directory.path.string())).meshes.at(0).morphs.at(1), "target_1");
}

TEST(Morphs, AClipOfWeightsAloneHasItsLengthAndAShapeWithoutSkinIsRefused) {
  const TemporaryDirectory directory;
  MorphedStrip strip;
  strip.amend = [](Json& file, GltfBuffer&) { file["animations"][0]["channels"].erase(0); };
  const FileInfo info = inspect(strip.file().write(directory.path.string()));
  EXPECT_NEAR(info.clips.at(0).range_s, 1, 1e-6);
  TinyGltf bare = strip.file();
  bare.with_skin = false;
  try {
    import_character(bare.write(directory.path.string()), "", {});
    FAIL() << "a mesh without bones was taken";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("skeleton"), std::string::npos) << error.what();
  }
}

TEST(Morphs, BrokenOnesHoldStillWithOneWarningEachAndTheCharacterIsReadAllTheSame) {
  using Spoil = std::function<void(MorphedStrip&)>;
  const std::vector<Spoil> spoils{
      [](MorphedStrip& strip) { strip.weights.pop_back(); },
      [](MorphedStrip& strip) { strip.weights[2] = std::nanf(""); },
      [](MorphedStrip& strip) { strip.times = {0, 1, 0.5f}; },
      [](MorphedStrip& strip) { strip.interpolation = "CUBICSPLINE"; },
      [](MorphedStrip& strip) { strip.smile[13] = std::numeric_limits<float>::infinity(); },
      [](MorphedStrip& strip) { strip.wink.resize(9); },
      [](MorphedStrip& strip) {
        strip.amend = [](Json& file, GltfBuffer&) {
          file["meshes"][0]["primitives"][0]["targets"][0]["POSITION"] = 1000;
        };
      }};
  for (std::size_t s = 0; s < spoils.size(); ++s) {
    MorphedStrip strip;
    spoils[s](strip);
    const Read got = read(strip);
    ASSERT_EQ(got.warnings.size(), 1u) << "case " << s;
    EXPECT_NE(got.warnings[0].find("as at rest"), std::string::npos) << got.warnings[0];
    EXPECT_EQ(got.character.skin.vertices.cols(), 6);
    EXPECT_LT(got.character.skin.morphs.size(), 2u);
    EXPECT_EQ(got.character.clip.morph_weights.rows(), static_cast<Eigen::Index>(got.character.skin.morphs.size()));
  }
}

TEST(Morphs, BlendShapesOfFbxAreRead) {
  std::vector<std::string> warnings;
  const retarget::Character character = import_character(HYDROSTAT_TESTS "/fuzz/corpus/face.fbx", "", {}, &warnings);
  for (const std::string& warning : warnings) EXPECT_EQ(warning.find("morph"), std::string::npos) << warning;
  ASSERT_EQ(character.skin.morphs.size(), 1u);
  EXPECT_EQ(character.skin.morphs[0].name, "smile");
  const Eigen::Index vertex = vertex_near(character, {0.1, 2, 0});
  for (const int f : {0, 15, 30, 45, 60}) {
    const double t = f / 60.0, smile = t < 0.5 ? 2 * t : 1.75 - 1.5 * t;
    const Eigen::Vector3d expected = turned(Eigen::Vector3d(0.1, 2, 0) + smile * Eigen::Vector3d(0.2, 0, 0.3), M_PI / 2 * t);
    EXPECT_LT((skin_positions(character, f).col(vertex) - expected).norm(), 1e-5) << "frame " << f;
  }
  EXPECT_EQ(inspect(HYDROSTAT_TESTS "/fuzz/corpus/face.fbx").clips.at(0).morphs.at(0).name, "smile");
}

TEST(Morphs, TheirFileComesBackToTheBitAndNothingElseDoes) {
  const Read got = read(MorphedStrip());
  const retarget::MovingMorphs morphs{got.character.skin.morphs, got.character.clip.morph_weights, 60, true};
  const std::string bytes = morphs_bytes(morphs);
  const retarget::MovingMorphs again = parse_morphs(bytes, "morphs.bin", 6);
  EXPECT_EQ(morphs_bytes(again), bytes);
  EXPECT_EQ(again.targets[1].name, "wink");
  EXPECT_EQ(again.targets[0].vertices, morphs.targets[0].vertices);
  EXPECT_EQ(again.targets[0].offsets, morphs.targets[0].offsets);
  EXPECT_EQ(again.weights, morphs.weights);
  EXPECT_TRUE(again.loop && again.rate_hz == 60);
  EXPECT_THROW(parse_morphs(bytes, "morphs.bin", 5), Error) << "of another skin";
  EXPECT_THROW(parse_morphs(bytes.substr(0, bytes.size() / 2), "morphs.bin", 6), Error);
}

}  // namespace
}  // namespace hydrostat::io::morphs_test
