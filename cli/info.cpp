#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "cli/subcommands.h"
#include "io/import.h"

namespace hydrostat::cli {
namespace {

struct InfoOptions {
  std::string clip_file;
  bool json = false;
};

const char* yes(bool value) { return value ? "yes" : "no"; }

void print(const io::FileInfo& info) {
  std::printf("%s: %s, %g m per unit, %s up\n", info.file.c_str(), info.format.c_str(), info.metres_per_unit,
              info.up.c_str());
  std::size_t weighted = 0;
  for (const io::BoneInfo& bone : info.bones) weighted += bone.weighted ? 1 : 0;
  std::printf("%zu bones, %zu of them move skin\n", info.bones.size(), weighted);
  for (const io::MeshInfo& mesh : info.meshes) {
    std::printf("mesh '%s': %d vertices, %d triangles%s\n", mesh.name.c_str(), mesh.vertices, mesh.triangles,
                mesh.skinned ? "" : ", not bound to bones");
  }
  for (const io::ClipInfo& clip : info.clips) {
    const Eigen::Vector3d size = clip.bbox.front().max - clip.bbox.front().min;
    std::printf(
        "clip %d '%s': %.3f s (%.3f s of keys at %.4g Hz), loop %s, in place %s, %.3g m/s, starts %.4g x %.4g x %.4g m\n",
        clip.index, clip.name.c_str(), clip.duration_s, clip.range_s, clip.rate_hz, yes(clip.loop), yes(clip.in_place),
        clip.speed_m_s, size.x(), size.y(), size.z());
  }
  for (const std::string& warning : info.warnings) std::printf("warning: %s\n", warning.c_str());
}

}  // namespace

void add_info(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<InfoOptions>();
  CLI::App* info =
      app.add_subcommand("info", "What the importer sees in a clip file: bones, meshes, clips, units, warnings");
  info->add_option("CLIP", options->clip_file, "FBX, glTF, Collada or BVH file")->required();
  info->add_flag("--json", options->json, "Schema hydrostat.info/1 instead of text");
  info->callback([options, &exit_code] {
    const io::FileInfo found = io::inspect(options->clip_file);
    if (options->json) {
      std::puts(io::to_json(found).c_str());
    } else {
      print(found);
    }
    exit_code = 0;
  });
}

}  // namespace hydrostat::cli
