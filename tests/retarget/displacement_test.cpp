#include "retarget/displacement.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "physics/fluid.h"
#include "retarget/creature.h"
#include "tests/retarget/shapes.h"

namespace hydrostat::retarget::displacement_test {
namespace {

/// A creature of one bone that stands still.
Creature creature_of(const SkinnedMesh& skin, BodyMaterial material, bool hexahedra) {
  Character character;
  character.skeleton = one_bone();
  character.skin = skin;
  character.clip.rate_hz = character.clip.key_rate_hz = 60;
  character.clip.duration_s = character.clip.range_s = 0.1;
  character.clip.bone_pose.assign(7, {Eigen::Affine3d::Identity()});
  CreatureOptions options;
  options.material = material;
  options.hexahedra = hexahedra;
  options.nodes = 100;
  return make_creature(character, options);
}

/// A ball, a float, a block and a ball with a tail, of each material: their cells are full, half full and nearly empty.
const std::vector<Creature>& creatures() {
  static const std::vector<Creature> all = [] {
    std::vector<Creature> made;
    for (const SkinnedMesh& skin : {ball_skin({0.5, 0.3, 0.4}), ball_skin({0.5, 0.04, 0.4}), box_skin({0, 0, 0}, {1, 0.4, 0.5}, 0, 8),
                                    joined(ball_skin({0.3, 0.3, 0.3}), box_skin({0.1, -0.02, -0.02}, {1.4, 0.02, 0.02}, 0, 12))}) {
      for (const auto& [material, hexahedra] : {std::pair{BodyMaterial::kSprings, false}, std::pair{BodyMaterial::kStableNeoHookean, false},
                                                std::pair{BodyMaterial::kCorotatedLinear, true}}) {
        made.push_back(creature_of(skin, material, hexahedra));
        fit_displacement(skin, std::pow(made.back().size, 3), made.back().scene.body);
      }
    }
    return made;
  }();
  return all;
}

TEST(FitDisplacement, FindsTheShareOfEachCellThatIsMatter) {
  for (const Creature& creature : creatures()) {
    ASSERT_EQ(creature.scene.body.displaced_share.size(), creature.mesh.tet_fill.size());
    EXPECT_LT((creature.scene.body.displaced_share - creature.mesh.tet_fill).cwiseAbs().maxCoeff(), 1e-9);
  }
}

/// Of a body as dense as water, at any height: it hovers, and water does not turn it.
TEST(FitDisplacement, LetsWaterBearWhatIsAsDense) {
  for (const Creature& creature : creatures()) {
    const physics::Scene& scene = creature.scene;
    for (const double height : {-10.0, 0.0, 10.0}) {
      const physics::State state{scene.body.rest.colwise() + Eigen::Vector3d(0, height, 0), Eigen::Matrix3Xd::Zero(3, scene.body.node_count())};
      Eigen::Matrix3Xd force = scene.gravity * scene.body.mass.transpose();
      const double weight = force.norm();
      physics::FluidEffect<3>(scene, {}).add_forces(0.01, state, force);
      EXPECT_LT(force.rowwise().sum().norm(), 1e-6 * weight);
      const Eigen::Vector3d middle = physics::centre_of_mass(scene.body, state.x);
      Eigen::Vector3d moment = Eigen::Vector3d::Zero();
      for (int i = 0; i < scene.body.node_count(); ++i) moment += (state.x.col(i) - middle).cross(Eigen::Vector3d(force.col(i)));
      // Lumped to its corners a cell's mass lies off its middle, on one side or the other in turn.
      EXPECT_LT(moment.norm(), 1e-3 * weight * creature.length);
    }
  }
}

/// The cells' surface is larger than the skin's, which resistance goes by.
TEST(FitDisplacement, WetsAsMuchAsTheSkinHas) {
  const auto wetted = [](const SkinnedMesh& skin) {
    Creature creature = creature_of(skin, BodyMaterial::kSprings, false);
    physics::Body& body = creature.scene.body;
    fit_displacement(skin, std::pow(creature.size, 3), body);
    EXPECT_LE(body.wetted_share, 1);
    double of_cells = 0;
    for (const physics::SurfaceFace& face : physics::surface_faces(body)) {
      const Eigen::Vector3i n = physics::nodes_of_face(body, face);
      const Eigen::Vector3d a = body.rest.col(n[0]);
      of_cells += 0.5 * Eigen::Vector3d(body.rest.col(n[1]) - a).cross(Eigen::Vector3d(body.rest.col(n[2]) - a)).norm();
    }
    return body.wetted_share * of_cells;
  };
  for (const double radius : {0.2, 0.4, 3.0}) EXPECT_NEAR(wetted(ball_skin({radius, radius, radius})) / (4 * M_PI * radius * radius), 1, 0.03);
  EXPECT_NEAR(wetted(box_skin({0, 0, 0}, {1, 0.4, 0.5}, 0, 8)), 2.2, 0.05);
}

TEST(FitDisplacement, LeavesABodyThatTellsOfNoFill) {
  Creature creature = creature_of(ball_skin({0.5, 0.3, 0.4}), BodyMaterial::kSprings, false);
  creature.scene.body.volume_stiffness.resize(0);
  fit_displacement(creature.character.skin, 1, creature.scene.body);
  EXPECT_EQ(creature.scene.body.displaced_share.size(), 0);
  EXPECT_EQ(creature.scene.body.wetted_share, 1);
}

}  // namespace
}  // namespace hydrostat::retarget::displacement_test
