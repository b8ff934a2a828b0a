#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>

#include "cli/command_line.h"
#include "cli/import_options.h"
#include "cli/subcommands.h"
#include "io/import.h"

namespace hydrostat::cli {

namespace fs = std::filesystem;

namespace {

struct InfoOptions {
  std::string clip_file;
  bool json = false;
  io::ImportOptions import;
};

constexpr double kStill = 0.002,
                 kClosed = 1e-4;  // of the length: travel, and distance of the end from the start, that are none

void print_loop(const io::ClipInfo& clip) {
  std::printf("  %s: ", clip.loop ? "loop" : "one-shot");
  if (clip.closure_defect_length < kClosed) {
    std::puts("it ends as it begins");
  } else {
    std::printf("its end is %.2g %% of its length from its start\n", 100 * clip.closure_defect_length);
  }
}

void print_contacts(const io::ClipInfo& clip) {
  if (clip.contacts.empty()) std::puts("  never on the ground");
  for (const io::ContactInfo& contact : clip.contacts) {
    std::printf("  on the ground: %s, %.0f %% of the time:", contact.bone.c_str(), 100 * contact.duty);
    for (const auto& [from_s, until_s] : contact.times_s) std::printf(" %.2f-%.2f", from_s, until_s);
    std::puts(" s");
  }
}

void print_clip(const io::ClipInfo& clip) {
  const Eigen::Vector3d size = clip.bbox.front().max - clip.bbox.front().min;
  std::printf("clip %d '%s': %.3f s (%.3f s of keys at %.4g Hz), starts %.4g m high, %.4g x %.4g m on the ground\n",
              clip.index, clip.name.c_str(), clip.duration_s, clip.range_s, clip.rate_hz, size.y(), size.x(), size.z());
  if (clip.range_s == 0) {
    std::puts("  a pose, not a clip");
    return;
  }
  print_loop(clip);
  if (clip.in_place) {
    std::printf("  in place: its feet slide at %.3g m/s; 'convert' lets it travel at that (--root-motion says otherwise)\n",
                clip.foot_speed_m_s);
  } else if (clip.speed_m_s * clip.range_s < kStill * size.maxCoeff()) {
    std::puts("  stays where it is");
  } else {
    std::printf("  travels at %.3g m/s, %.3g m in all\n", clip.speed_m_s, clip.speed_m_s * clip.range_s);
  }
  if (clip.max_strain > 0) std::printf("  asks a soft body to change its lengths by up to %.0f %%\n", 100 * clip.max_strain);
  for (const io::MorphInfo& morph : clip.morphs)
    std::printf("  moves morph target '%s' of '%s': %.3g to %.3g\n", morph.name.c_str(), morph.mesh.c_str(), morph.min,
                morph.max);
  print_contacts(clip);
}

void print(const io::FileInfo& info) {
  std::printf("%s: %s, %g m per unit (%s), %s up (%s)\n", info.file.c_str(), info.format.c_str(), info.metres_per_unit,
              info.unit_reason.c_str(), info.up.c_str(), info.up_reason.c_str());
  const auto weighted =
      std::count_if(info.bones.begin(), info.bones.end(), [](const io::BoneInfo& bone) { return bone.weighted; });
  std::printf("%zu bones, %td of them move skin", info.bones.size(), weighted);
  std::string idle;
  for (const io::BoneInfo& bone : info.bones) {
    if (!bone.weighted && weighted > 0) idle += (idle.empty() ? "; not: " : ", ") + bone.name;
  }
  std::puts(idle.c_str());
  for (const io::MeshInfo& mesh : info.meshes) {
    std::printf("mesh '%s': %d vertices, %d triangles%s\n", mesh.name.c_str(), mesh.vertices, mesh.triangles,
                mesh.skinned ? "" : ", not bound to bones");
    if (mesh.morphs.empty()) continue;
    std::string names;
    for (const std::string& name : mesh.morphs) names += (names.empty() ? "" : ", ") + name;
    std::printf("  morph targets: %s\n", names.c_str());
  }
  for (const io::ClipInfo& clip : info.clips) print_clip(clip);
  for (const std::string& warning : info.warnings) std::printf("warning: %s\n", warning.c_str());
}

void print_row(const io::FileInfo& info) {
  int vertices = 0;
  for (const io::MeshInfo& mesh : info.meshes) vertices += mesh.vertices;
  double length = 0, longest_s = 0;
  int loops = 0;
  for (const io::ClipInfo& clip : info.clips) {
    length = std::max(length, (clip.bbox.front().max - clip.bbox.front().min).maxCoeff());
    longest_s = std::max(longest_s, clip.duration_s);
    loops += clip.loop && clip.range_s > 0 ? 1 : 0;
  }
  std::printf("%-36s %-8s %6zu %9d %8.3g %6zu %6d %9.3g %9zu\n", fs::path(info.file).filename().c_str(), info.format.c_str(),
              info.bones.size(), vertices, length, info.clips.size(), loops, longest_s, info.warnings.size());
}

/// A row for each clip file of a directory. 1 where none can be read.
int tell_directory(const InfoOptions& options) {
  std::vector<std::variant<io::FileInfo, Error>> found;
  if (!options.json) {
    std::printf("%-36s %-8s %6s %9s %8s %6s %6s %9s %9s\n", "file", "format", "bones", "vertices", "length m", "clips",
                "loops", "longest s", "warnings");
  }
  bool any = false;
  for (const fs::path& file : clip_files(options.clip_file)) {
    try {
      found.emplace_back(io::inspect(file.string(), options.import));
      any = true;
      if (!options.json) print_row(std::get<io::FileInfo>(found.back()));
    } catch (const Error& error) {
      found.emplace_back(error);
      if (!options.json)
        std::printf("%-36s %s\n", file.filename().c_str(),
                    one_line(Error("", error.where, error.what(), error.mend)).c_str());
    }
  }
  if (options.json) std::puts(io::to_json(found).c_str());
  return any ? kDone : kInputRefused;
}

}  // namespace

void add_info(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<InfoOptions>();
  CLI::App* info =
      app.add_subcommand("info", "What the importer sees in a clip file: bones, meshes, clips, units, warnings");
  info->add_option("CLIP", options->clip_file, "FBX, glTF, Collada or BVH file, or a directory of such: a table")
      ->required();
  add_import_options(*info, options->import);
  info->add_flag("--json", options->json, "Schema hydrostat.info/1 (hydrostat.info_table/1) instead of text");
  info->callback([options, &exit_code] {
    std::error_code ignored;
    if (fs::is_directory(options->clip_file, ignored)) {
      exit_code = tell_directory(*options);
      return;
    }
    const io::FileInfo found = io::inspect(options->clip_file, options->import);
    if (options->json) {
      std::puts(io::to_json(found).c_str());
    } else {
      print(found);
    }
    exit_code = 0;
  });
}

}  // namespace hydrostat::cli
