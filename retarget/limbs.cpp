#include "retarget/limbs.h"

#include <algorithm>
#include <vector>

namespace hydrostat::retarget {
namespace {

/// The bone and its ancestors, root last.
std::vector<int> way_to_root(const Skeleton& skeleton, int bone) {
  std::vector<int> way;
  for (; bone >= 0; bone = skeleton.parents[static_cast<std::size_t>(bone)]) way.push_back(bone);
  return way;
}

}  // namespace

LimbTable bones_of_different_limbs(const Skeleton& skeleton) {
  constexpr std::ptrdiff_t kFar = 4;  // bones: thigh to thigh is 2 or 3, shin to shin 4
  const int count = skeleton.count();
  std::vector<std::vector<int>> ways;
  for (int b = 0; b < count; ++b) ways.push_back(way_to_root(skeleton, b));
  LimbTable different(count, count);
  different.setConstant(false);
  for (int a = 0; a < count; ++a) {
    for (int b = a + 1; b < count; ++b) {
      const std::vector<int>& from = ways[static_cast<std::size_t>(a)];
      const std::vector<int>& to = ways[static_cast<std::size_t>(b)];
      const auto [up, down] = std::mismatch(from.rbegin(), from.rend(), to.rbegin(), to.rend());
      const std::ptrdiff_t climb = from.rend() - up;
      const std::ptrdiff_t descent = to.rend() - down;
      const bool have_common_root = up != from.rbegin();
      different(a, b) = different(b, a) = have_common_root && climb > 0 && descent > 0 && climb + descent >= kFar;
    }
  }
  return different;
}

void find_legs(const Skeleton& skeleton, ContactSchedule& contacts) {
  const LimbTable different = bones_of_different_limbs(skeleton);
  const auto bone_of = [&](const Patch& patch) {
    return std::find(skeleton.names.begin(), skeleton.names.end(), patch.name) - skeleton.names.begin();
  };
  for (Patch& patch : contacts.patches) {
    const auto a = bone_of(patch);
    patch.on_leg = std::any_of(contacts.patches.begin(), contacts.patches.end(), [&](const Patch& other) {
      const auto b = bone_of(other);
      return different(a, b) && (different.col(a) && different.col(b)).any();
    });
  }
}

Eigen::VectorXi dominant_bones(const SkinnedMesh& skin) {
  Eigen::VectorXi bones(skin.vertices.cols());
  for (Eigen::Index v = 0; v < bones.size(); ++v) {
    const auto& influences = skin.skin_weights[static_cast<std::size_t>(v)];
    bones[v] = std::max_element(influences.begin(), influences.end(), [](const auto& a, const auto& b) {
                 return a.weight < b.weight;
               })->bone;
  }
  return bones;
}

}  // namespace hydrostat::retarget
