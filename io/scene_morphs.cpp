#include "io/scene_morphs.h"

#include <set>
#include <utility>

namespace hydrostat::io {
namespace {

constexpr double kStillWeight = 1e-6;

}  // namespace

bool is_still(const Track& weight, double at_rest) {
  return ((weight.values.array() - at_rest).abs() < kStillWeight).all() && (weight.in_tangents.array() == 0).all() &&
         (weight.out_tangents.array() == 0).all();
}

void set_shape(const Eigen::Matrix3Xd& offsets, SceneMesh::Morph& morph) {
  std::vector<int> moved;
  for (Eigen::Index v = 0; v < offsets.cols(); ++v) {
    if (!offsets.col(v).isZero(0)) moved.push_back(static_cast<int>(v));
  }
  morph.vertices = Eigen::Map<const Eigen::VectorXi>(moved.data(), static_cast<Eigen::Index>(moved.size()));
  morph.offsets = offsets(Eigen::all, moved);
}

void forget_morphs_without_shape(Scene& scene) {
  std::set<std::pair<int, int>> shaped;
  for (const SceneMesh& mesh : scene.meshes) {
    for (std::size_t t = 0; t < mesh.morphs.size(); ++t) {
      if (mesh.morphs[t].vertices.size() > 0) shaped.emplace(mesh.node, static_cast<int>(t));
    }
  }
  for (SceneClip& clip : scene.clips) {
    std::erase_if(clip.morphs,
                  [&](const MorphChannel& channel) { return !shaped.contains({channel.node, channel.target}); });
  }
}

}  // namespace hydrostat::io
