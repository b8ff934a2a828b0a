#include "io/import.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>

#include "io/cut_polygons.h"
#include "io/import_worker.h"
#include "io/lost_curves.h"
#include "retarget/error.h"
#include "tests/io/tiny_gltf_file.h"
#include "tests/sanitizers.h"

namespace hydrostat::io::import_test {
namespace {

using Box = std::array<double, 6>;  // min x y z, max x y z

const std::string kSamples = HYDROSTAT_SAMPLES;

/// Where clips lie that others made and that are not part of this project; empty when they are not there.
std::string assets() {
  const char* set = std::getenv("HYDROSTAT_ASSETS");
  const std::string directory = set ? set : HYDROSTAT_DEFAULT_ASSETS;
  return std::filesystem::exists(directory + "/golden_bbox.json") ? directory : std::string();
}

class ImportEnvironment : public testing::Environment {
  void SetUp() override {
    set_import_worker_executable((std::filesystem::path(HYDROSTAT_BINARY).parent_path() / "hydrostat-import").string());
    if (assets().empty())
      std::cout << "Tests on third-party clips are left out: HYDROSTAT_ASSETS names no directory that holds them.\n";
  }
};
const testing::Environment* const kEnvironment = testing::AddGlobalTestEnvironment(new ImportEnvironment);

/// A directory of its own for a test, gone when it ends.
class TemporaryDirectory {
 public:
  TemporaryDirectory() {
    std::string pattern = (std::filesystem::temp_directory_path() / "hydrostat_XXXXXX").string();
    path_ = mkdtemp(pattern.data());
  }
  ~TemporaryDirectory() { std::filesystem::remove_all(path_); }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

std::string write_file(const std::string& path, const std::string& text) {
  std::ofstream(path) << text;
  return path;
}

double extent(const Box& box) { return std::max({box[3] - box[0], box[4] - box[1], box[5] - box[2]}); }

/// Largest distance of a face from where it should be, relative to the box's largest extent.
double misfit(const BoxInfo& found, const Box& wanted) {
  double worst = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    worst = std::max({worst, std::abs(found.min[axis] - wanted[a]), std::abs(found.max[axis] - wanted[a + 3])});
  }
  return worst / extent(wanted);
}

Box box_of(const Eigen::Matrix3Xd& points) {
  const Eigen::Vector3d low = points.rowwise().minCoeff(), high = points.rowwise().maxCoeff();
  return {low.x(), low.y(), low.z(), high.x(), high.y(), high.z()};
}

/// What the command prints, both streams, and its exit code.
struct Outcome {
  std::string text;
  int exit_code;
};
Outcome run(const std::string& arguments) {
  FILE* pipe = popen((std::string(HYDROSTAT_BINARY) + " " + arguments + " 2>&1").c_str(), "r");
  std::string text;
  for (int letter = fgetc(pipe); letter != EOF; letter = fgetc(pipe)) text.push_back(static_cast<char>(letter));
  const int status = pclose(pipe);
  return {text, WIFEXITED(status) ? WEXITSTATUS(status) : -1};
}

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
  const std::string path = TinyGltf{}.write(directory.path());
  for (const double fraction : {0.0, 0.25, 0.5, 1.0}) {
    EXPECT_LT((tip_at(path, fraction) - turned_tip(fraction * std::numbers::pi / 2)).norm(), 1e-6) << fraction;
  }
}

TEST(ImportCharacter, StepKeysHoldUntilTheNext) {
  const TemporaryDirectory directory;
  TinyGltf file;
  file.interpolation = "STEP";
  const std::string path = file.write(directory.path());
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
  EXPECT_LT((tip_at(file.write(directory.path()), 0.5) - turned_tip(2 * half_angle)).norm(), 1e-6);
}

TEST(ImportCharacter, NormalisedBytesWeighAsTheirFractions) {
  const TemporaryDirectory directory;
  TinyGltf file;
  file.weights_of_high = {0, 0, 0.4f, 0.4f, 1, 1};  // 102 of 255
  const retarget::Character in_floats = import_character(file.write(directory.path()), "", {});
  file.weights_as_bytes = true;
  const retarget::Character in_bytes = import_character(file.write(directory.path()), "", {});
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
  const retarget::Character character = import_character(file.write(directory.path()), "", {});
  EXPECT_NEAR(character.skin.vertices.row(1).maxCoeff(), 0.5, 1e-9);  // 2 m in the file
  EXPECT_LT((character.clip.bone_pose.front()[1].matrix() - character.skeleton.bind_pose[1].matrix()).norm(), 1e-6);
}

TEST(ImportCharacter, VerticesWithoutWeightsGoWithTheNearestBoneAndAreTold) {
  const TemporaryDirectory directory;
  TinyGltf file;
  file.vertices_without_weights = {4, 5};
  std::vector<std::string> warnings;
  const retarget::Character character = import_character(file.write(directory.path()), "", {}, &warnings);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings.front().find("2 vertices have no skin weights"), std::string::npos) << warnings.front();
  for (const std::size_t v : {4u, 5u}) {
    ASSERT_EQ(character.skin.skin_weights[v].size(), 1u);
    EXPECT_EQ(character.skeleton.names[static_cast<std::size_t>(character.skin.skin_weights[v].front().bone)], "high");
  }
}

TEST(CutPolygon, AnyStarIsFilledOnceByItsTriangles) {
  for (const int corners : {3, 4, 5, 50, 501, 20001}) {
    SCOPED_TRACE(corners);
    Eigen::Matrix3Xd star(3, corners);
    for (int i = 0; i < corners; ++i) {  // in a slanted plane; every other corner turns to the right
      const double angle = 2 * std::numbers::pi * i / corners, radius = i % 2 == 0 ? 1 : 0.6;
      star.col(i) << radius * std::cos(angle), radius * std::sin(angle), 0.5 * radius * std::cos(angle);
    }
    const std::vector<Eigen::Vector3i> triangles = cut_polygon(star);
    ASSERT_EQ(static_cast<int>(triangles.size()), corners - 2);
    double whole = 0, cut = 0;  // twice the areas as seen from above
    const auto area = [&](int a, int b, int c) {
      const Eigen::Vector3d u = star.col(b) - star.col(a), v = star.col(c) - star.col(a);
      return u.x() * v.y() - u.y() * v.x();
    };
    for (int i = 1; i + 1 < corners; ++i) whole += area(0, i, i + 1);
    for (const Eigen::Vector3i& t : triangles) {
      EXPECT_GT(area(t[0], t[1], t[2]), 0);
      cut += area(t[0], t[1], t[2]);
    }
    EXPECT_NEAR(cut, whole, 1e-9);
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
  const retarget::Character expected = import_character(whole.write(directory.path()), "", {});
  for (const TinyGltf* file : {&sparse, &over}) {
    const retarget::Character got = import_character(file->write(directory.path()), "", {});
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
  const retarget::Character got = import_character(file.write(directory.path()), "", {});
  const retarget::Character expected = import_character(identities.write(directory.path()), "", {});
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
  const std::string path = file.write(directory.path());
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

// --- the command

TEST(InfoCommand, TellsTheSchemaOfTheContract) {
  const Outcome outcome = run("info " + kSamples + "/boxdog_trot.fbx --json");
  ASSERT_EQ(outcome.exit_code, 0);
  const nlohmann::json json = nlohmann::json::parse(outcome.text);
  EXPECT_EQ(json.at("schema"), "hydrostat.info/1");
  EXPECT_EQ(json.at("format"), "fbx");
  EXPECT_DOUBLE_EQ(json.at("metres_per_unit"), 0.01);
  EXPECT_EQ(json.at("up"), "y");
  EXPECT_TRUE(json.at("meshes").at(0).at("skinned"));
  EXPECT_EQ(json.at("meshes").at(0).at("triangles"), 3390);
  for (const char* field : {"name", "parent", "weighted"}) EXPECT_TRUE(json.at("bones").at(0).contains(field)) << field;
  const nlohmann::json& clip = json.at("clips").at(0);
  for (const char* field : {"index", "name", "duration_s", "range_s", "rate_hz", "loop", "in_place", "speed_m_s"}) {
    EXPECT_TRUE(clip.contains(field)) << field;
  }
  EXPECT_EQ(clip.at("bbox").at(1).at("fraction"), 0.15);
  EXPECT_EQ(clip.at("bbox").at(1).at("min").size(), 3u);
  EXPECT_TRUE(json.at("warnings").is_array());
}

TEST(InfoCommand, RefusesBadInputWithOneSentenceAndExitCodeOne) {
  const TemporaryDirectory directory;
  const std::string prose = write_file(directory.path() + "/notes.fbx", "This is no clip.\n");
  const std::vector<std::pair<std::string, std::string>> refused{
      {directory.path() + "/missing.glb", "there is no such file"},
      {prose, "it cannot be read"},
      {write_file(directory.path() + "/notes.glb", "This is no clip.\n"), "no whole glTF"},
      {write_file(directory.path() + "/empty.fbx", ""), "it is empty"},
      {write_file(directory.path() + "/notes.txt", "This is no clip.\n"), "no known kind of clip file"}};
  for (const auto& [path, what] : refused) {
    const Outcome outcome = run("info '" + path + "'");
    EXPECT_EQ(outcome.exit_code, 1) << path;
    EXPECT_EQ(outcome.text.find(path + ": "), 0u) << outcome.text;
    EXPECT_NE(outcome.text.find(what), std::string::npos) << outcome.text;
    EXPECT_EQ(std::count(outcome.text.begin(), outcome.text.end(), '\n'), 1) << outcome.text;
  }
}

TEST(InfoCommand, OfADirectoryTellsARowForEachFile) {
  const Outcome table = run("info " + kSamples);
  EXPECT_EQ(table.exit_code, 0);
  EXPECT_EQ(std::count(table.text.begin(), table.text.end(), '\n'), 4) << table.text;
  const TemporaryDirectory directory;
  EXPECT_NE(run("info " + directory.path()).text.find("holds no clip file"), std::string::npos);
  write_file(directory.path() + "/notes.glb", "This is no clip.\n");
  const Outcome refused = run("info --json " + directory.path());
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_NE(nlohmann::json::parse(refused.text).at("files").at(0).at("error").get<std::string>().find("no whole glTF"),
            std::string::npos);
}

TEST(InfoCommand, TellsWhatAnAnimatorAsks) {
  const FileInfo trot = inspect(kSamples + "/boxdog_trot.fbx");
  const ClipInfo& clip = trot.clips.front();
  EXPECT_LT(clip.closure_defect_length, 0.001);
  EXPECT_GT(clip.max_strain, 0.2);
  EXPECT_LT(clip.max_strain, 0.35);  // legs that stand side by side do not pull at each other
  ASSERT_EQ(clip.contacts.size(), 4u);  // its paws
  std::map<std::string, double> lifts_s;
  for (const ContactInfo& contact : clip.contacts) {
    EXPECT_GT(contact.duty, 0.56) << contact.bone;  // as it was made, and it lifts its feet gently
    EXPECT_LT(contact.duty, 0.72) << contact.bone;
    EXPECT_LE(contact.times_s.size(), 2u) << contact.bone;  // one stance, perhaps over the loop's end
    lifts_s[contact.bone] = contact.times_s.front().second;
  }
  EXPECT_NEAR(lifts_s["FL_foot"], lifts_s["BR_foot"], 0.03);
  EXPECT_NEAR(lifts_s["FR_foot"], lifts_s["BL_foot"], 0.03);
  EXPECT_EQ(trot.unit_reason, "the file's UnitScaleFactor");
}

TEST(InfoCommand, TheSizeOfAnotherUnitIsToldWithTheUnit) {
  const FileInfo large = inspect(kSamples + "/worm_crawl.glb", {.metres_per_unit = 100});
  EXPECT_EQ(large.unit_reason, "as --unit says");
  ASSERT_FALSE(large.warnings.empty());
  const std::string& warning = large.warnings.back();
  EXPECT_NE(warning.find("44.4 m long"), std::string::npos) << warning;
  EXPECT_NE(warning.find("if the file's unit were 1 m it would be 0.444 m"), std::string::npos) << warning;
}

TEST(InfoCommand, SegmentsThatNoTriangleJoinsAskForStrainAtTheirJoints) {
  if (assets().empty()) GTEST_SKIP();
  EXPECT_GT(inspect(assets() + "/gltf/spider_animated.gltf").clips.at(0).max_strain, 0.2);
  EXPECT_GT(inspect(assets() + "/bvh/jumping_jacks.bvh").clips.at(0).max_strain, 0.2);
}

TEST(InfoCommand, TheLargestFilesTakeLittleTimeAndMemory) {
  if (assets().empty() || kSanitized) GTEST_SKIP();
  for (const auto& [file, most_s] : {std::pair{"fbx/alien_14_clips.fbx", 3.0}, {"bvh/cmu_01_03_long.bvh", 2.0}}) {
    rusage before{}, after{};
    getrusage(RUSAGE_CHILDREN, &before);
    EXPECT_EQ(run("info '" + assets() + "/" + file + "'").exit_code, 0);
    getrusage(RUSAGE_CHILDREN, &after);
    const auto seconds = [](const timeval& time) {
      return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
    };
    EXPECT_LT(seconds(after.ru_utime) + seconds(after.ru_stime) - seconds(before.ru_utime) - seconds(before.ru_stime),
              most_s)
        << file;
    EXPECT_LT(after.ru_maxrss, 300 << 10) << file;  // [KiB] of the largest of its processes
  }
}

TEST(InfoCommand, ASkeletonStandsOnTheFeetThatAConversionGivesIt) {
  if (assets().empty()) GTEST_SKIP();
  const FileInfo jacks = inspect(assets() + "/bvh/jumping_jacks.bvh");
  double left = 0, right = 0;
  for (const ContactInfo& contact : jacks.clips.at(0).contacts) {
    double& most = contact.bone.starts_with("Left") ? left : right;
    most = std::max(most, contact.duty);
  }
  EXPECT_GT(std::min(left, right), 0.2) << "jumping jacks stand on both feet";
}

TEST(LostCurves, AreWarnedOfWhereGreatArcAndEulerAnglesPart) {
  Scene scene;
  for (int n = 0; n < 2; ++n) {
    SceneNode node;
    node.name = n == 0 ? "hip" : "knee";
    node.parent = n - 1;
    node.parts = {Eigen::Affine3d(Eigen::Translation3d(0, n, 0))};
    node.is_joint = true;
    scene.nodes.push_back(node);
  }
  const auto warnings = [&](const Eigen::Quaterniond& from, const Eigen::Quaterniond& to) {
    Channel channel;
    channel.rotation.times = {0, 1.0 / 60};
    channel.rotation.values.resize(4, 2);
    channel.rotation.values << from.coeffs(), to.coeffs();
    return lost_curve_warnings(scene, {"run", 1.0 / 60, {channel}}, 1.0 / 60).size();
  };
  using Eigen::AngleAxisd, Eigen::Quaterniond, Eigen::Vector3d;
  const Quaterniond tilt(AngleAxisd(0.4, Vector3d::UnitZ()) * AngleAxisd(-0.7, Vector3d::UnitY()));
  EXPECT_EQ(warnings(tilt, tilt * Quaterniond(AngleAxisd(0.8, Vector3d::UnitX()))), 0u) << "as a knee bends";
  EXPECT_EQ(warnings(tilt, tilt * Quaterniond(AngleAxisd(0.2, Vector3d(1, 1, 1).normalized()))), 0u) << "a little";
  EXPECT_EQ(warnings(tilt, tilt * Quaterniond(AngleAxisd(0.8, Vector3d(1, 1, 1).normalized()))), 1u);
}

TEST(InfoCommand, UnitAndAxisOfTheUserStand) {
  const std::string path = kSamples + "/worm_crawl.glb";
  const FileInfo as_is = inspect(path), turned = inspect(path, {.up = "z", .metres_per_unit = 2});
  const BoxInfo &a = as_is.clips[0].bbox[0], &b = turned.clips[0].bbox[0];
  EXPECT_LT((2 * Eigen::Vector3d(a.min.x(), a.min.z(), -a.max.y()) - b.min).norm(), 1e-9);
  EXPECT_LT((2 * Eigen::Vector3d(a.max.x(), a.max.z(), -a.min.y()) - b.max).norm(), 1e-9);
  EXPECT_EQ(turned.up, "z");
}

TEST(InfoCommand, TheReaderSeesNothingElseAndIsHeldToItsLimits) {
  const FileInfo info = inspect(kSamples + "/worm_crawl.glb");
  EXPECT_TRUE(info.network_confined);  // Landlock is the kernel's choice, seccomp is in all
  const Outcome slow = run("info " + kSamples + "/boxdog_trot.fbx --import-memory 0.1");
  EXPECT_EQ(slow.exit_code, 2);
}

TEST(InfoCommand, RefusesAnUnknownOptionWithExitCodeTwo) {
  EXPECT_EQ(run("info " + kSamples + "/worm_crawl.glb --jsn").exit_code, 2);
  EXPECT_EQ(run("info").exit_code, 2);
}

// --- clips that others made

struct GoldenFile {
  std::string name;
  double tolerance;  // relative to the largest extent
};
std::ostream& operator<<(std::ostream& out, const GoldenFile& file) { return out << file.name; }

/// Files with golden boxes and how near ours are. Above 0.3 % where assimp loses the curves between keys, and where the
/// golden box holds a mesh that is not the character's; the clips that are then off are told of.
std::vector<GoldenFile> golden_files() {
  if (assets().empty()) return {};
  std::vector<GoldenFile> files;
  const std::map<std::string, double> loose{{"fbx/frog.fbx", 0.0121},
                                            {"fbx/alien_14_clips.fbx", 0.0121},
                                            {"fbx/robot_same_names.fbx", 0.0121},
                                            {"fbx/maya_sausage_3_takes.fbx", 0.0121},
                                            {"fbx/max_transformed_skin_zup.fbx", 0.08},  // two keys, 3.3 s apart
                                            {"fbx/maya_slime.fbx", 0.25}};               // a second body that nothing moves
  const nlohmann::json golden = nlohmann::json::parse(std::ifstream(assets() + "/golden_bbox.json"));
  for (const auto& [name, file] : golden.at("files").items()) {
    files.push_back({name, loose.contains(name) ? loose.at(name) : 0.003});
  }
  std::erase_if(files, [](const GoldenFile& file) { return !std::filesystem::exists(assets() + "/" + file.name); });
  return files;
}

/// Golden FBX boxes are in the file's units and axes.
Box in_metres_y_up(const nlohmann::json& numbers, double metres_per_unit, bool z_up) {
  Box box;
  for (std::size_t i = 0; i < 6; ++i) box[i] = metres_per_unit * numbers.at(i).get<double>();
  return z_up ? Box{box[0], box[2], -box[4], box[3], box[5], -box[1]} : box;
}

class GoldenClip : public testing::TestWithParam<GoldenFile> {};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(GoldenClip);

TEST_P(GoldenClip, StandsWhereOtherReadersSeeIt) {
  const nlohmann::json golden =
      nlohmann::json::parse(std::ifstream(assets() + "/golden_bbox.json")).at("files").at(GetParam().name);
  const FileInfo info = inspect(assets() + "/" + GetParam().name);
  ASSERT_EQ(info.clips.size(), golden.at("clips").size());
  const bool z_up = golden.at("axes") != "Y up" && info.up == "z";
  // BVH has no unit: the boxes are in that which the importer took.
  const double unit_m =
      golden.at("metres_per_unit").is_null() ? info.metres_per_unit : golden.at("metres_per_unit").get<double>();
  EXPECT_DOUBLE_EQ(unit_m, info.metres_per_unit);
  for (std::size_t c = 0; c < info.clips.size(); ++c) {
    const nlohmann::json& wanted = golden.at("clips").at(c);
    SCOPED_TRACE("clip " + info.clips[c].name);
    EXPECT_EQ(info.clips[c].name, wanted.at("name").get<std::string>());
    EXPECT_NEAR(info.clips[c].duration_s, wanted.at("duration_s").get<double>(), 1e-3);
    double worst = 0;
    for (std::size_t f = 0; f < info.clips[c].bbox.size(); ++f) {
      worst = std::max(worst, misfit(info.clips[c].bbox[f], in_metres_y_up(wanted.at("bbox").at(f), unit_m, z_up)));
    }
    EXPECT_LT(worst, GetParam().tolerance);
    const bool told = std::any_of(info.warnings.begin(), info.warnings.end(), [&](const std::string& warning) {
      const bool lost = warning.starts_with("Clip '" + info.clips[c].name + "', bone '") &&
                        warning.find("before export") != std::string::npos;
      return lost || warning.find("left out: 'Slime_002:Slime_Body_high'") != std::string::npos;
    });
    EXPECT_TRUE(worst < 0.003 || told) << "off by " << worst << " and not told";
  }
}

TEST_P(GoldenClip, SkinningTheCharacterKeepsTheFirstBox) {
  const std::string path = assets() + "/" + GetParam().name;
  const FileInfo info = inspect(path);
  const retarget::Character character = import_character(path, "", {});
  const ClipInfo& clip = info.clips[static_cast<std::size_t>(character.clip.index)];
  const Box first = box_of(skin_positions(character.skeleton, character.skin, character.clip.bone_pose.front()));
  // Before the first key the clip holds still. Capsules reach beyond the joints that info tells of.
  EXPECT_LT(misfit(clip.bbox.front(), first), info.meshes.empty() ? 0.08 : 1e-5);
}

std::string test_name(const testing::TestParamInfo<GoldenFile>& file) {
  std::string name = file.param.name;
  std::replace_if(
      name.begin(), name.end(), [](char letter) { return letter == '/' || letter == '.'; }, '_');
  return name;
}
INSTANTIATE_TEST_SUITE_P(ThirdParty, GoldenClip, testing::ValuesIn(golden_files()), test_name);

/// The same motion in centimetres and y up, in metres and z up, and as glTF.
class SameWorm : public testing::TestWithParam<GoldenFile> {};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(SameWorm);

TEST_P(SameWorm, MovesAlikeInEveryUnitAxisAndFormat) {
  const retarget::Character ours = import_character(kSamples + "/worm_crawl.glb", "", {});
  const retarget::Character other = import_character(assets() + "/" + GetParam().name, "", {});
  ASSERT_EQ(ours.clip.frames(), other.clip.frames());
  EXPECT_EQ(ours.skin.vertices.cols(), other.skin.vertices.cols());
  const Box bind = box_of(ours.skin.vertices), other_bind = box_of(other.skin.vertices);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(bind[i], other_bind[i], 1e-4);  // [m]
  for (std::size_t f = 0; f < ours.clip.bone_pose.size(); f += 7) {
    const Box a = box_of(skin_positions(ours.skeleton, ours.skin, ours.clip.bone_pose[f]));
    const Box b = box_of(skin_positions(other.skeleton, other.skin, other.clip.bone_pose[f]));
    for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(a[i], b[i], 2e-4) << "frame " << f;  // [m]
  }
}

std::vector<GoldenFile> worms() {
  std::vector<GoldenFile> files;
  for (const GoldenFile& file : golden_files()) {
    if (file.name.find("worm_crawl") != std::string::npos) files.push_back(file);
  }
  return files;
}
INSTANTIATE_TEST_SUITE_P(ThirdParty, SameWorm, testing::ValuesIn(worms()), test_name);

/// Files that end or mislead the library which reads them.
std::vector<GoldenFile> hostile_files() {
  std::vector<GoldenFile> files;
  for (const char* name :
       {"broken/assert_abort.fbx", "broken/Animation_Skin_04.gltf", "broken/fox_truncated.glb", "broken/fuzz_0100.fbx",
        "broken/fuzz_0739.fbx", "broken/huge_count.dae", "broken/inf_nan_ascii.fbx", "broken/old_version_6100_ascii.fbx",
        "broken/recursive_nodes.gltf", "broken/rigged_simple_bind_short.gltf", "broken/rigged_simple_cubic_too_short.gltf",
        "broken/rigged_simple_nan_time.gltf", "broken/rigged_simple_unsorted_times.gltf", "gltf/AnimatedMorphCube.gltf",
        "gltf/interpolation_test.gltf"}) {
    if (!assets().empty() && std::filesystem::exists(assets() + "/" + name)) files.push_back({name, 0});
  }
  return files;
}

class HostileFile : public testing::TestWithParam<GoldenFile> {};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(HostileFile);

TEST_P(HostileFile, EndsInOneSentenceAndExitCodeOne) {
  const std::string path = assets() + "/" + GetParam().name;
  const Outcome outcome = run("info '" + path + "'");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.text.find(path + ": "), 0u) << outcome.text;
  EXPECT_EQ(std::count(outcome.text.begin(), outcome.text.end(), '\n'), 1) << outcome.text;
}
INSTANTIATE_TEST_SUITE_P(ThirdParty, HostileFile, testing::ValuesIn(hostile_files()), test_name);

}  // namespace
}  // namespace hydrostat::io::import_test
