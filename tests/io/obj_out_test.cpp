#include "io/obj_out.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

#include "io/played_skin.h"
#include "io/write_file.h"
#include "retarget/error.h"
#include "tests/io/moving_creature.h"
#include "tests/io/obj_file.h"
#include "tests/io/refusal.h"
#include "tests/io/temporary_directory.h"

namespace hydrostat::io::obj_out_test {
namespace {

namespace fs = std::filesystem;
using namespace moving_creature;
using namespace obj_file;

constexpr std::array<double, 4> kClay{0.5, 0.25, 0.125, 1};

/// Drawn as each of its sides by itself: vertices are there twice, with the normals of their two sides.
Appearance::Part with_hard_edges(const Creature& creature) {
  Appearance::Part part;
  const Eigen::Index sides = creature.triangles.cols();
  part.vertices = creature.triangles.reshaped();
  part.triangles = Eigen::VectorXi::LinSpaced(3 * sides, 0, static_cast<int>(3 * sides) - 1).reshaped(3, sides);
  part.normals.resize(3, 3 * sides);
  for (Eigen::Index t = 0; t < sides; ++t) {
    const Eigen::Matrix3d corners = creature.vertices(Eigen::all, creature.triangles.col(t));
    part.normals.middleCols<3>(3 * t).colwise() =
        (corners.col(1) - corners.col(0)).cross(corners.col(2) - corners.col(0)).normalized();
  }
  return part;
}

Appearance::Part smooth(const Creature& creature) {
  return parts_of({creature.vertices, creature.triangles, creature.embedding}).front();
}

Eigen::Vector3d side_normal(const Creature& creature, const Eigen::Matrix3Xd& positions, std::size_t triangle) {
  const Eigen::Matrix3d corners = positions(Eigen::all, creature.triangles.col(static_cast<Eigen::Index>(triangle)));
  return (corners.col(1) - corners.col(0)).cross(corners.col(2) - corners.col(0)).normalized();
}

TEST(ObjSkin, HasTheDrawnVerticesInTheirOrderAndTheTrianglesOfEachPart) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Creature creature = random_creature(seed, 12, 30, 2);
    Appearance::Part part = smooth(creature), other = part;
    std::mt19937 random(seed);
    std::vector<Eigen::Index> firsts, rest;
    for (Eigen::Index t = 0; t < part.triangles.cols(); ++t) {
      if (random() % 3 > 0) (random() % 2 == 0 ? firsts : rest).push_back(t);  // some vertices lie in no triangle
    }
    other.triangles = part.triangles(Eigen::all, rest).eval();
    part.triangles = part.triangles(Eigen::all, firsts).eval();
    part.material = 0;
    Material material;
    material.name = "skin";
    const ObjSkin skin({part, other}, {material}, creature.vertices, "creature", kClay);
    const ObjFile file = parse_obj(skin.text(creature.vertices, Eigen::Quaterniond::Identity(), "a.mtl"));
    EXPECT_EQ(file.material_file, "a.mtl");
    ASSERT_EQ(static_cast<Eigen::Index>(file.vertices.size()), skin.vertices().size());
    for (std::size_t v = 0; v < file.vertices.size(); ++v) {
      const int vertex = skin.vertices()[static_cast<Eigen::Index>(v)];
      EXPECT_EQ(file.vertices[v], creature.vertices.col(vertex).cast<float>());
      EXPECT_TRUE(v == 0 || vertex > skin.vertices()[static_cast<Eigen::Index>(v) - 1]);
    }
    ASSERT_EQ(file.groups.size(), 2u);
    std::set<int> drawn;
    for (std::size_t p = 0; p < 2; ++p) {
      const Eigen::Matrix3Xi& triangles = p == 0 ? part.triangles : other.triangles;
      EXPECT_EQ(file.groups[p].material, p == 0 ? "skin" : "creature");
      EXPECT_TRUE(file.groups[p].is_smooth);
      ASSERT_EQ(static_cast<Eigen::Index>(file.groups[p].faces.size()), triangles.cols());
      for (std::size_t t = 0; t < file.groups[p].faces.size(); ++t) {
        for (std::size_t k = 0; k < 3; ++k) {
          const int vertex = skin.vertices()[file.groups[p].faces[t][k].vertex];
          EXPECT_EQ(vertex, triangles(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(t)));
          drawn.insert(vertex);
        }
      }
    }
    EXPECT_EQ(drawn.size(), file.vertices.size()) << "readers leave out what no face holds";
  }
}

TEST(ObjSkin, NormalsAreThoseOfTheBentSurface) {
  const Creature creature = bar({0});
  const ObjSkin skin({smooth(creature)}, {}, creature.vertices, "creature", kClay);
  for (unsigned seed = 0; seed < 10; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    std::uniform_real_distribution<> uniform(-1, 1);
    const Eigen::Vector3d axis = Eigen::Vector3d::NullaryExpr([&] { return uniform(random); }).normalized();
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(3 * uniform(random), axis));
    const Eigen::Matrix3Xd bent = turn.toRotationMatrix() * bent_bar(2 * uniform(random));
    const ObjFile file = parse_obj(skin.text(bent, turn, "a.mtl"));
    const Eigen::Matrix3Xd real = surface_normals(bent, creature.triangles);
    for (const auto& face : file.faces()) {
      for (const ObjFile::Corner& corner : face) {
        const Eigen::Vector3f normal = file.normals.at(static_cast<std::size_t>(corner.normal));
        EXPECT_NEAR(normal.norm(), 1, 1e-6);
        EXPECT_LT((normal.cast<double>() - real.col(corner.vertex)).norm(), 1e-6);
      }
    }
  }
}

TEST(ObjSkin, NormalsThatAreNotTheSurfacesTurnWithTheBody) {
  const Creature creature = bar({0});
  Appearance::Part part = smooth(creature);
  for (unsigned seed = 0; seed < 10; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    std::uniform_real_distribution<> uniform(-1, 1);
    part.normals += Eigen::Matrix3Xd::NullaryExpr(3, part.normals.cols(), [&] { return 0.5 * uniform(random); });
    part.normals.colwise().normalize();
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(3 * uniform(random), Eigen::Vector3d(0.6, 0, 0.8)));
    const ObjSkin skin({part}, {}, creature.vertices, "creature", kClay);
    const ObjFile file = parse_obj(skin.text(turn.toRotationMatrix() * creature.vertices, turn, "a.mtl"));
    for (const auto& face : file.faces()) {
      for (const ObjFile::Corner& corner : face) {
        const Eigen::Vector3d normal = file.normals.at(static_cast<std::size_t>(corner.normal)).cast<double>();
        EXPECT_LT((normal - turn * Eigen::Vector3d(part.normals.col(corner.vertex))).norm(), 1e-6);
      }
    }
  }
}

TEST(ObjSkin, HardEdgesStayHardWhereTheBodyBends) {
  const Creature creature = bar({0});
  const ObjSkin skin({with_hard_edges(creature)}, {}, creature.vertices, "creature", kClay);
  EXPECT_EQ(skin.vertices().size(), creature.vertices.cols()) << "vertices of one place are one";
  for (const double bend : {0.0, 0.5, -1.5}) {
    SCOPED_TRACE(bend);
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(1, Eigen::Vector3d::UnitY()));
    const Eigen::Matrix3Xd bent = turn.toRotationMatrix() * bent_bar(bend);
    const ObjFile file = parse_obj(skin.text(bent, turn, "a.mtl"));
    const auto faces = file.faces();
    for (std::size_t t = 0; t < faces.size(); ++t) {
      for (const ObjFile::Corner& corner : faces[t]) {
        const Eigen::Vector3d normal = file.normals.at(static_cast<std::size_t>(corner.normal)).cast<double>();
        EXPECT_NEAR(normal.norm(), 1, 1e-6);
        EXPECT_GT(normal.dot(side_normal(creature, bent, t)), std::cos(2.0 / 3 * std::abs(bend) / 8 + 1e-3))
            << "two of three triangles";
      }
    }
  }
}

TEST(ObjSkin, FlatPartsHaveTheNormalsOfTheirTriangles) {
  const Creature creature = bar({0});
  Appearance::Part flat = smooth(creature);
  flat.normals.resize(3, 0);
  const ObjSkin skin({smooth(creature), flat}, {}, creature.vertices, "creature", kClay);
  const Eigen::Matrix3Xd bent = bent_bar(1);
  const ObjFile file = parse_obj(skin.text(bent, Eigen::Quaterniond::Identity(), "a.mtl"));
  ASSERT_EQ(file.groups.size(), 2u);
  EXPECT_FALSE(file.groups[1].is_smooth);
  for (std::size_t t = 0; t < file.groups[1].faces.size(); ++t) {
    for (const ObjFile::Corner& corner : file.groups[1].faces[t]) {
      const Eigen::Vector3d normal = file.normals.at(static_cast<std::size_t>(corner.normal)).cast<double>();
      EXPECT_LT((normal - side_normal(creature, bent, t)).norm(), 1e-6);
    }
  }
}

TEST(ObjSkin, PlacesInImagesCountUpward) {
  const Creature creature = bar({0});
  Appearance::Part plain = smooth(creature), part = plain;
  const Eigen::Index count = part.vertices.size();
  part.uvs = {Eigen::Matrix2Xd::Random(2, count), Eigen::Matrix2Xd::Random(2, count)};
  part.material = 0;
  std::vector<Material> materials(1);
  for (const int set : {0, 1}) {
    materials[0].base_colour_map.uv_set = set;
    const ObjSkin skin({plain, part, part}, materials, creature.vertices, "creature", kClay);
    const ObjFile file = parse_obj(skin.text(creature.vertices, Eigen::Quaterniond::Identity(), "a.mtl"));
    EXPECT_EQ(file.groups[0].faces[0][0].place, -1);
    const Eigen::Matrix2Xd& places = part.uvs[static_cast<std::size_t>(set)];
    for (const std::size_t p : {1, 2}) {
      for (const auto& face : file.groups[p].faces) {
        for (const ObjFile::Corner& corner : face) {
          const Eigen::Vector2d told = places.col(corner.vertex);  // drawn vertices are the skin's here
          const Eigen::Vector2f place = file.places.at(static_cast<std::size_t>(corner.place));
          EXPECT_EQ(place, Eigen::Vector2f(static_cast<float>(told.x()), static_cast<float>(1 - told.y())));
        }
      }
    }
  }
}

TEST(ObjSkin, MaterialsHaveNamesOfTheirOwnColourAndOpacity) {
  const Creature creature = bar({0});
  std::vector<Material> materials(3);
  materials[0].name = "old bone";
  materials[0].base_colour = {1, 0.5, 0.25, 0.5};
  materials[1].name = "old\nbone";
  materials[1].base_colour = {0, 0, 0, 0.5};
  materials[1].alpha_mode = AlphaMode::kBlend;
  std::vector<Appearance::Part> parts(5, smooth(creature));
  const int of_parts[] = {1, 0, -1, 1, 2};
  for (std::size_t p = 0; p < parts.size(); ++p) parts[p].material = of_parts[p];
  const ObjSkin skin(parts, materials, creature.vertices, "creature", kClay);
  EXPECT_EQ(skin.material_text(),
            "newmtl old_bone\nKd 0 0 0\nd 0.5\nnewmtl old_bone_2\nKd 1 0.5 0.25\nd 1\n"
            "newmtl creature\nKd 0.5 0.25 0.125\nd 1\nnewmtl material\nKd 1 1 1\nd 1\n");
  const ObjFile file = parse_obj(skin.text(creature.vertices, Eigen::Quaterniond::Identity(), "a.mtl"));
  ASSERT_EQ(file.groups.size(), 5u);
  const char* names[] = {"old_bone", "old_bone_2", "creature", "old_bone", "material"};
  for (std::size_t p = 0; p < 5; ++p) EXPECT_EQ(file.groups[p].material, names[p]);
}

TEST(WriteObjFrames, PutsAFileAFrameInThePlaceOfTheOldOnes) {
  const TemporaryDirectory directory;
  const fs::path place = directory.path / "walk_obj";
  const auto text_at = [](Eigen::Index f) { return "# frame " + std::to_string(f); };
  write_obj_frames(place, "walk", 12, text_at, "newmtl a");
  write_obj_frames(place, "walk", 2, text_at, "newmtl b");
  EXPECT_EQ(read_file(place / "walk_0001.obj"), "# frame 0");
  EXPECT_EQ(read_file(place / "walk_0002.obj"), "# frame 1");
  EXPECT_EQ(read_file(place / "walk.mtl"), "newmtl b");
  EXPECT_EQ(std::distance(fs::directory_iterator(place), fs::directory_iterator()), 3);
  EXPECT_EQ(directory.count(), 1u) << "parts are left";
  refuse_obj_frames(place, "walk");
}

TEST(WriteObjFrames, RefusesWhatStandsThereAndWhatCannotBeWritten) {
  const TemporaryDirectory directory;
  const fs::path place = directory.path / "walk_obj";
  for (const char* frame : {"walk.mtl", "walk_0001.obj", "walk_12345.obj"}) write_file(place / frame, "v 1 2 3");
  refuse_obj_frames(place, "walk");
  for (const char* mine : {"mine.obj", "walk_001.obj", "walk_0001.obj.bak", "walk_final.obj"}) {
    write_file(place / mine, "v 1 2 3");
    EXPECT_NE(refusal([&] { refuse_obj_frames(place, "walk"); }).find(std::string("walk_obj|--export obj|holds '") + mine), std::string::npos)
        << mine;
    fs::remove(place / mine);
  }
  write_file(place / "mine.obj", "v 1 2 3");
  EXPECT_NE(refusal([&] { refuse_obj_frames(place / "mine.obj", "walk"); }).find("is a file where a directory"),
            std::string::npos);
  const auto text_at = [](Eigen::Index) { return std::string("v 1 2 3"); };
  EXPECT_EQ(
      refusal([&] { write_obj_frames("/proc/absent/walk_obj", "walk", 1, text_at, ""); }).find("/proc/absent/walk_obj"), 0u);
}

}  // namespace
}  // namespace hydrostat::io::obj_out_test
