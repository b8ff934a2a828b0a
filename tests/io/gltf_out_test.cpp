#include "io/gltf_out.h"

#include <gtest/gtest.h>
#include <tiny_gltf.h>

#include <Eigen/Geometry>
#include <cstdlib>
#include <fstream>

#include "io/read_scene.h"
#include "retarget/error.h"
#include "tests/io/moving_creature.h"
#include "tests/io/played_glb.h"

namespace hydrostat::io::gltf_out_test {
namespace {

using namespace moving_creature;
using namespace played_glb;

namespace fs = std::filesystem;

void write(const fs::path& path, const Creature& creature) {
  write_skinned_glb(path, {creature.vertices, creature.triangles, creature.embedding}, creature.body, creature.mass,
                    creature.motion, {});
}

fs::path scratch(const std::string& name) { return fs::path(testing::TempDir()) / ("hydrostat_" + name + ".glb"); }

std::string bytes_of(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

TEST(WriteSkinnedGlb, AnEnginePlaysTheEmbeddedPositions) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Creature creature = random_creature(seed, /*nodes=*/20, /*vertices=*/60, /*frames=*/8);
    write(scratch("exact"), creature);
    const tinygltf::Model model = load(scratch("exact"));
    for (Eigen::Index f = 0; f < creature.motion.count(); ++f) {
      const Eigen::Matrix3Xd expected = embedded(creature, creature.motion.at(f));
      EXPECT_LT((play(model, static_cast<std::size_t>(f)) - expected).cwiseAbs().maxCoeff(), 2e-6);  // [m]: float32
    }
    const Eigen::Matrix3Xd halfway = 0.5 * (creature.motion.at(2) + creature.motion.at(3));
    EXPECT_LT((play(model, 2, 0.5) - embedded(creature, halfway)).cwiseAbs().maxCoeff(), 2e-6);
  }
}

TEST(WriteSkinnedGlb, AllJointsTurnAsTheBodyDoesAndTheirKeysTakeTheShortWay) {
  const Creature creature = random_creature(3, 20, 30, 12);  // 0.7 rad a frame: past half a turn and past a whole one
  write(scratch("turn"), creature);
  const tinygltf::Model model = load(scratch("turn"));
  for (const tinygltf::AnimationChannel& channel : model.animations[0].channels) {
    if (channel.target_path != "rotation") continue;
    const std::vector<float> keys =
        values<float>(model, model.animations[0].samplers[static_cast<std::size_t>(channel.sampler)].output);
    for (std::size_t f = 0; f < 12; ++f) {
      const Eigen::Quaterniond turn = Eigen::Map<const Eigen::Quaternionf>(&keys[4 * f]).cast<double>();
      const Eigen::Quaterniond body(
          Eigen::AngleAxisd(0.7 * static_cast<double>(f), Eigen::Vector3d(0.2, 1, 0.1).normalized()));
      EXPECT_NEAR(turn.norm(), 1, 1e-6);
      EXPECT_LT(turn.angularDistance(body), 0.1);  // [rad]: the wobble turns it too
      if (f > 0) {
        EXPECT_GT(turn.dot(Eigen::Map<const Eigen::Quaternionf>(&keys[4 * (f - 1)]).cast<double>()), 0);
      }
    }
  }
}

/// Angle [rad, RMS over the vertices] between the normals that an engine shows in a frame and those of the moved surface.
double normal_error(const tinygltf::Model& model, const Creature& creature, Eigen::Index frame, bool with_targets) {
  const tinygltf::Primitive& primitive = model.meshes[0].primitives[0];
  const auto normals_at = [&](int accessor) {
    const std::vector<float> numbers = values<float>(model, accessor);
    return Eigen::Matrix3Xd(Eigen::Map<const Eigen::Matrix3Xf>(numbers.data(), 3, creature.vertices.cols()).cast<double>());
  };
  Eigen::Matrix3Xd normals = normals_at(primitive.attributes.at("NORMAL"));
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  for (const tinygltf::AnimationChannel& channel : model.animations[0].channels) {
    const int output = model.animations[0].samplers[static_cast<std::size_t>(channel.sampler)].output;
    if (channel.target_path == "rotation")
      turn = Eigen::Map<const Eigen::Quaternionf>(&values<float>(model, output)[4 * static_cast<std::size_t>(frame)])
                 .cast<double>();
    if (channel.target_path != "weights" || !with_targets) continue;
    const std::size_t targets = primitive.targets.size();
    for (std::size_t k = 0; k < targets; ++k)
      normals += values<float>(model, output)[static_cast<std::size_t>(frame) * targets + k] *
                 normals_at(primitive.targets[k].at("NORMAL"));
  }
  const Eigen::Matrix3Xd shown = turn.toRotationMatrix() * normals.colwise().normalized();
  const Eigen::Matrix3Xd real = surface_normals(creature.motion.at(frame), creature.triangles);
  return std::sqrt((shown - real).squaredNorm() / static_cast<double>(real.cols()));
}

TEST(WriteSkinnedGlb, NormalsBendWithTheBody) {
  const Creature creature = bar({0, 0.5, 1, 1.5, 2, 1, -0.5, -1.5});
  write(scratch("bent"), creature);
  const tinygltf::Model model = load(scratch("bent"));
  EXPECT_LE(model.meshes[0].primitives[0].targets.size(), 8u);
  for (const auto& target : model.meshes[0].primitives[0].targets)
    EXPECT_TRUE(target.contains("POSITION")) << "as three.js wants";
  for (Eigen::Index f = 0; f < creature.motion.count(); ++f) {
    EXPECT_LT(normal_error(model, creature, f, true), 0.07) << "frame " << f;  // [rad]
    EXPECT_LT((play(model, static_cast<std::size_t>(f)) - creature.motion.at(f)).cwiseAbs().maxCoeff(), 2e-6);
  }
  EXPECT_TRUE(read_gltf(scratch("bent")).warnings.empty()) << "targets of normals move no skin";
  EXPECT_GT(normal_error(model, creature, 4, false), 0.3) << "the turn of the whole would do: the test tests nothing";
}

TEST(WriteSkinnedGlb, NormalsBendBesideAPartThatIsFlat) {
  const Creature creature = bar({0, 0.5, 1, 1.5, 2, 1, -0.5, -1.5});
  Appearance looks;
  looks.parts.resize(2);
  for (std::size_t p = 0; p < 2; ++p) {
    Appearance::Part& part = looks.parts[p];
    part.vertices = Eigen::VectorXi::LinSpaced(creature.vertices.cols(), 0, static_cast<int>(creature.vertices.cols()) - 1);
    part.triangles = p == 0 ? creature.triangles : creature.triangles.leftCols(8);
  }
  looks.parts[0].normals = surface_normals(creature.vertices, creature.triangles);
  const auto write_to = [&](const fs::path& path) {
    write_skinned_glb(path, {creature.vertices, creature.triangles, creature.embedding, &looks}, creature.body, creature.mass,
                      creature.motion, {});
  };
  write_to(scratch("half_flat"));
  const tinygltf::Model model = load(scratch("half_flat"));
  for (Eigen::Index f = 0; f < creature.motion.count(); ++f) EXPECT_LT(normal_error(model, creature, f, true), 0.07);
  const auto& primitives = model.meshes[0].primitives;
  ASSERT_EQ(primitives[0].targets.size(), primitives[1].targets.size()) << "as glTF wants";
  EXPECT_FALSE(primitives[1].targets[0].contains("NORMAL"));
}

TEST(WriteSkinnedGlb, NormalsOfARigidBodyNeedNoHelp) {
  write(scratch("rigid"), bar({0, 0, 0}));
  EXPECT_TRUE(load(scratch("rigid")).meshes[0].primitives[0].targets.empty());
}

void write(const fs::path& path, const Face& face) {
  const Creature& creature = face.creature;
  write_skinned_glb(path, {creature.vertices, creature.triangles, creature.embedding, nullptr, &face.morphs}, creature.body,
                    creature.mass, creature.motion, {});
}

TEST(WriteSkinnedGlb, MorphTargetsAreWornByNameAndTurnWithTheBodyAroundThem) {
  const std::vector<double> bends{0, 0.5, 1, 1.5, 2, 1, -0.5, -1.5};
  const Face face(bends);
  write(scratch("face"), face);
  const tinygltf::Model model = load(scratch("face"));
  const tinygltf::Value names = model.meshes[0].extras.Get("targetNames");
  ASSERT_EQ(names.ArrayLen(), model.meshes[0].primitives[0].targets.size());
  EXPECT_EQ(names.Get(0).Get<std::string>(), "pout");
  EXPECT_EQ(names.Get(1).Get<std::string>(), "brow");
  double common_error = 0;
  for (Eigen::Index f = 0; f < face.creature.motion.count(); ++f) {
    const Eigen::Matrix3Xd bare = face.creature.motion.at(f);
    const Eigen::Matrix3d whole =
        Eigen::AngleAxisd(0.3 * static_cast<double>(f), Eigen::Vector3d::UnitY()).toRotationMatrix();
    const double at_end = 0.5 * bends[static_cast<std::size_t>(f)];
    const Eigen::Matrix3d own = whole * Eigen::AngleAxisd(-at_end, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    const Eigen::Matrix3Xd offset =
        retarget::morphed(Eigen::Matrix3Xd::Zero(3, bare.cols()), face.morphs.targets, face.morphs.weights.col(f));
    const Eigen::Matrix3Xd error = play(model, static_cast<std::size_t>(f)) - bare - own * offset;
    // The neighbours turn less than the end itself, by a sixteenth of the bend.
    const double largest = offset.colwise().norm().maxCoeff();
    EXPECT_LT(error.colwise().norm().maxCoeff(), (0.03 + std::abs(at_end) / 7) * largest) << "frame " << f;
    common_error = std::max(common_error, ((whole - own) * offset).colwise().norm().maxCoeff() / largest);
  }
  EXPECT_GT(common_error, 0.8) << "the turn of the whole would do: the test tests nothing";
  const Scene scene = read_gltf(scratch("face"));
  ASSERT_GE(scene.clips.at(0).morphs.size(), 2u);
  EXPECT_EQ(scene.meshes[0].morphs[0].name, "pout");
  EXPECT_NEAR(scene.clips[0].morphs[0].weight.values(0, 2), 0.5, 1e-6);
}

TEST(WriteSkinnedGlb, MorphTargetsOfALoopKeepItsPhaseForEver) {
  Face face({0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0});
  face.morphs.loop = true;
  face.morphs.weights.conservativeResize(Eigen::NoChange, 5);  // 5 frames a period, 13 of the motion
  write(scratch("phase"), face);
  const tinygltf::Model model = load(scratch("phase"));
  const Eigen::Index corner = face.creature.vertices.cols() - 1;
  for (std::size_t f = 0; f < 13; ++f) {
    const double away = (play(model, f) - face.creature.motion.at(static_cast<Eigen::Index>(f))).col(corner).norm();
    EXPECT_NEAR(away, 0.02 * (0.3 + 0.1 * static_cast<double>(f % 5)), 1e-6) << "frame " << f;
  }
}

TEST(WriteSkinnedGlb, ALoopEndsWhereItsNextPeriodBegins) {
  Creature creature = random_creature(1, 12, 20, 6);
  creature.motion.loop = true;
  creature.motion.travel = {0.4, 0, -0.2};
  creature.motion.yaw = 0.3;
  write(scratch("loop"), creature);
  const tinygltf::Model model = load(scratch("loop"));
  EXPECT_FLOAT_EQ(values<float>(model, model.animations[0].samplers[0].input).back(), 6.0f / 30.0f);
  const Eigen::Matrix3Xd next =
      (Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitY()).toRotationMatrix() * embedded(creature, creature.motion.at(0)))
          .colwise() +
      creature.motion.travel;
  EXPECT_LT((play(model, 6) - next).cwiseAbs().maxCoeff(), 2e-6);
}

TEST(WriteSkinnedGlb, WeightsSumToOneInFloat) {
  const Creature creature = random_creature(9, 40, 500, 2);
  write(scratch("weights"), creature);
  const tinygltf::Model model = load(scratch("weights"));
  const std::vector<float> weights = values<float>(model, model.meshes[0].primitives[0].attributes.at("WEIGHTS_0"));
  for (std::size_t v = 0; v < weights.size(); v += 4) {
    EXPECT_NEAR(double{weights[v]} + weights[v + 1] + weights[v + 2] + weights[v + 3], 1, 1.2e-7);
  }
}

TEST(WriteSkinnedGlb, SameInputGivesSameBytesAndLeavesNothingBeside) {
  const Creature creature = random_creature(4, 20, 60, 8);
  write(scratch("first"), creature);
  write(scratch("second"), creature);
  EXPECT_EQ(bytes_of(scratch("first")), bytes_of(scratch("second")));
  EXPECT_FALSE(fs::exists(scratch("first").string() + ".part"));
}

TEST(WriteSkinnedGlb, KhronosValidatorFindsNothing) {
  Creature creature = random_creature(2, 20, 60, 8);
  creature.motion.loop = true;
  write(scratch("valid"), creature);
  write(scratch("valid_bent"), bar({0, 1, 2}));
  write(scratch("valid_face"), Face({0, 1, 2}));
  const std::string command = "NODE_PATH='" HYDROSTAT_NODE_MODULES "' node '" HYDROSTAT_TESTS "/io/validate_glb.cjs' '" +
                              scratch("valid").string() + "' '" + scratch("valid_bent").string() + "' '" +
                              scratch("valid_face").string() + "'";
  EXPECT_EQ(std::system(command.c_str()), 0);
}

TEST(WriteSkinnedGlb, RefusesAPlaceThatCannotBeWritten) {
  EXPECT_THROW(write("/proc/absent/replay.glb", random_creature(0, 5, 6, 2)), Error);
}

}  // namespace
}  // namespace hydrostat::io::gltf_out_test
