#include "io/import.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "io/capsules.h"
#include "io/clip_range.h"
#include "io/images.h"
#include "io/import_worker.h"
#include "io/read_chosen_parts.h"
#include "io/rig.h"
#include "io/scene_axes.h"
#include "io/scene_pose.h"
#include "io/scene_selection.h"
#include "retarget/error.h"

namespace hydrostat::io {
namespace {

constexpr double kMostPoses = 4e6;  // of bones, over all frames: half a gigabyte

/// Of the 24 turns that take axes to axes the one nearest to a matrix.
Eigen::Matrix3d nearest_axis_turn(const Eigen::Matrix3d& wanted) {
  Eigen::Matrix3d nearest = Eigen::Matrix3d::Identity();
  double best = nearest.cwiseProduct(wanted).sum();
  std::array<int, 3> order{0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Eigen::Matrix3d turn = Eigen::Matrix3d::Zero();
      for (int row = 0; row < 3; ++row) turn(row, order[static_cast<std::size_t>(row)]) = signs & (1 << row) ? -1 : 1;
      const double fit = turn.cwiseProduct(wanted).sum();
      // A hair above, so that the turn does not depend on rounding where two fit alike.
      if (turn.determinant() < 0 || fit <= best + 1e-9 * wanted.norm()) continue;
      best = fit;
      nearest = turn;
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return nearest;
}

/// Each bone's share in the skin [vertices].
std::vector<double> weights_of_bones(const Rig& rig) {
  std::vector<double> weight(static_cast<std::size_t>(rig.skeleton.count()), 0.0);
  for (const auto& influences : rig.skin.skin_weights) {
    for (const auto& influence : influences) weight[static_cast<std::size_t>(influence.bone)] += influence.weight;
  }
  return weight;
}

/// Whether a pose shows most of the skin as its bind pose's mirror image: what scales a node above the skeleton by -1 is in the clip, and
/// the inverse bind matrices need not know of it. No body moves from one to the other.
bool is_mirrored(const Rig& rig, const std::vector<Eigen::Affine3d>& pose) {
  const std::vector<double> weight = weights_of_bones(rig);
  double mirrored = 0;
  for (std::size_t b = 0; b < pose.size(); ++b) {
    const double sign = pose[b].linear().determinant() * rig.skeleton.bind_pose[b].linear().determinant();
    if (rig.skeleton.weighted[b] && sign != 0) mirrored += sign < 0 ? weight[b] : -weight[b];
  }
  return mirrored > 0;
}

/// Makes the bind pose its own mirror image across x, bone space staying as it is; the skin keeps its outside.
void mirror_bind_pose(Rig& rig) {
  const Eigen::Affine3d mirror(Eigen::Vector3d(-1, 1, 1).asDiagonal());
  for (Eigen::Affine3d& bind : rig.skeleton.bind_pose) bind = mirror * bind;
  rig.skin.vertices.row(0) *= -1;
  for (retarget::MorphTarget& morph : rig.skin.morphs) morph.offsets.row(0) *= -1;
  for (RigMesh& mesh : rig.meshes) {
    if (mesh.normals.size() > 0) mesh.normals.row(0) *= -1;
  }
  rig.skin.triangles.row(1).swap(rig.skin.triangles.row(2));
  rig.corners.row(1).swap(rig.corners.row(2));
}

/// The turn and scale that let the bind pose stand as the character stands in a pose: the weighted mean of the bones' turns,
/// made square to the axes, and the median of their scales.
Eigen::Affine3d stand_upright(const Rig& rig, const std::vector<Eigen::Affine3d>& pose) {
  const std::vector<double> weight = weights_of_bones(rig);
  std::vector<double> scales;
  Eigen::Matrix3d mean = Eigen::Matrix3d::Zero();
  for (std::size_t b = 0; b < pose.size(); ++b) {
    if (!rig.skeleton.weighted[b]) continue;
    const Eigen::Matrix3d motion = (pose[b] * rig.skeleton.bind_pose[b].inverse()).linear();
    mean += weight[b] * split_turn(motion).rotation;
    scales.push_back(std::cbrt(std::abs(motion.determinant())));
  }
  std::nth_element(scales.begin(), scales.begin() + static_cast<std::ptrdiff_t>(scales.size() / 2), scales.end());
  const double scale = scales[scales.size() / 2];
  // Shrunk to nothing at the first key: the bind pose's own size is the only one known.
  return Eigen::Affine3d((scale > 1e-9 ? scale : 1.0) * nearest_axis_turn(mean));
}

/// Takes the bind pose's scale and shear out of bone space, in the bind pose and in every frame alike, so that skinning
/// stays.
void make_bone_space_rigid(retarget::Skeleton& skeleton, retarget::Clip& clip) {
  for (std::size_t b = 0; b < skeleton.bind_pose.size(); ++b) {
    Eigen::Affine3d& bind = skeleton.bind_pose[b];
    const Turn turn = split_turn(bind.linear());
    const Eigen::FullPivLU<Eigen::Matrix3d> stretch(turn.stretch);
    const Eigen::Matrix3d undo = stretch.isInvertible() ? Eigen::Matrix3d(stretch.inverse()) : Eigen::Matrix3d::Identity();
    bind.linear() = turn.rotation;
    for (std::vector<Eigen::Affine3d>& frame : clip.bone_pose) frame[b].linear() = (frame[b].linear() * undo).eval();
  }
}

retarget::Clip sample(const Rig& rig, const Scene& scene, std::size_t index, const ImportOptions& options,
                      const std::string& path) {
  const SceneClip& source = scene.clips[index];
  const std::string place = "clip '" + source.name + "'";
  const ClipRange whole = range_of(source), range = cut(whole, options.from_s, options.to_s, path, place);
  retarget::Clip clip;
  clip.name = source.name;
  clip.index = static_cast<int>(index);
  clip.range_s = range.length_s();
  const bool is_whole = range.start_s == whole.start_s && range.end_s == whole.end_s;
  clip.duration_s = !is_whole ? range.length_s() : (source.duration_s > 0 ? source.duration_s : range.end_s);
  clip.key_rate_hz = range.key_rate_hz;
  const int intervals = std::max(2, static_cast<int>(std::lround(options.sample_rate_hz * clip.range_s)));
  clip.rate_hz = intervals / clip.range_s;
  if (static_cast<double>(intervals) * static_cast<double>(rig.scene_nodes.size()) > kMostPoses) {
    throw Error(path, place, "it is too long for so many bones", "Cut it into shorter clips");
  }
  const auto morphs = static_cast<Eigen::Index>(rig.morph_sources.size());
  if (static_cast<double>(intervals) * static_cast<double>(morphs) > kMostPoses)
    throw Error(path, place, "it is too long for so many morph targets", "Cut it into shorter clips");
  clip.morph_weights.resize(morphs, intervals + 1);
  for (int f = 0; f <= intervals; ++f) {
    const double time_s = range.start_s + clip.range_s * f / intervals;
    clip.bone_pose.push_back(bone_poses(rig, scene, source, time_s));
    clip.morph_weights.col(f) = morph_weights(rig, source, time_s);
  }
  return clip;
}

/// Keeps the morph targets that this clip moves.
void forget_still_morphs(retarget::SkinnedMesh& skin, retarget::Clip& clip) {
  std::vector<int> moving;
  for (int k = 0; k < clip.morph_weights.rows(); ++k) {
    if (clip.morph_weights.row(k).isZero(0)) continue;
    skin.morphs[moving.size()] = skin.morphs[static_cast<std::size_t>(k)];
    moving.push_back(k);
  }
  skin.morphs.resize(moving.size());
  clip.morph_weights = moving.empty() ? Eigen::MatrixXd() : Eigen::MatrixXd(clip.morph_weights(moving, Eigen::all));
}

void require_finite(const retarget::Character& character, const std::string& path) {
  bool finite = character.skin.vertices.allFinite() && character.clip.morph_weights.allFinite();
  for (const retarget::MorphTarget& morph : character.skin.morphs) finite = finite && morph.offsets.allFinite();
  for (const std::vector<Eigen::Affine3d>& frame : character.clip.bone_pose) {
    for (const Eigen::Affine3d& pose : frame) finite = finite && pose.matrix().allFinite();
  }
  if (!finite)
    throw Error(path, "clip '" + character.clip.name + "'", "its transforms overflow", "Export it anew in a sane scale");
}

}  // namespace

Scene read_chosen_parts(const std::string& path, const ImportOptions& options) {
  Scene scene = read_in_worker(path, options.limits);
  settle_axes(scene, options.up, options.metres_per_unit);
  select_parts(scene, options.meshes, options.root, path);
  settle_images(scene, path);
  return scene;
}

retarget::Character import_character(const std::string& path, const std::string& clip, const ImportOptions& options,
                                     std::vector<std::string>* warnings, Appearance* appearance) {
  const Scene scene = read_chosen_parts(path, options);
  const std::size_t chosen = choose_clip(scene, clip, path);
  Rig rig = build_rig(scene, path);
  retarget::Character character;
  character.clip = sample(rig, scene, chosen, options, path);
  if (rig.skin.vertices.cols() == 0) add_capsules(rig, path);
  if (is_mirrored(rig, character.clip.bone_pose.front())) mirror_bind_pose(rig);
  const Eigen::Affine3d upright = stand_upright(rig, character.clip.bone_pose.front());
  if (appearance) *appearance = build_appearance(scene, rig, split_turn(upright.linear()).rotation);
  character.skeleton = std::move(rig.skeleton);
  for (Eigen::Affine3d& bind : character.skeleton.bind_pose) bind = upright * bind;
  character.skin = std::move(rig.skin);
  character.skin.vertices = upright * character.skin.vertices;
  for (retarget::MorphTarget& morph : character.skin.morphs) morph.offsets = upright.linear() * morph.offsets;
  forget_still_morphs(character.skin, character.clip);
  make_bone_space_rigid(character.skeleton, character.clip);
  require_finite(character, path);
  if (warnings) {
    warnings->insert(warnings->end(), scene.warnings.begin(), scene.warnings.end());
    warnings->insert(warnings->end(), rig.warnings.begin(), rig.warnings.end());
  }
  return character;
}

}  // namespace hydrostat::io
