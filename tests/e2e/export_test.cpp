#include <gtest/gtest.h>

#include "tests/e2e/made_creature.h"
#include "tests/io/obj_file.h"
#include "tests/io/played_glb.h"
#include "tests/io/point_cache_file.h"

namespace hydrostat::export_test {
namespace {

namespace fs = std::filesystem;
using io::obj_file::ObjFile;

const std::set<std::string> kExports{"replay.pc2", "replay.mdd", "replay.obj", "replay.mtl", "replay_obj"};

/// By any name: those of failed.glb would be failed.pc2.
std::set<std::string> exports_in(const fs::path& directory) {
  std::set<std::string> found;
  for (const std::string& name : names_in(directory)) {
    const bool is_cache = name.ends_with(".pc2") || name.ends_with(".mdd");
    if (is_cache || name.ends_with(".obj") || name.ends_with(".mtl") || name.ends_with("_obj")) found.insert(name);
  }
  return found;
}

/// Every corner of every triangle is where an engine shows it at that time; `cache` has a frame each 1/rate_hz.
void expect_plays_as(const tinygltf::Model& model, const ObjFile& bind, const std::vector<Eigen::Matrix3Xf>& cache,
                     double rate_hz) {
  const auto& primitives = model.meshes.at(0).primitives;
  ASSERT_EQ(bind.groups.size(), primitives.size());
  ASSERT_GT(cache.size(), 1u);
  for (const std::size_t f : {std::size_t{0}, cache.size() / 3, cache.size() / 2 + 1, cache.size() - 1}) {
    double farthest = 0;
    for (std::size_t p = 0; p < primitives.size(); ++p) {
      const Eigen::Matrix3Xd shown = io::played_glb::play_at(model, static_cast<double>(f) / rate_hz, p);
      const auto corners = io::played_glb::values<unsigned>(model, primitives[p].indices);
      ASSERT_EQ(corners.size(), 3 * bind.groups[p].faces.size());
      for (std::size_t c = 0; c < corners.size(); ++c) {
        const Eigen::Index vertex = bind.groups[p].faces[c / 3][c % 3].vertex;
        const Eigen::Vector3d away = cache[f].col(vertex).cast<double>() - shown.col(static_cast<Eigen::Index>(corners[c]));
        farthest = std::max(farthest, away.norm());
      }
    }
    EXPECT_LT(farthest, 5e-6) << "frame " << f;  // [m]: float32 some metres from the origin
  }
}

TEST(Export, GoesWithReplayGlbThroughReplaysAndFalls) {
  const TemporaryDirectory directory;
  const fs::path creature = directory.path / "creature";
  ASSERT_EQ(convert(directory.path, kSmallClip, "creature",
                    std::string(kSmallOptions) + "--export pc2 --export mdd,obj --export-rate 50")
                .exit_code,
            0);
  const auto pc2 = [&](const fs::path& file) { return io::point_cache_file::parse_pc2(io::read_file(file)).frames; };
  const auto expect_exports = [&](double rate_hz, double duration_s) {
    SCOPED_TRACE(rate_hz);
    const ObjFile bind = io::obj_file::parse_obj(io::read_file(creature / "replay.obj"));
    const std::vector<Eigen::Matrix3Xf> cache = pc2(creature / "replay.pc2");
    EXPECT_EQ(cache.size(), static_cast<std::size_t>(duration_s * rate_hz + 1e-6) + 1);
    ASSERT_EQ(cache[0].cols(), static_cast<Eigen::Index>(bind.vertices.size()));
    expect_plays_as(io::played_glb::load(creature / "replay.glb"), bind, cache, rate_hz);
  };
  const auto replay = [&](const std::string& options) {
    return hydrostat_in(directory.path, "replay creature --quiet " + options).exit_code;
  };

  EXPECT_EQ(exports_in(creature), kExports);
  const double whole_s = report_of(creature)["replay"]["closed_loop"]["duration_s"];
  expect_exports(50, whole_s);
  const std::vector<Eigen::Matrix3Xf> cache = pc2(creature / "replay.pc2");
  EXPECT_EQ(io::point_cache_file::parse_mdd(io::read_file(creature / "replay.mdd")).frames, cache);
  EXPECT_EQ(names_in(creature / "replay_obj").size(), cache.size() + 1);
  const ObjFile third = io::obj_file::parse_obj(io::read_file(creature / "replay_obj" / "replay_0003.obj"));
  for (std::size_t v = 0; v < third.vertices.size(); ++v)
    ASSERT_EQ(third.vertices[v], cache[2].col(static_cast<Eigen::Index>(v)));

  EXPECT_EQ(replay("--duration 0.5"), 0);  // renews them
  EXPECT_EQ(exports_in(creature), kExports);
  expect_exports(50, 0.5);
  EXPECT_EQ(names_in(creature / "replay_obj").size(), 26u + 1);

  EXPECT_EQ(replay("--duration 0.5 --export pc2 --export-rate 24"), 0);  // and other ones in their place
  const std::set<std::string> of_pc2{"replay.pc2", "replay.obj", "replay.mtl"};
  EXPECT_EQ(exports_in(creature), of_pc2);
  expect_exports(24, 0.5);
  EXPECT_EQ(replay("--push t=0.3,dv=20:0:0"), 3);
  EXPECT_EQ(exports_in(creature), std::set<std::string>());
  EXPECT_EQ(replay("--duration 0.5"), 0);
  EXPECT_EQ(exports_in(creature), of_pc2);
  expect_exports(24, 0.5);

  const std::set<std::string> before = names_in(creature);
  EXPECT_EQ(replay("--duration 0.5 -o walk.glb --export obj"), 0);  // at the creature's rate
  EXPECT_EQ(names_in(creature), before);
  EXPECT_EQ(names_in(directory.path), (std::set<std::string>{"creature", "walk.glb", "walk_obj"}));
  EXPECT_EQ(names_in(directory.path / "walk_obj").size(), 13u + 1);
  EXPECT_EQ(replay("-o fall.glb --export pc2 --push t=0.3,dv=20:0:0"), 3);
  EXPECT_EQ(exports_in(directory.path), std::set<std::string>{"walk_obj"});
  EXPECT_EQ(replay("-o walk.glb --export-rate 30"), 2);

  EXPECT_EQ(replay("--duration 0.5 --export glb"), 0);
  EXPECT_EQ(exports_in(creature), std::set<std::string>());
  EXPECT_EQ(io::read_file(creature / "creature.toml").find("export"), std::string::npos);
  EXPECT_EQ(replay("--export-rate 30"), 2);
}

}  // namespace
}  // namespace hydrostat::export_test
