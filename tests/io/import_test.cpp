#include "io/import.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iostream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <numbers>

#include "io/import_worker.h"
#include "retarget/error.h"
#include "tests/io/import_case.h"
#include "tests/io/temporary_directory.h"
#include "tests/io/tiny_gltf_file.h"

namespace hydrostat::io::import_test {
namespace {

using namespace import_case;

class ImportEnvironment : public testing::Environment {
  void SetUp() override {
    set_import_worker_executable((std::filesystem::path(HYDROSTAT_BINARY).parent_path() / "hydrostat-import").string());
    if (assets().empty())
      std::cout << "Tests on third-party clips are left out: HYDROSTAT_ASSETS names no directory that holds them.\n";
  }
};
const testing::Environment* const kEnvironment = testing::AddGlobalTestEnvironment(new ImportEnvironment);

template <typename Act>
Error error_of(Act&& act) {
  try {
    act();
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "no Error was thrown";
  return Error("", "", "", "");
}

// --- our own samples; boxes [m], y up, as two other readers (ufbx, Blender) have them

struct Sample {
  const char* file;
  double duration_s;
  bool loop;
  double speed_m_s;
  std::array<Box, 5> boxes;
};
const std::array<Sample, 3> kSampleClips{{{"worm_crawl.glb",
                                           2,
                                           true,
                                           0.076,
                                           {{Box{-0.0343275, 0.000242064, -0.002, 0.0343275, 0.208383, 0.442},
                                             Box{-0.0343275, 0.000198253, -0.002, 0.0343275, 0.203949, 0.461759},
                                             Box{-0.0343275, 0.000324286, -0.002, 0.0343275, 0.115495, 0.589138},
                                             Box{-0.0343275, 8.96154e-05, 0.0428469, 0.0343275, 0.164315, 0.594154},
                                             Box{-0.0343275, 0.000242079, 0.15, 0.0343275, 0.208383, 0.594}}}},
                                          {"boxdog_trot.fbx",
                                           0.6,
                                           true,
                                           0.9,
                                           {{Box{-0.145022, -4.43628e-08, -0.541833, 0.144975, 0.726644, 0.699899},
                                             Box{-0.145022, -8.06559e-05, -0.437562, 0.144975, 0.709939, 0.787034},
                                             Box{-0.145022, -8.02243e-05, -0.309337, 0.144975, 0.740141, 0.911675},
                                             Box{-0.145022, -5.0567e-05, -0.184859, 0.144975, 0.722096, 1.0796},
                                             Box{-0.145022, -5.93253e-08, -0.00183292, 0.144975, 0.726644, 1.2399}}}},
                                          {"boxdog_jump.glb",
                                           1.5,
                                           true,
                                           0.3533,
                                           {{Box{-0.145022, -3.4001e-07, -0.541842, 0.144976, 0.729697, 0.700089},
                                             Box{-0.145022, -1.42362e-05, -0.541846, 0.144976, 0.636281, 0.700114},
                                             Box{-0.145022, 0.136685, -0.363629, 0.144976, 0.934479, 0.89891},
                                             Box{-0.145022, -3.68248e-07, -0.00702596, 0.144976, 0.620269, 1.23493},
                                             Box{-0.145022, -5.25176e-07, -0.00702178, 0.144976, 0.729697, 1.23491}}}}}};

class SampleClip : public testing::TestWithParam<Sample> {};

TEST_P(SampleClip, StandsWhereOtherReadersSeeIt) {
  const FileInfo info = inspect(kSamples + "/" + GetParam().file);
  ASSERT_EQ(info.clips.size(), 1u);
  const ClipInfo& clip = info.clips.front();
  EXPECT_NEAR(clip.duration_s, GetParam().duration_s, 1e-3);
  EXPECT_EQ(clip.loop, GetParam().loop);
  EXPECT_FALSE(clip.in_place);
  EXPECT_NEAR(clip.speed_m_s, GetParam().speed_m_s, 0.01 * GetParam().speed_m_s);
  ASSERT_EQ(clip.bbox.size(), 5u);
  for (std::size_t f = 0; f < 5; ++f) {
    SCOPED_TRACE("fraction " + std::to_string(clip.bbox[f].fraction));
    EXPECT_LT(misfit(clip.bbox[f], GetParam().boxes[f]), 0.003);
  }
}

TEST_P(SampleClip, SkinningTheCharacterGivesTheSameBoxes) {
  const std::string path = kSamples + "/" + GetParam().file;
  // 20 intervals a range, so that the fractions fall on frames.
  const double rate_hz = 20 / inspect(path).clips.front().range_s;
  const retarget::Character character = import_character(path, "", {rate_hz});
  ASSERT_EQ(character.clip.frames(), 21);
  const std::array<int, 5> frames{0, 3, 8, 14, 20};
  for (std::size_t f = 0; f < 5; ++f) {
    const Box found = box_of(
        skin_positions(character.skeleton, character.skin, character.clip.bone_pose[static_cast<std::size_t>(frames[f])]));
    for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(found[i], GetParam().boxes[f][i], 0.003 * extent(GetParam().boxes[f]));
  }
}

TEST_P(SampleClip, BindPoseStandsAsTheCharacterAtItsFirstKey) {
  const retarget::Character character = import_character(kSamples + "/" + GetParam().file, "", {});
  const retarget::Skeleton& skeleton = character.skeleton;
  std::vector<double> scales;
  Eigen::Matrix3d mean = Eigen::Matrix3d::Zero();
  for (std::size_t b = 0; b < skeleton.bind_pose.size(); ++b) {
    const Eigen::Matrix3d axes = skeleton.bind_pose[b].linear();
    EXPECT_LT((axes.transpose() * axes - Eigen::Matrix3d::Identity()).norm(), 1e-9) << skeleton.names[b];
    EXPECT_GT(axes.determinant(), 0);
    EXPECT_LT(skeleton.parents[b], static_cast<int>(b));
    if (!skeleton.weighted[b]) continue;
    const Eigen::Matrix3d motion = (character.clip.bone_pose.front()[b] * skeleton.bind_pose[b].inverse()).linear();
    scales.push_back(std::cbrt(motion.determinant()));
    mean += motion;
  }
  std::nth_element(scales.begin(), scales.begin() + static_cast<std::ptrdiff_t>(scales.size() / 2), scales.end());
  EXPECT_NEAR(scales[scales.size() / 2], 1, 1e-6);
  // Upright and facing as it does: every axis of the body is nearest to its own.
  for (int axis = 0; axis < 3; ++axis) EXPECT_GT(mean(axis, axis), 0.7 * mean.col(axis).norm());
}

TEST_P(SampleClip, SkinIsClosedAndItsWeightsSumToOne) {
  const retarget::Character character = import_character(kSamples + "/" + GetParam().file, "", {});
  const retarget::SkinnedMesh& skin = character.skin;
  std::map<std::pair<int, int>, int> uses;
  for (Eigen::Index t = 0; t < skin.triangles.cols(); ++t) {
    for (int corner = 0; corner < 3; ++corner) ++uses[{skin.triangles(corner, t), skin.triangles((corner + 1) % 3, t)}];
  }
  for (const auto& [edge, count] : uses) {
    ASSERT_EQ(count, 1);
    ASSERT_TRUE(uses.contains({edge.second, edge.first})) << "an open edge";
  }
  for (const auto& influences : skin.skin_weights) {
    double sum = 0;
    for (const auto& influence : influences) sum += influence.weight;
    ASSERT_NEAR(sum, 1, 1e-12);
  }
}

TEST_P(SampleClip, FramesAreUniformFromFirstToLastKey) {
  const retarget::Clip clip = import_character(kSamples + "/" + GetParam().file, "0", {60}).clip;
  EXPECT_EQ(clip.frames(), static_cast<int>(std::lround(60 * clip.range_s)) + 1);
  EXPECT_DOUBLE_EQ(clip.rate_hz, (clip.frames() - 1) / clip.range_s);
}

INSTANTIATE_TEST_SUITE_P(Samples, SampleClip, testing::ValuesIn(kSampleClips), [](const auto& sample) {
  std::string name = sample.param.file;
  std::replace(name.begin(), name.end(), '.', '_');
  return name;
});

// --- the same in a mirror

/// A copy of a .glb, all that its scene holds below a node of this scale.
std::string scaled_copy(const std::string& glb, const Eigen::Vector3d& scale, const std::filesystem::path& copy) {
  std::ifstream in(glb, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), {});
  const auto word = [&](std::size_t at) {
    std::uint32_t value = 0;
    std::memcpy(&value, bytes.data() + at, 4);
    return value;
  };
  nlohmann::json json = nlohmann::json::parse(bytes.substr(20, word(12)));
  nlohmann::json& roots = json["scenes"][0]["nodes"];
  json["nodes"].push_back({{"name", "mirror"}, {"scale", {scale.x(), scale.y(), scale.z()}}, {"children", roots}});
  roots = {json["nodes"].size() - 1};
  std::string text = json.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const std::string rest = bytes.substr(20 + word(12));
  std::ofstream out(copy, std::ios::binary);
  const std::uint32_t head[5] = {word(0), word(4), static_cast<std::uint32_t>(20 + text.size() + rest.size()),
                                 static_cast<std::uint32_t>(text.size()), word(16)};
  out.write(reinterpret_cast<const char*>(head), sizeof head) << text << rest;
  return copy.string();
}

double volume_of(const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xi& triangles) {
  double volume = 0;
  for (const auto t : triangles.colwise()) volume += x.col(t[0]).dot(x.col(t[1]).cross(x.col(t[2]))) / 6;
  return volume;
}

/// How far the normals that a look tells stand out of its triangles [m2].
double outwardness(const Appearance& appearance, const Eigen::Matrix3Xd& x) {
  double sum = 0;
  for (const Appearance::Part& part : appearance.parts) {
    if (part.normals.cols() == 0) continue;
    for (const auto t : part.triangles.colwise()) {
      const Eigen::Vector3d at = x.col(part.vertices[t[0]]), b = x.col(part.vertices[t[1]]) - at, c = x.col(part.vertices[t[2]]) - at;
      for (const int corner : t) sum += b.cross(c).dot(part.normals.col(corner)) / 6;
    }
  }
  return sum;
}

/// What the file's bind matrices know nothing of: a node above the skeleton that mirrors it.
TEST(ImportCharacter, OfAMirroredClipIsItsMirrorImage) {
  const TemporaryDirectory directory;
  for (const char* file : {"boxdog_jump.glb", "worm_crawl.glb"}) {
    Appearance plain_looks, looks;
    const retarget::Character plain = import_character(kSamples + "/" + file, "", {30}, nullptr, &plain_looks);
    for (const Eigen::Vector3d& scale : {Eigen::Vector3d(-1, 1, 1), Eigen::Vector3d(1, 1, -1), Eigen::Vector3d(-2, 2, 2),
                                         Eigen::Vector3d(-1, 1, -1), Eigen::Vector3d(1, 1, 1)}) {
      SCOPED_TRACE(std::string(file) + " under a scale of " + std::to_string(scale.x()) + ", " + std::to_string(scale.z()));
      const retarget::Character seen = import_character(scaled_copy(kSamples + "/" + file, scale, directory.path / "copy.glb"), "", {30},
                                                         nullptr, &looks);
      ASSERT_EQ(seen.skin.vertices.cols(), plain.skin.vertices.cols());
      const double size = scale.norm() * plain.skin.vertices.norm();
      EXPECT_LT((seen.skin.vertices - scale.asDiagonal() * plain.skin.vertices).norm(), 1e-6 * size);
      EXPECT_NEAR(volume_of(seen.skin.vertices, seen.skin.triangles),
                  std::abs(scale.prod()) * volume_of(plain.skin.vertices, plain.skin.triangles), 1e-9);
      EXPECT_NEAR(outwardness(looks, seen.skin.vertices), scale.y() * scale.y() * outwardness(plain_looks, plain.skin.vertices), 1e-6);
      for (const Eigen::Affine3d& bind : seen.skeleton.bind_pose) EXPECT_NEAR(bind.linear().determinant(), 1, 1e-9);
      ASSERT_EQ(seen.clip.frames(), plain.clip.frames());
      for (Eigen::Index f = 0; f < seen.clip.frames(); ++f) {
        EXPECT_LT((skin_positions(seen, f) - scale.asDiagonal() * skin_positions(plain, f)).norm(), 1e-6 * size);
        for (const Eigen::Affine3d& pose : seen.clip.bone_pose[static_cast<std::size_t>(f)]) EXPECT_GT(pose.linear().determinant(), 0);
      }
    }
  }
}

// --- small files of our own

Eigen::Vector3d tip_at(const std::string& path, double fraction) {
  const retarget::Character character = import_character(path, "bow", {20});
  const auto frame = static_cast<std::size_t>(std::lround(fraction * (character.clip.frames() - 1)));
  const Eigen::Matrix3Xd points = skin_positions(character.skeleton, character.skin, character.clip.bone_pose[frame]);
  return (points.col(4) + points.col(5)) / 2;
}

Eigen::Vector3d turned_tip(double angle) { return {-std::sin(angle), 1 + std::cos(angle), 0}; }

TEST(ImportCharacter, LinearKeysTurnAtConstantSpeed) {
  const TemporaryDirectory directory;
  const std::string path = TinyGltf{}.write(directory.path.string());
  for (const double fraction : {0.0, 0.25, 0.5, 1.0}) {
    EXPECT_LT((tip_at(path, fraction) - turned_tip(fraction * std::numbers::pi / 2)).norm(), 1e-6) << fraction;
  }
}

TEST(ImportCharacter, StepKeysHoldUntilTheNext) {
  const TemporaryDirectory directory;
  TinyGltf file;
  file.interpolation = "STEP";
  const std::string path = file.write(directory.path.string());
  EXPECT_LT((tip_at(path, 0.95) - turned_tip(0)).norm(), 1e-6);
  EXPECT_LT((tip_at(path, 1) - turned_tip(std::numbers::pi / 2)).norm(), 1e-6);
}

TEST(ImportCharacter, CubicKeysFollowTheirTangents) {
  const TemporaryDirectory directory;
  TinyGltf file;
  file.interpolation = "CUBICSPLINE";
  // In-tangent, value, out-tangent of two equal keys: midway the z component is 1/8 of the tangents' difference.
  const float slope = 4;
  file.rotations = {0, 0, 0, 0, 0, 0, 0, 1, 0, 0, slope, 0, 0, 0, -slope, 0, 0, 0, 0, 1, 0, 0, 0, 0};
  const double half_angle = std::atan2(slope / 8 + slope / 8, 1);
  EXPECT_LT((tip_at(file.write(directory.path.string()), 0.5) - turned_tip(2 * half_angle)).norm(), 1e-6);
}

TEST(ImportCharacter, NormalisedBytesWeighAsTheirFractions) {
  const TemporaryDirectory directory;
  TinyGltf file;
  file.weights_of_high = {0, 0, 0.4f, 0.4f, 1, 1};  // 102 of 255
  const retarget::Character in_floats = import_character(file.write(directory.path.string()), "", {});
  file.weights_as_bytes = true;
  const retarget::Character in_bytes = import_character(file.write(directory.path.string()), "", {});
  for (std::size_t f = 0; f < in_floats.clip.bone_pose.size(); ++f) {
    const Eigen::Matrix3Xd a = skin_positions(in_floats.skeleton, in_floats.skin, in_floats.clip.bone_pose[f]);
    const Eigen::Matrix3Xd b = skin_positions(in_bytes.skeleton, in_bytes.skin, in_bytes.clip.bone_pose[f]);
    ASSERT_LT((a - b).norm(), 1e-6);
  }
}

TEST(ImportCharacter, BindPoseTakesTheSizeOfTheFirstFrame) {
  const TemporaryDirectory directory;
  TinyGltf file;
  file.scale_of_root = 0.25f;
  const retarget::Character character = import_character(file.write(directory.path.string()), "", {});
  EXPECT_NEAR(character.skin.vertices.row(1).maxCoeff(), 0.5, 1e-9);  // 2 m in the file
  EXPECT_LT((character.clip.bone_pose.front()[1].matrix() - character.skeleton.bind_pose[1].matrix()).norm(), 1e-6);
}

TEST(ImportCharacter, VerticesWithoutWeightsGoWithTheNearestBoneAndAreTold) {
  const TemporaryDirectory directory;
  TinyGltf file;
  file.vertices_without_weights = {4, 5};
  std::vector<std::string> warnings;
  const retarget::Character character = import_character(file.write(directory.path.string()), "", {}, &warnings);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings.front().find("2 vertices have no skin weights"), std::string::npos) << warnings.front();
  for (const std::size_t v : {4u, 5u}) {
    ASSERT_EQ(character.skin.skin_weights[v].size(), 1u);
    EXPECT_EQ(character.skeleton.names[static_cast<std::size_t>(character.skin.skin_weights[v].front().bone)], "high");
  }
}

/// Leaves nothing below the strip's vertices, and lists those of its right side and its top; `last` is what the last place
/// is.
void make_sparse(nlohmann::json& file, GltfBuffer& buffer, int last) {
  const int places =
      buffer.add(std::vector<std::uint16_t>{0, 1, 2, 3, 4, static_cast<std::uint16_t>(last)}, 5123, "SCALAR", 1);
  const int values = buffer.add(
      std::vector<float>{-0.1f, 0, 0, 0.1f, 0, 0, -0.1f, 1, 0, 0.1f, 1, 0, -0.1f, 2, 0, 0.1f, 2, 0}, 5126, "VEC3", 3);
  auto& accessor = buffer.accessors[file["meshes"][0]["primitives"][0]["attributes"]["POSITION"].get<std::size_t>()];
  accessor.erase("bufferView");
  accessor["sparse"] = {
      {"count", 6},
      {"indices",
       {{"bufferView", buffer.accessors[static_cast<std::size_t>(places)]["bufferView"]}, {"componentType", 5123}}},
      {"values", {{"bufferView", buffer.accessors[static_cast<std::size_t>(values)]["bufferView"]}}}};
}

TEST(ImportGltf, SparseDataAndDataOverAnotherAreReadAsTheyMean) {
  const TemporaryDirectory directory;
  const TinyGltf whole;
  TinyGltf sparse, over;
  sparse.amend = [](auto& json, auto& buffer) { make_sparse(json, buffer, 5); };
  over.amend = [](auto& json, auto& buffer) {  // the vertices are all at the origin but for those that are listed
    const int zeros = buffer.add(std::vector<float>(18, 0.0f), 5126, "VEC3", 3);
    make_sparse(json, buffer, 5);
    auto& accessor =
        buffer.accessors[json["meshes"][0]["primitives"][0]["attributes"]["POSITION"].template get<std::size_t>()];
    accessor["bufferView"] = buffer.accessors[static_cast<std::size_t>(zeros)]["bufferView"];
  };
  const retarget::Character expected = import_character(whole.write(directory.path.string()), "", {});
  for (const TinyGltf* file : {&sparse, &over}) {
    const retarget::Character got = import_character(file->write(directory.path.string()), "", {});
    EXPECT_EQ(got.skin.vertices, expected.skin.vertices);
    EXPECT_EQ(got.skin.triangles, expected.skin.triangles);
  }
}

TEST(ImportGltf, ASkinWithoutInverseBindMatricesHasIdentities) {
  const TemporaryDirectory directory;
  TinyGltf file, identities;
  file.with_bind_matrices = false;
  identities.amend = [](auto& json, auto& buffer) {
    std::vector<float> matrices(32, 0.0f);
    for (std::size_t k = 0; k < 32; k += 16) matrices[k] = matrices[k + 5] = matrices[k + 10] = matrices[k + 15] = 1;
    json["skins"][0]["inverseBindMatrices"] = buffer.add(matrices, 5126, "MAT4", 16);
  };
  const retarget::Character got = import_character(file.write(directory.path.string()), "", {});
  const retarget::Character expected = import_character(identities.write(directory.path.string()), "", {});
  ASSERT_EQ(got.clip.frames(), expected.clip.frames());
  for (int f = 0; f < got.clip.frames(); ++f) {
    const std::vector<Eigen::Affine3d>& pose = got.clip.bone_pose[static_cast<std::size_t>(f)];
    EXPECT_EQ(skin_positions(got.skeleton, got.skin, pose),
              skin_positions(expected.skeleton, expected.skin, expected.clip.bone_pose[static_cast<std::size_t>(f)]));
  }
}

struct Refusal {
  const char* name;
  void (*spoil)(TinyGltf&);
  const char* place;  // part of Error::where
  const char* what;   // part of what()
};

class RefusedGltf : public testing::TestWithParam<Refusal> {};

TEST_P(RefusedGltf, IsToldWithPlaceAndMend) {
  const TemporaryDirectory directory;
  TinyGltf file;
  GetParam().spoil(file);
  const std::string path = file.write(directory.path.string());
  const Error error = error_of([&] { inspect(path); });
  EXPECT_EQ(error.file, path);
  EXPECT_NE(error.where.find(GetParam().place), std::string::npos) << error.where;
  EXPECT_NE(std::string(error.what()).find(GetParam().what), std::string::npos) << error.what();
  EXPECT_FALSE(error.mend.empty());
}

INSTANTIATE_TEST_SUITE_P(
    Import, RefusedGltf,
    testing::Values(Refusal{"SparseOutside",
                            [](TinyGltf& file) {
                              file.amend = [](auto& json, auto& buffer) { make_sparse(json, buffer, 6); };
                            },
                            "mesh 'strip'", "names an element that is not there"},
                    Refusal{"NoSkin", [](TinyGltf& file) { file.with_skin = false; }, "skeleton", "no mesh is bound"},
                    Refusal{"NoWeights", [](TinyGltf& file) { file.vertices_without_weights = {0, 1, 2, 3, 4, 5}; },
                            "skeleton", "no mesh is bound"},
                    Refusal{"OneKey",
                            [](TinyGltf& file) {
                              file.key_times = {0}, file.rotations = {0, 0, 0, 1};
                            },
                            "clips", "zero length"},
                    Refusal{"TooFewValues",
                            [](TinyGltf& file) {
                              file.rotations = {0, 0, 0, 1};
                            },
                            "node 'high'", "1 values for 2 key times"},
                    Refusal{"ShortCubic", [](TinyGltf& file) { file.interpolation = "CUBICSPLINE"; }, "node 'high'",
                            "2 values for 2 key times"},
                    Refusal{"Descending",
                            [](TinyGltf& file) {
                              file.key_times = {1, 0};
                            },
                            "clip 'bow'", "do not ascend"},
                    Refusal{"NotFinite",
                            [](TinyGltf& file) {
                              file.key_times = {0, NAN};
                            },
                            "clip 'bow'", "not a finite number"},
                    Refusal{"ZeroQuaternion", [](TinyGltf& file) { file.rotations = {0, 0, 0, 1, 0, 0, 0, 0}; },
                            "node 'high'", "zero quaternion"}),
    [](const auto& refusal) { return std::string(refusal.param.name); });

TEST(ImportCharacter, AnUnknownClipIsToldWithThoseThatExist) {
  const Error error = error_of([] { import_character(kSamples + "/worm_crawl.glb", "gallop", {}); });
  EXPECT_EQ(error.where, "clip 'gallop'");
  EXPECT_NE(error.mend.find("0 'Animation'"), std::string::npos) << error.mend;
}

}  // namespace
}  // namespace hydrostat::io::import_test
