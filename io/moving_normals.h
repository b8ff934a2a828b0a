#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "io/appearance.h"
#include "retarget/control_mesh.h"
#include "retarget/motion.h"

namespace hydrostat::io {

/// How normals move beside a turn that all share: the normal in frame f is, but for its length, the turned sum of the normal
/// in the bind pose and of each target times its weight.
struct MovingNormals {
  std::vector<std::vector<Eigen::Matrix3Xd>> targets;  // K x parts; 3 x D each
  Eigen::MatrixXd weights;                             // K x F, in -1..1
};

/// Fits at most eight targets to the normals of the moved surface (the mean of the triangles around, weighted by area; drawn
/// vertices of one place that share a normal in the bind pose go on sharing it): the principal components of their offsets,
/// as many as it takes to bring these to 2 degrees (RMS). None where a part is flat, so that its normals need no help, or
/// the body moves as a whole. `rest_nodes` [m], 3 x N, carry the bind pose; `turns`: of each frame, F.
/// Source: Alexa and Müller, "Representing Animations by Principal Components", Eurographics 2000.
MovingNormals fit_normals(const std::vector<Appearance::Part>& parts, const Eigen::Matrix3Xd& rest_nodes,
                          const retarget::Embedding& embedding, const retarget::Motion& motion,
                          const std::vector<Eigen::Quaterniond>& turns);

}  // namespace hydrostat::io
