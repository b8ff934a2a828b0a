#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

#include "io/appearance.h"

namespace hydrostat::io {

/// How a track runs from one key to the next: held, straight (great arc for rotations), or by Hermite's cubic.
enum class Interpolation : std::uint8_t { kStep, kLinear, kCubic };

/// The keys of one property of a scene node: a translation [file units], a rotation (quaternion x y z w) or a scale [-].
/// No keys: the property stays as the node has it.
struct Track {
  Interpolation interpolation = Interpolation::kLinear;
  std::vector<double> times;                  // [s] K, ascending; 0 is the clip's start as the file counts
  Eigen::MatrixXd values;                     // 3 x K or 4 x K; of a weight 1 x K
  Eigen::MatrixXd in_tangents, out_tangents;  // [1/s] as values, for kCubic alone
};

/// The tracks of one part of one scene node.
struct Channel {
  int node = 0, part = 0;
  Track translation, rotation, scale;
};

/// The weight [-] of one morph target over time, of all meshes on one scene node.
struct MorphChannel {
  int node = 0, target = 0;
  Track weight;  // 1 x K
};

struct SceneClip {
  std::string name;
  double duration_s = 0;  // from 0 to the last key (FBX: LocalStart to LocalStop)
  std::vector<Channel> channels;
  std::vector<MorphChannel> morphs = {};  // of targets that move
};

/// What of a parent's scale reaches a scene node. With R the rotation, S the scale and shear, p of the parent, l local:
enum class ScaleInheritance : std::uint8_t {
  kAfterRotation,  // Rp Rl Sp Sl
  kOrdinary,       // Rp Sp Rl Sl, the product of the matrices
  kCompensated     // Rp Rl (Sp without the parent's own local scale) Sl
};

struct SceneNode {
  std::string name;
  int parent = -1;                     // of a lower index; -1 is a root
  std::vector<Eigen::Affine3d> parts;  // their product is the local transform at rest; more than one: FBX pivots
  ScaleInheritance inheritance = ScaleInheritance::kOrdinary;
  bool holds_mesh = false;
  bool is_joint = false;  // some skin names it, with or without weights
};

struct SceneMesh {
  struct Weight {
    int vertex;
    double weight;
  };
  struct Joint {
    int node = 0;
    Eigen::Affine3d inverse_bind_matrix;  // mesh space to bone space
    std::vector<Weight> weights;          // as the file has them
  };
  /// A shape beside that of the vertices.
  struct Morph {
    std::string name;
    double weight = 0;          // at rest: so much of it is in the vertices
    Eigen::VectorXi vertices;   // M, each once; none: no clip moves it, and its shape is not told
    Eigen::Matrix3Xd offsets;   // [file units] 3 x M, mesh space
  };
  std::string name;
  int node = 0;
  Eigen::Matrix3Xd vertices;   // [file units] 3 x V, mesh space
  Eigen::Matrix3Xi triangles;  // 3 x T
  std::vector<Joint> joints;   // none: not skinned
  Eigen::VectorXi triangle_materials;  // T, of the scene's; -1 or no entries at all: none
  Eigen::Matrix3Xd normals;            // 3 x V, of length 1, mesh space; none: not told
  std::vector<Eigen::Matrix2Xd> uvs;   // of each set 2 x V, v downward
  Eigen::Matrix4Xd colours;            // 4 x V, linear, 0..1; none: not told
  std::vector<Morph> morphs;           // a channel names them by their place here
  bool is_wanted = false;      // named by the user: comes along even where nothing carries it
};

/// What a clip file holds, in its own units and axes, as the worker process hands it over.
struct Scene {
  std::string format;  // "fbx", "gltf", "collada", "bvh"
  double metres_per_unit = 1;
  std::string up = "y";                                   // the file's own axis: "y", "-z" ...
  Eigen::Matrix3d to_y_up = Eigen::Matrix3d::Identity();  // rotation of the file's axes to ours
  std::vector<SceneNode> nodes;                           // parent before child
  std::vector<SceneMesh> meshes;                          // of triangles
  std::vector<SceneClip> clips;
  std::vector<Material> materials;
  std::vector<Image> images;
  std::vector<std::string> warnings;
  bool files_confined = false, network_confined = false;  // the worker process while it read (io/confine.h)
};

}  // namespace hydrostat::io
