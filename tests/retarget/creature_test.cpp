#include "retarget/creature.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "tests/retarget/shapes.h"

namespace hydrostat::retarget::creature_test {
namespace {

/// A block of 1 x 0.4 x 0.5 m on one bone that goes along `travel` [m] in `frames` frames at 60 Hz, `lift` [m] above the ground.
Character block(double scale, const Eigen::Vector3d& travel, int frames, double lift = 0) {
  Character character;
  character.skeleton = one_bone();
  character.skin = box_skin({0, 0, 0}, Eigen::Vector3d(1, 0.4, 0.5) * scale, 0, 8);
  character.clip.rate_hz = character.clip.key_rate_hz = 60;
  character.clip.duration_s = character.clip.range_s = (frames - 1) / 60.0;
  for (int f = 0; f < frames; ++f) {
    const Eigen::Vector3d place = scale * (Eigen::Vector3d(0, lift, 0) + travel * (static_cast<double>(f) / (frames - 1)));
    character.clip.bone_pose.push_back({Eigen::Affine3d(Eigen::Translation3d(place))});
  }
  return character;
}

double extent(const Eigen::Matrix3Xd& points, int axis) { return points.row(axis).maxCoeff() - points.row(axis).minCoeff(); }

TEST(MakeCreature, KeepsASizeThatIsACreatures) {
  const Creature creature = make_creature(block(1, {0, 0, 0}, 6), {});
  EXPECT_EQ(creature.scale, 1);
  EXPECT_TRUE(creature.warnings.empty());
  EXPECT_NEAR(creature.length, 1, 1e-12);
  EXPECT_NEAR(creature.scene.body.mass.sum(), 200, 10);  // [kg] water of 0.2 m3
  EXPECT_NEAR(creature.size, std::cbrt(0.2), 0.02);
  EXPECT_NEAR(creature.youngs_modulus, 1000 * 9.81 * 1 / 0.005, 1);  // rho g L over softness
  EXPECT_EQ(bones_of(creature.contacts).size(), static_cast<std::size_t>(creature.scene.contact_points.count()));
}

TEST(MakeCreature, OfElementsHasTheSameNodesAndCells) {
  const Creature springs = make_creature(block(1, {0, 0, 0}, 6), {});
  for (const bool hexahedra : {false, true}) {
    CreatureOptions options;
    options.material = BodyMaterial::kCorotatedLinear;
    options.hexahedra = hexahedra;
    const Creature creature = make_creature(block(1, {0, 0, 0}, 6), options);
    const physics::Body& body = creature.scene.body;
    EXPECT_EQ(body.rest, springs.scene.body.rest);
    EXPECT_EQ(body.tets, springs.scene.body.tets);
    ASSERT_EQ(body.elements.size(), 1U);
    EXPECT_EQ(body.elements[0].block.element_count(), hexahedra ? creature.mesh.cells : body.tet_count());
    EXPECT_NEAR(body.mass.sum(), springs.scene.body.mass.sum(), 1e-9);
    EXPECT_NEAR(body.elements[0].block.rest_volume.sum(), body.rest_volume.sum(), 1e-12);
    EXPECT_GT(body.edge_damping.minCoeff(), 0);
    const physics::Body twin = preparation_scene(creature).body;
    EXPECT_TRUE(twin.elements.empty());
    EXPECT_EQ(twin.mass, body.mass);
    EXPECT_EQ(twin.edge_stiffness, springs.scene.body.edge_stiffness);
    EXPECT_EQ(twin.volume_stiffness, springs.scene.body.volume_stiffness);
  }
}

TEST(MakeCreature, BringsAHouseOrACrumbToOneMetreAndSaysSo) {
  for (const double scale : {141.0, 0.003}) {
    SCOPED_TRACE("scale " + std::to_string(scale));
    const Creature creature = make_creature(block(scale, {0.5, 0, 0}, 6), {});
    EXPECT_NEAR(creature.length, 1, 1e-9);
    EXPECT_NEAR(creature.scale * scale, 1, 1e-9);
    ASSERT_EQ(creature.warnings.size(), 1u);
    EXPECT_NE(creature.warnings[0].find("--height"), std::string::npos);
    EXPECT_NEAR(extent(creature.character.skin.vertices, 0), 1, 1e-9);
    EXPECT_NEAR(creature.character.clip.bone_pose.back()[0].translation().x(), 0.5, 1e-9);  // its way as well
  }
}

TEST(MakeCreature, HeightDecides) {
  CreatureOptions options;
  options.height_m = 2;
  const Creature creature = make_creature(block(141, {0, 0, 0}, 6), options);
  EXPECT_NEAR(extent(creature.character.skin.vertices, 1), 2, 1e-9);
  EXPECT_NEAR(creature.length, 5, 1e-9);
  EXPECT_TRUE(creature.warnings.empty());
}

/// A worm along z, or turned to lie along x, that lifts its head and lowers it again, and looks to one side by an angle [rad].
Character nodding_worm(bool is_turned, double aside) {
  Character character = worm();
  const Eigen::AngleAxisd turn(is_turned ? M_PI / 2 : 0, Eigen::Vector3d::UnitY());
  character.skin.vertices = turn.toRotationMatrix() * character.skin.vertices.eval();
  for (Eigen::Affine3d& bone : character.skeleton.bind_pose) bone = turn * bone;
  constexpr std::size_t kNeck = 8;
  const Eigen::Translation3d neck(character.skeleton.bind_pose[kNeck].translation());
  character.clip.rate_hz = character.clip.key_rate_hz = 60;
  character.clip.duration_s = character.clip.range_s = 0.5;
  for (int f = 0; f <= 30; ++f) {
    const Eigen::AngleAxisd nod(0.4 * std::pow(std::sin(M_PI * f / 30), 2), turn * -Eigen::Vector3d::UnitX());
    const Eigen::AngleAxisd look(aside, Eigen::Vector3d::UnitY());
    std::vector<Eigen::Affine3d> pose = character.skeleton.bind_pose;
    for (std::size_t b = kNeck; b < pose.size(); ++b) pose[b] = neck * look * nod * neck.inverse() * pose[b];
    character.clip.bone_pose.push_back(pose);
  }
  return character;
}

TEST(MakeCreature, OfWhatIsItsOwnMirrorImageHasNoMiddleColumnOfCellsWhicheverWayItLies) {
  for (const bool is_turned : {false, true}) {
    CreatureOptions options;
    options.nodes = 300;
    const auto cells_across = [&](double aside) {
      const Creature creature = make_creature(nodding_worm(is_turned, aside), options);
      return creature.mesh.cell_places.row(is_turned ? 2 : 0).maxCoeff() + 1;
    };
    EXPECT_EQ(cells_across(0), 2);
    EXPECT_EQ(cells_across(0.8), 3);
  }
}

TEST(MakeCreature, TellsWhatIsItsOwnMirrorImageAllThroughALoop) {
  const auto is_mirror_image = [](const Character& character) { return make_creature(character, {}).is_mirror_image; };
  EXPECT_TRUE(is_mirror_image(block(1, {0, 0, 0}, 8)));
  EXPECT_TRUE(is_mirror_image(block(1, {0.6, 0, -0.3}, 200)));
  Character turning = block(1, {0, 0, 0}, 100), once = block(1, {0.6, 0, 0}, 100);
  Character lopsided = block(1, {0, 0, 0}, 8), still = block(1, {0, 0, 0}, 8);
  for (std::size_t f = 0; f < 100; ++f) {
    const double share = static_cast<double>(f) / 99.0;
    turning.clip.bone_pose[f][0].rotate(Eigen::AngleAxisd(0.3 * std::sin(2 * M_PI * share), Eigen::Vector3d::UnitY()));
    const double flown = std::clamp((share - 0.3) / 0.4, 0.0, 1.0);
    once.clip.bone_pose[f][0].translation() << 0.6 * flown, 0.3 * std::sin(M_PI * flown), 0;
  }
  EXPECT_FALSE(is_mirror_image(turning));
  EXPECT_FALSE(is_mirror_image(once));
  for (auto vertex : lopsided.skin.vertices.colwise()) {
    const Eigen::Vector3d x = vertex;
    vertex.x() += x.y() * x.z() * x.x();  // a twisted wedge
    vertex.z() += 0.5 * x.y() * x.x();
  }
  EXPECT_FALSE(is_mirror_image(lopsided));
  still.clip.bone_pose.clear();
  EXPECT_FALSE(is_mirror_image(still));
}

TEST(ImportMotion, StandsOnTheGroundWhateverTheClipsHeight) {
  for (const double lift : {-0.7, 0.0, 3.0}) {
    const Creature creature = make_creature(block(1, {0, 0, 0}, 8, lift), {});
    const ImportedMotion motion = import_motion(creature, {});
    EXPECT_NEAR(ground_height(motion.skin_points), 0, 1e-9);
    EXPECT_TRUE(motion.nodes.loop);
    EXPECT_EQ(motion.nodes.count(), 7);  // the last frame repeats the first
  }
}

TEST(ImportMotion, KeepsTheTravelOfNodesAndSkinTogether) {
  const Creature creature = make_creature(block(1, {0.6, 0, -0.3}, 13), {});
  for (const RootMotion mode : {RootMotion::kAuto, RootMotion::kNone}) {
    CreatureOptions options;
    options.root_motion = mode;
    const ImportedMotion motion = import_motion(creature, options);
    const Eigen::Vector3d expected = mode == RootMotion::kNone ? Eigen::Vector3d(0, 0, 0) : Eigen::Vector3d(0.6, 0, -0.3);
    EXPECT_LT((motion.nodes.travel - expected).norm(), 1e-9);
    EXPECT_EQ(motion.nodes.travel, motion.skin_points.travel);
    EXPECT_EQ(motion.root_motion, mode == RootMotion::kNone ? "none" : "clip");
    const Motion carried = point_motion(creature.scene.contact_points, motion.nodes);
    for (Eigen::Index f = 0; f < carried.count(); ++f) {
      EXPECT_LT((carried.at(f) - motion.skin_points.at(f)).colwise().norm().maxCoeff(), 0.01) << "frame " << f;
    }
  }
}

}  // namespace
}  // namespace hydrostat::retarget::creature_test
