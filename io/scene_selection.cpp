#include "io/scene_selection.h"

#include <algorithm>
#include <map>
#include <numeric>

#include "retarget/error.h"

namespace hydrostat::io {
namespace {

std::string list_meshes(const Scene& scene) {
  std::string list;
  for (std::size_t m = 0; m < scene.meshes.size(); ++m)
    list += (m == 0 ? "" : ", ") + std::to_string(m) + " '" + scene.meshes[m].name + "'";
  return list.empty() ? "none" : list;
}

void keep_meshes(Scene& scene, const std::vector<std::string>& wanted, const std::string& path) {
  if (wanted.empty()) return;
  for (const std::string& name : wanted) {
    bool found = false;
    for (SceneMesh& mesh : scene.meshes) {
      if (mesh.name == name) mesh.is_wanted = found = true;
    }
    for (std::size_t m = 0; !found && m < scene.meshes.size(); ++m) {
      if (std::to_string(m) == name) scene.meshes[m].is_wanted = found = true;
    }
    if (!found) throw Error(path, "mesh '" + name + "'", "there is no such mesh", "Choose of: " + list_meshes(scene));
  }
  std::erase_if(scene.meshes, [](const SceneMesh& mesh) { return !mesh.is_wanted; });
}

/// The skeletons of a scene: bones that belong together.
class Skeletons {
 public:
  explicit Skeletons(const Scene& scene) : scene_(scene), group_(scene.nodes.size()) {
    std::iota(group_.begin(), group_.end(), 0);
    std::map<int, int> first_on;  // of each node below the root: a topmost bone that hangs on it
    for (std::size_t n = 0; n < scene.nodes.size(); ++n) {
      if (!scene.nodes[n].is_joint) continue;
      const int top = top_of(static_cast<int>(n));
      join(static_cast<int>(n), top);
      const int on = scene.nodes[static_cast<std::size_t>(top)].parent;
      if (on < 0 || scene.nodes[static_cast<std::size_t>(on)].parent < 0) continue;
      join(top, first_on.emplace(on, top).first->second);
    }
    for (const SceneMesh& mesh : scene.meshes) {
      for (const SceneMesh::Joint& joint : mesh.joints) {
        if (leading_joint(mesh) >= 0) join(joint.node, leading_joint(mesh));
      }
    }
    for (const SceneMesh& mesh : scene.meshes) {
      const int leading = leading_joint(mesh);
      if (leading >= 0) vertices_[find(leading)] += mesh.vertices.cols();
    }
  }

  std::size_t count() const { return vertices_.size(); }
  int skeleton_of(int node) { return find(node); }
  static int leading_joint(const SceneMesh& mesh) {
    for (const SceneMesh::Joint& joint : mesh.joints) {
      if (!joint.weights.empty()) return joint.node;
    }
    return -1;
  }

  int largest() const {
    return std::max_element(vertices_.begin(), vertices_.end(),
                            [](const auto& a, const auto& b) { return a.second < b.second; })
        ->first;
  }

  /// The skeletons with a topmost bone of that name, or below a node of it.
  std::vector<int> below(const std::string& name) {
    std::vector<int> found;
    for (const auto& [group, vertices] : vertices_) {
      bool is_below = false;
      for (std::size_t n = 0; n < group_.size(); ++n) {
        if (!scene_.nodes[n].is_joint || find(static_cast<int>(n)) != group) continue;
        for (int up = top_of(static_cast<int>(n)); up >= 0; up = scene_.nodes[static_cast<std::size_t>(up)].parent)
          is_below = is_below || scene_.nodes[static_cast<std::size_t>(up)].name == name;
      }
      if (is_below) found.push_back(group);
    }
    return found;
  }

  std::string list() {
    std::string text;
    for (const auto& [group, vertices] : vertices_)
      text += (text.empty() ? "'" : ", '") + name_of(group) + "' (" + std::to_string(vertices) + " vertices)";
    return text;
  }

  /// The name of its first topmost bone, or of what carries it where another skeleton's has that name too.
  std::string name_of(int group) {
    const int top = first_top(group);
    const std::string& name = scene_.nodes[static_cast<std::size_t>(top)].name;
    const int on = scene_.nodes[static_cast<std::size_t>(top)].parent;
    for (const auto& [other, vertices] : vertices_) {
      if (other != group && on >= 0 && scene_.nodes[static_cast<std::size_t>(first_top(other))].name == name)
        return scene_.nodes[static_cast<std::size_t>(on)].name;
    }
    return name;
  }

 private:
  int top_of(int node) const {
    int top = node;
    for (int up = node; up >= 0; up = scene_.nodes[static_cast<std::size_t>(up)].parent) {
      if (scene_.nodes[static_cast<std::size_t>(up)].is_joint) top = up;
    }
    return top;
  }

  int first_top(int group) {
    for (std::size_t n = 0; n < group_.size(); ++n) {
      if (scene_.nodes[n].is_joint && find(static_cast<int>(n)) == group) return top_of(static_cast<int>(n));
    }
    return group;
  }

  int find(int node) {
    while (group_[static_cast<std::size_t>(node)] != node) {
      int& up = group_[static_cast<std::size_t>(node)];
      up = group_[static_cast<std::size_t>(up)];
      node = up;
    }
    return node;
  }
  void join(int a, int b) { group_[static_cast<std::size_t>(find(std::max(a, b)))] = find(std::min(a, b)); }

  const Scene& scene_;
  std::vector<int> group_;                // of every scene node: another of its skeleton, or itself
  std::map<int, Eigen::Index> vertices_;  // that each skeleton moves
};

void keep_skeleton(Scene& scene, const std::string& root, const std::string& path) {
  Skeletons skeletons(scene);
  if (skeletons.count() == 0) {
    if (!root.empty()) throw Error(path, "root '" + root + "'", "no skin hangs on bones", "Leave --root out");
    return;
  }
  if (skeletons.count() == 1 && root.empty()) return;
  std::vector<int> kept{skeletons.largest()};
  if (!root.empty()) kept = skeletons.below(root);
  if (kept.empty())
    throw Error(path, "root '" + root + "'", "no skeleton has this root", "Choose one of: " + skeletons.list());
  if (root.empty()) {
    scene.warnings.push_back("The file has " + std::to_string(skeletons.count()) + " skeletons, " + skeletons.list() +
                             ": '" + skeletons.name_of(kept.front()) + "', which moves most, is taken; --root chooses.");
  }
  const auto is_kept = [&](int node) {
    return std::find(kept.begin(), kept.end(), skeletons.skeleton_of(node)) != kept.end();
  };
  std::erase_if(scene.meshes, [&](const SceneMesh& mesh) {
    const int leading = Skeletons::leading_joint(mesh);
    if (leading >= 0) return !is_kept(leading);
    for (int up = mesh.node; up >= 0; up = scene.nodes[static_cast<std::size_t>(up)].parent) {
      if (scene.nodes[static_cast<std::size_t>(up)].is_joint) return !is_kept(up);  // hangs on a bone of another
    }
    return false;
  });
  for (std::size_t n = 0; n < scene.nodes.size(); ++n)
    scene.nodes[n].is_joint = scene.nodes[n].is_joint && is_kept(static_cast<int>(n));
}

}  // namespace

void select_parts(Scene& scene, const std::vector<std::string>& meshes, const std::string& root, const std::string& path) {
  keep_meshes(scene, meshes, path);
  keep_skeleton(scene, root, path);
}

}  // namespace hydrostat::io
