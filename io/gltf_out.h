#pragma once

#include <array>
#include <filesystem>
#include <string>

#include "io/played_skin.h"

namespace hydrostat::io {

struct GltfOptions {
  std::string name = "creature";                    // of the scene's nodes and of the animation
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  // [m] of the origin that body and motion are about, in the file's world
  std::array<double, 4> colour{0.80, 0.45, 0.30, 1.0};  // of skin without material: linear red, green, blue, alpha in 0..1
};

/// Writes a binary glTF 2.0 file in which the fine skin moves with the control nodes: one joint per node, keyed with the
/// node's position, and one rotation R common to all joints, the best fit of the control mesh to its rest shape (weighted by
/// the node masses, N, [kg]). With the inverse bind matrices translate(-X) linear blend skinning gives
///   v = R (v_bind - sum w X) + sum w x,
/// the embedded position exactly, between keys too, where v_bind is the same weighted sum of rest nodes; what the embedding
/// misses it by turns with R, as the normals do. Where the body bends, these follow by targets that move normals alone, no
/// position (io/moving_normals.h): without them one would be off by as much as its limb is from R.
/// Morph targets are the file's by name (`extras.targetNames`), turned with the body around them (io/moving_morphs.h).
/// With an appearance each of its parts is a primitive, flat ones without normals, and its images lie in the file as they
/// are. A loop gets its first frame, moved on by one period, as last key. Numbers are float32. Throws Error when the file
/// cannot be written, or for a body of more than 65536 nodes (glTF's joint indices).
void write_skinned_glb(const std::filesystem::path& path, const EmbeddedSkin& skin, const retarget::ControlMesh& body,
                       const Eigen::Ref<const Eigen::VectorXd>& mass, const retarget::Motion& motion,
                       const GltfOptions& options);

}  // namespace hydrostat::io
