#pragma once

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "io/appearance.h"
#include "io/read_limits.h"
#include "retarget/clip.h"
#include "retarget/error.h"

namespace hydrostat::io {

struct ImportOptions {
  double sample_rate_hz = 60;            // the clip gets max(2, round(rate * range)) equal intervals from first to last key
  std::vector<std::string> meshes = {};  // names or indices of those that come along; none: all of the skeleton
  std::string root =
      {};               // name of the node below which the skeleton hangs; empty: the only one, or the one of most vertices
  std::string up = {};  // the file's axis that points up ("z", "-y" ...); empty: what the file tells, or a guess for BVH
  double metres_per_unit = 0;  // of the file's numbers; 0: what the file tells, or a guess for BVH
  ReadLimits limits = {};
  // What of the clip is played [s], counted from its first key; none: to its last key.
  double from_s = 0;
  std::optional<double> to_s = {};
};

/// Reads a character and one of its clips in metres, y up, seconds.
/// clip: a name (the part behind FBX's '|' will do), an index as text, or empty for the first clip of non-zero length.
/// The bind pose is turned (by one of the 24 turns that take axes to axes) and scaled as a whole so that it stands as the
/// character stands at the clip's first key; bone space is right-handed, orthonormal and in metres in the bind pose.
/// Skinning is exact: sum(weight * bone_pose * inverse(bind_pose)) takes a vertex where the file has it. `warnings`, when
/// given, receives what the importer had to decide, and `appearance` what the skin looks like. Throws Error: no file, not
/// readable, no skeleton, no skinned mesh, no such clip (those that exist are listed), no clip of
/// length, nothing of it between from_s and to_s.
retarget::Character import_character(const std::string& path, const std::string& clip, const ImportOptions& options,
                                     std::vector<std::string>* warnings = nullptr, Appearance* appearance = nullptr);

struct BoneInfo {
  std::string name, parent;  // no parent: a root
  bool weighted = false;
};

struct MeshInfo {
  std::string name;
  int vertices = 0, triangles = 0;  // as the reader delivers them, not welded
  bool skinned = false;
  std::vector<std::string> morphs;  // names of its morph targets
};

/// Box [m] of the skinned vertices (of the joints where there is no mesh), y up, at a fraction of the clip's duration (of
/// BVH at the frame nearest to it).
struct BoxInfo {
  double fraction = 0;
  Eigen::Vector3d min, max;
};

/// When a bone's skin, or the capsule that a conversion gives it, is on the ground: its lowest point is within 1 % of L of
/// the height that a conversion takes for the ground; where it goes faster than half the RMS speed of all bones' lowest
/// points (and than 0.1 sqrt(g L)), within 0.2 %. Speeds of a clip in place are against ground that runs as its feet do.
/// Looked for 60 times a second, at least at 61 times; less often in clips of many points.
struct ContactInfo {
  std::string bone;                                // that moves these vertices most
  double duty = 0;                                 // share of range_s [-]
  std::vector<std::pair<double, double>> times_s;  // from, until; 0 is the first key; 0.067 s long and apart
};

/// A morph target that a clip moves.
struct MorphInfo {
  std::string mesh, name;
  double min = 0, max = 0;  // weight [-] over its keys
};

struct ClipInfo {
  int index = 0;
  std::string name;
  double duration_s = 0, range_s = 0;  // from 0 to the last key; from the first to the last key
  double rate_hz = 0;                  // of the densest channel
  bool loop = false;  // the last key's pose is the first's, moved horizontally, to 2 % of L (RMS of the vertices)
  bool in_place =
      false;  // a loop that travels less than 5 % of L while its low points slide one way, by more than 10 % of L in all
  double speed_m_s = 0;              // horizontal travel of the mean vertex over range_s
  double foot_speed_m_s = 0;         // at which the low points slide: of a clip in place, the speed that was taken from it
  double closure_defect_length = 0;  // RMS distance of the last key's vertices from the first's, moved horizontally, of L
  double max_strain = 0;  // against the bind pose, between vertices up to 8 % of its extent apart (of capsules where there
                          // is no mesh) that hang on one bone or on neighbours: the 99th percentile, the most over the clip
  std::vector<ContactInfo> contacts;
  std::vector<MorphInfo> morphs;
  std::vector<BoxInfo> bbox;
};

/// What the importer sees in a file. L is the longest extent of the box at the clip's first key.
struct FileInfo {
  std::string file, format, up;
  double metres_per_unit = 1;
  std::string unit_reason, up_reason;  // why they are taken
  std::vector<BoneInfo> bones;
  std::vector<MeshInfo> meshes;
  std::vector<ClipInfo> clips;
  std::vector<std::string> warnings;
  bool files_confined = false, network_confined = false;  // the reading process (io/confine.h)
};

/// Throws Error: no file, not readable, no skeleton, no clip. A skeleton without any mesh is told by its joints.
FileInfo inspect(const std::string& path, const ImportOptions& options = {});

/// Schema hydrostat.info/1.
std::string to_json(const FileInfo& info);

/// Schema hydrostat.info_table/1: of several files what is seen in each, or why it is refused.
std::string to_json(const std::vector<std::variant<FileInfo, Error>>& files);

}  // namespace hydrostat::io
