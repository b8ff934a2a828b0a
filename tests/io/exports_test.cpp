#include "io/exports.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "io/gltf_out.h"
#include "io/write_file.h"
#include "tests/io/moving_creature.h"
#include "tests/io/obj_file.h"
#include "tests/io/played_glb.h"
#include "tests/io/point_cache_file.h"
#include "tests/io/refusal.h"
#include "tests/io/temporary_directory.h"

namespace hydrostat::io::exports_test {
namespace {

namespace fs = std::filesystem;
using namespace moving_creature;

constexpr Exports kAll{true, true, true, 60};

/// What is written of a creature, in walk.glb and beside it.
struct Written {
  TemporaryDirectory directory;
  fs::path glb = directory.path / "walk.glb";

  Written(const Creature& creature, const Exports& exports, const retarget::MovingMorphs* morphs = nullptr) {
    const EmbeddedSkin skin{creature.vertices, creature.triangles, creature.embedding, nullptr, morphs};
    write_skinned_glb(glb, skin, creature.body, creature.mass, creature.motion, {});
    write_exports(glb, skin, creature.body, creature.mass, creature.motion, exports);
  }
  point_cache_file::PointCache pc2() const { return point_cache_file::parse_pc2(read_file(directory.path / "walk.pc2")); }
  point_cache_file::PointCache mdd() const { return point_cache_file::parse_mdd(read_file(directory.path / "walk.mdd")); }
  obj_file::ObjFile obj() const { return obj_file::parse_obj(read_file(directory.path / "walk.obj")); }
  obj_file::ObjFile frame(const std::string& number) const {
    return obj_file::parse_obj(read_file(directory.path / "walk_obj" / ("walk_" + number + ".obj")));
  }
};

/// Every frame of the cache is what an engine shows of the .glb file then; all of the skin's vertices are drawn.
void expect_as_played(const Written& written, double rate_hz) {
  const tinygltf::Model model = played_glb::load(written.glb);
  const point_cache_file::PointCache cache = written.pc2();
  ASSERT_GT(cache.frames.size(), 1u);
  for (std::size_t f = 0; f < cache.frames.size(); ++f) {
    const Eigen::Matrix3Xd shown = played_glb::play_at(model, static_cast<double>(f) / rate_hz);
    ASSERT_EQ(cache.frames[f].cols(), shown.cols());
    EXPECT_LT((cache.frames[f].cast<double>() - shown).cwiseAbs().maxCoeff(), 4e-6) << "frame " << f;  // [m]: float32
  }
}

TEST(WriteExports, HoldTheEmbeddedSkinAndBetweenFramesWhatLiesStraightBetween) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Creature creature = random_creature(seed, /*nodes=*/20, /*vertices=*/60, /*frames=*/8);  // at 30 Hz
    const Written written(creature, kAll);
    const point_cache_file::PointCache pc2 = written.pc2(), mdd = written.mdd();
    ASSERT_EQ(pc2.frames.size(), 15u);
    EXPECT_EQ(mdd.frames, pc2.frames);
    for (Eigen::Index f = 0; f < 15; ++f) {
      const Eigen::Index before = f / 2, after = (f + 1) / 2;
      const Eigen::Matrix3Xd nodes = 0.5 * (creature.motion.at(before) + creature.motion.at(after));
      const auto frame = static_cast<std::size_t>(f);
      EXPECT_LT((pc2.frames[frame].cast<double>() - embedded(creature, nodes)).cwiseAbs().maxCoeff(), 2e-7);  // [m]
      EXPECT_FLOAT_EQ(mdd.times_s[frame], static_cast<float>(f) / 60);
    }
    expect_as_played(written, 60);
  }
}

TEST(WriteExports, LastAsLongAsTheMotionAtAnyRate) {
  Creature creature = random_creature(1, 12, 20, 8);  // 7/30 s
  for (const auto& [rate_hz, frames] :
       std::map<double, std::size_t>{{1, 1}, {24, 6}, {30, 8}, {60, 15}, {90, 22}, {240, 57}}) {
    SCOPED_TRACE(rate_hz);
    const Written written(creature, {true, true, false, rate_hz});
    EXPECT_EQ(written.pc2().frames.size(), frames);
    EXPECT_EQ(written.mdd().frames.size(), frames);
    if (frames > 1) expect_as_played(written, rate_hz);
  }
  creature.motion.loop = true;  // 8/30 s, and ends where its next period begins
  const Written written(creature, {true, false, false, 30});
  EXPECT_EQ(written.pc2().frames.size(), 9u);
  expect_as_played(written, 30);
}

TEST(WriteExports, KeepWhatTheEmbeddingMissesAndTurnItWithTheBody) {
  Creature creature = random_creature(2, 20, 40, 6);
  creature.vertices += 0.1 * Eigen::Matrix3Xd::Random(3, 40);
  expect_as_played(Written(creature, kAll), 60);
}

TEST(WriteExports, WearMorphTargets) {
  const Face face({0, 0.5, 1, 1.5, 2, 1, -0.5, -1.5});
  const Written written(face.creature, kAll, &face.morphs);
  expect_as_played(written, 60);
  const Written bare(face.creature, kAll);
  EXPECT_GT((written.pc2().frames[0] - bare.pc2().frames[0]).cwiseAbs().maxCoeff(), 1e-3) << "the test tests nothing";
}

TEST(WriteExports, CachesLieOnTheBindPoseAndFramesAreThoseOfTheCaches) {
  Creature creature = bar({0.2, 0.5, 1, 1.5});
  const Eigen::Index count = creature.vertices.cols();
  // Two more vertices that no triangle draws, first and last.
  const auto with_loose_ends = [count](const auto& columns) {
    auto more = columns.leftCols(1).replicate(1, count + 2).eval();
    more.middleCols(1, count) = columns;
    return more;
  };
  creature.vertices = with_loose_ends(creature.vertices);
  creature.embedding.nodes = with_loose_ends(creature.embedding.nodes);
  creature.embedding.weights = with_loose_ends(creature.embedding.weights);
  creature.triangles.array() += 1;
  const Written written(creature, {true, false, true, 30});
  const obj_file::ObjFile bind = written.obj();
  EXPECT_EQ(bind.material_file, "walk.mtl");
  EXPECT_EQ(read_file(written.directory.path / "walk.mtl"), read_file(written.directory.path / "walk_obj" / "walk.mtl"));
  ASSERT_EQ(static_cast<Eigen::Index>(bind.vertices.size()), count);
  for (Eigen::Index v = 0; v < count; ++v)
    EXPECT_EQ(bind.vertices[static_cast<std::size_t>(v)], creature.vertices.col(v + 1).cast<float>());
  const point_cache_file::PointCache cache = written.pc2();
  for (std::size_t f = 0; f < 4; ++f) {
    const obj_file::ObjFile frame = written.frame("000" + std::to_string(f + 1));
    ASSERT_EQ(static_cast<Eigen::Index>(frame.vertices.size()), cache.frames[f].cols());
    for (Eigen::Index v = 0; v < count; ++v)
      EXPECT_EQ(frame.vertices[static_cast<std::size_t>(v)], cache.frames[f].col(v)) << "frame " << f;
    const Eigen::Matrix3Xd real =
        surface_normals(creature.motion.at(static_cast<Eigen::Index>(f)), creature.triangles.array() - 1);
    for (const auto& face : frame.faces()) {
      for (const auto& corner : face) {
        const Eigen::Vector3d normal = frame.normals.at(static_cast<std::size_t>(corner.normal)).cast<double>();
        EXPECT_LT((normal - real.col(corner.vertex)).norm(), 1e-6);
      }
    }
  }
}

TEST(WriteExports, WriteWhatIsAskedForAloneAndTheSameBytesAgain) {
  const Creature creature = random_creature(3, 12, 20, 4);
  const auto names = [&](const Exports& exports) {
    const Written written(creature, exports);
    std::set<std::string> all;
    for (const auto& entry : fs::directory_iterator(written.directory.path)) all.insert(entry.path().filename().string());
    return all;
  };
  using Names = std::set<std::string>;
  EXPECT_EQ(names({}), Names{"walk.glb"});
  EXPECT_EQ(names({.pc2 = true}), (Names{"walk.glb", "walk.pc2", "walk.obj", "walk.mtl"}));
  EXPECT_EQ(names({.mdd = true}), (Names{"walk.glb", "walk.mdd", "walk.obj", "walk.mtl"}));
  EXPECT_EQ(names({.obj = true}), (Names{"walk.glb", "walk_obj"}));
  const Written once(creature, kAll), again(creature, kAll);
  for (const std::string& name : export_names("walk")) {
    if (name == "walk_obj") continue;
    EXPECT_EQ(read_file(once.directory.path / name), read_file(again.directory.path / name)) << name;
  }
  EXPECT_EQ(read_file(once.directory.path / "walk_obj" / "walk_0003.obj"),
            read_file(again.directory.path / "walk_obj" / "walk_0003.obj"));
}

TEST(RefuseExports, BeforeTheWorkWhatCannotBeWritten) {
  const TemporaryDirectory directory;
  const fs::path glb = directory.path / "walk.glb";
  refuse_exports(glb, kAll);
  EXPECT_EQ(directory.count(), 0u);
  fs::create_directory(directory.path / "walk.mtl");
  EXPECT_NE(refusal([&] { refuse_exports(glb, {.mdd = true}); }).find("walk.mtl||cannot be written: Is a directory"),
            std::string::npos);
  refuse_exports(glb, {.obj = true});
  write_file(directory.path / "walk_obj", "");
  EXPECT_NE(refusal([&] { refuse_exports(glb, {.obj = true}); }).find("walk_obj|--export obj|is a file"), std::string::npos);
}

TEST(ExportWords, ComeBackAsTheyWereTold) {
  for (const Exports& exports : {kAll, Exports{.pc2 = true}, Exports{.mdd = true, .obj = true}})
    EXPECT_EQ(exports_named(export_words(exports)), exports);
  for (const char* words : {"", "glb", "obj,pc2", "pc2,pc2", "pc2,", ",pc2", "PC2"})
    EXPECT_FALSE(exports_named(words)) << words;
}

}  // namespace
}  // namespace hydrostat::io::exports_test
