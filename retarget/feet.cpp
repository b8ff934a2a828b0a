#include "retarget/feet.h"

#include <algorithm>
#include <map>

#include "retarget/disjoint_sets.h"

namespace hydrostat::retarget {

std::vector<Patch> feet_of(const ContactSchedule& contacts, const physics::ContactPoints& points) {
  DisjointSets sets(static_cast<int>(contacts.patches.size()));
  std::map<int, int> patch_of_node;
  const auto on_leg = [&](int k) { return contacts.patches[static_cast<std::size_t>(k)].on_leg; };
  for (int k = 0; k < static_cast<int>(contacts.patches.size()); ++k) {
    if (!on_leg(k)) continue;
    for (const int p : contacts.patches[static_cast<std::size_t>(k)].points) {
      for (const int node : points.nodes.col(p)) sets.join(patch_of_node.emplace(node, k).first->second, k);
    }
  }
  std::map<int, Patch> feet;
  for (int k = 0; k < static_cast<int>(contacts.patches.size()); ++k) {
    if (!on_leg(k)) continue;
    const Patch& patch = contacts.patches[static_cast<std::size_t>(k)];
    Patch& foot = feet.emplace(sets.root(k), Patch{patch.name, {}, true}).first->second;
    foot.points.insert(foot.points.end(), patch.points.begin(), patch.points.end());
  }
  std::vector<Patch> result;
  for (auto& [root, foot] : feet) {
    std::sort(foot.points.begin(), foot.points.end());
    result.push_back(std::move(foot));
  }
  return result;
}

}  // namespace hydrostat::retarget
