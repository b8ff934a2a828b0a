#include "io/creature_scene.h"

#include <gtest/gtest.h>

#include "io/import_worker.h"
#include "io/write_file.h"
#include "tests/io/refusal.h"
#include "tests/io/temporary_directory.h"
#include "tests/retarget/box_performer.h"

namespace hydrostat::io::creature_scene_test {
namespace {

using Eigen::Vector3d;

/// A tetrahedron whose right angle is in its origin.
constexpr const char* kCorner = "v 0 0 0\nv 0.3 0 0\nv 0 0.2 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

class CreatureScenes : public testing::Test {
 protected:
  CreatureScenes() : file(directory.path / "world.toml") {
    set_import_worker_executable(HYDROSTAT_BINARY);
    write_file(directory.path / "corner.obj", kCorner);
    // Away from the origin, so that the places of the world and of the clip are not the same.
    for (Eigen::Index f = 0; f < 12; ++f) plain.prepared.target.at(f).colwise() += kStart;
  }
  retarget::Performer in(const std::string& text) const {
    write_file(file, text);
    retarget::Performer performer = plain;
    put_in_scene(file, performer);
    return performer;
  }
  std::string refused(const std::string& text) const {
    return refusal([&] { in(text); });
  }

  const Vector3d kStart{3, 0, -2};
  TemporaryDirectory directory;
  std::filesystem::path file;
  retarget::Performer plain = retarget::make_box_performer();
};

TEST_F(CreatureScenes, TurnTheWorldAndLeaveTheBodyUprightOnItsGround) {
  for (const double heading : {0.0, 90.0, -135.0}) {
    for (const double slope : {-12.0, 5.0, 30.0}) {
      SCOPED_TRACE("slope " + std::to_string(slope) + " heading " + std::to_string(heading));
      const retarget::Performer performer = in("[ground]\nslope_deg = " + std::to_string(slope) + "\nslope_heading_deg = " +
                                               std::to_string(heading) + "\n");
      const Eigen::Matrix3d turn = performer.world.turn;
      EXPECT_LT((turn * performer.scene.gravity - Vector3d(0, -9.81, 0)).norm(), 1e-12);
      EXPECT_EQ(performer.scene.ground.normal, Vector3d::UnitY());
      const double tilt = slope * M_PI / 180, angle = heading * M_PI / 180;
      const Vector3d ahead(std::cos(angle) * std::cos(tilt), std::sin(tilt), -std::sin(angle) * std::cos(tilt));
      EXPECT_NEAR(ahead.dot(turn * Vector3d::UnitY()), 0, 1e-12);  // the way up lies in the ground
      EXPECT_GT(turn(1, 1), 0);
    }
  }
}

TEST_F(CreatureScenes, CountPlacesFromTheGroundUnderTheStart) {
  const retarget::Performer performer = in(R"(
[ground]
slope_deg = 20
[[obstacle]]
shape = "ball"
size_m = 0.2
position_m = [4.0, 1.5, 0.5]
[[obstacle.move]]
velocity_m_s = [1.0, 0.0, 0.0]
[water]
level_m = -3.0
[[push]]
time_s = 0.5
delta_v_m_s = [0.0, 0.3, 0.0]
)");
  const retarget::World& world = performer.world;
  const Vector3d com = physics::centre_of_mass(performer.scene.body, performer.prepared.target.at(0));
  EXPECT_LT((world.pivot - Vector3d(com.x(), 0, com.z())).norm(), 1e-12);
  EXPECT_EQ(scene_origin(plain), world.pivot);
  EXPECT_EQ(scene_origin(performer), world.pivot);
  const Vector3d place = world.turn * (performer.scene.obstacles[0].place - world.pivot);
  EXPECT_LT((place - Vector3d(4, 1.5, 0.5)).norm(), 1e-12);
  EXPECT_LT((world.turn * world.moves[0].velocity - Vector3d(1, 0, 0)).norm(), 1e-12);
  EXPECT_LT((world.turn * world.pushes[0].delta_v - Vector3d(0, 0.3, 0)).norm(), 1e-12);
  const Vector3d up = -performer.scene.gravity.normalized();
  EXPECT_NEAR(performer.scene.water->level - up.dot(world.pivot), -3, 1e-12);
}

/// What fills half of its cells displaces half as much; nothing is told to a body that nothing flows around.
TEST_F(CreatureScenes, OfWaterOrAirTellTheBodyWhatItDisplaces) {
  EXPECT_EQ(in("[ground]\nslope_deg = 3\n").scene.body.displaced_share.size(), 0);
  physics::Body& body = plain.scene.body;
  for (const double fill : {1.0, 0.5, 0.1}) {
    plain.size = std::cbrt(fill * body.rest_volume.sum());
    body.mass *= 1000 * std::pow(plain.size, 3) / body.mass.sum();
    for (const char* text : {"[water]\n", "[water]\nlevel_m = 0.3\n"}) {
      const physics::Body wet = in(text).scene.body;
      ASSERT_EQ(wet.displaced_share.size(), wet.tet_count());
      EXPECT_LT((wet.displaced_share.array() - fill).abs().maxCoeff(), 1e-9);
      EXPECT_NEAR(1000 * wet.displaced_share.dot(wet.rest_volume), wet.mass.sum(), 1e-9 * wet.mass.sum());
    }
  }
}

TEST_F(CreatureScenes, WithoutGroundLeaveTheCreatureItsOwn) {
  plain.scene.ground.friction = 0.37;
  for (const char* text : {"[air]\nvelocity_m_s = [20.0, 0.0, 0.0]\n", "[ground]\nslope_deg = 3\n"}) {
    const retarget::Performer performer = in(text);
    EXPECT_TRUE(performer.scene.has_ground);
    EXPECT_EQ(performer.scene.ground.friction, 0.37);
  }
  EXPECT_FALSE(in("[effects]\nground = \"off\"\n").scene.has_ground);
  EXPECT_EQ(in("[ground]\nfriction = 0.5\n").scene.ground.friction, 0.5);
}

TEST_F(CreatureScenes, TellOfEveryEffectWhetherItIsOnAndWhy) {
  const retarget::Performer performer = in("[water]\nlevel_m = 0.1\n[effects]\nfriction = \"off\"\n");
  const auto decision = [&](const std::string& name) {
    for (const retarget::EffectDecision& d : performer.world.decisions) {
      if (d.name == name) return d;
    }
    return retarget::EffectDecision{};
  };
  EXPECT_TRUE(decision("water").is_on);
  EXPECT_TRUE(decision("ground").is_on);
  EXPECT_FALSE(decision("friction").is_on);
  EXPECT_EQ(decision("friction").reason, "turned off by the scene");
  EXPECT_FALSE(decision("obstacles").is_on);
}

TEST_F(CreatureScenes, StandAloneInTheCreature) {
  const std::string text = "[[obstacle]]\nshape = \"mesh\"\nfile = \"corner.obj\"\nscale = 2.0\nposition_m = [2.0, 0.0, 0.0]\n[ground]\nslope_deg = 7\n";
  const retarget::Performer before = in(text);
  const std::string own = creature_scene_text(file);
  std::filesystem::remove(directory.path / "corner.obj");
  const retarget::Performer after = in(own);
  EXPECT_NE(own.find("schema = 'hydrostat.creature_scene/1'"), std::string::npos) << own;
  EXPECT_EQ(creature_scene_text(file), own);  // as it lies there
  const auto &mesh = std::get<physics::ClosedMeshOf<3>>(before.scene.obstacles[0].shape),
             &again = std::get<physics::ClosedMeshOf<3>>(after.scene.obstacles[0].shape);
  EXPECT_EQ(mesh.vertices(), again.vertices());
  EXPECT_EQ(mesh.faces(), again.faces());
  EXPECT_EQ(before.scene.obstacles[0].place, after.scene.obstacles[0].place);
  EXPECT_EQ(before.scene.gravity, after.scene.gravity);
}

TEST_F(CreatureScenes, OfTheSamplesAreRead) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(HYDROSTAT_SAMPLES) / "worlds")) {
    SCOPED_TRACE(entry.path().string());
    retarget::Performer performer = plain;
    EXPECT_TRUE(put_in_scene(entry.path(), performer).empty());
    EXPECT_TRUE(performer.world.is_told());
    ++count;
  }
  EXPECT_EQ(count, 2);
}

TEST_F(CreatureScenes, RefuseWhatIsNotOfTheWorldOrCannotBe) {
  const auto expect = [&](const std::string& text, const std::string& where, const std::string& what) {
    const std::string told = refused(text);
    EXPECT_NE(told.find(file.string() + "|" + where + "|"), std::string::npos) << told;
    EXPECT_NE(told.find(what), std::string::npos) << told;
  };
  expect("[body]\nshape = \"cube\"\n", "line 1", "'body' is a body's, and a creature's body comes from its clip");
  expect("\n[[seam]]\nnormal = [1, 0, 0]\n", "line 2", "'seam' is a body's");
  expect("dt_s = 0.01\n", "line 1", "'dt_s' is a simulation's without a clip");
  expect("[grond]\nslope_deg = 5\n", "line 1", "'ground'");
  expect("[ground]\nslope = 5\n", "line 2", "'slope_deg'");
  expect("[ground]\nheight_m = 0.1\n", "line 2", "over the creature's feet");
  expect("[effects]\nwater = \"on\"\n", "line 1", "'water' is asked for, but");
  expect("[effects]\nvolume = \"off\"\n", "line 2", "'volume' is an effect of the body");
  expect("schema = \"hydrostat.creature_scene/2\"\n", "line 1", "schema");
  expect("[[obstacle]]\nshape = \"box\"\nsize_m = 1.0\nposition_m = [0.0, 0.3, 0.0]\n", "line 4", "deep in this obstacle");
}

}  // namespace
}  // namespace hydrostat::io::creature_scene_test
