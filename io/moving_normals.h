#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <vector>

#include "io/appearance.h"

namespace hydrostat::io {

/// Where the skin's vertices lie, frame by frame.
struct SkinCourse {
  Eigen::Matrix3Xd bind_pose;                         // [m] 3 x V
  std::function<Eigen::Matrix3Xd(Eigen::Index)> at;  // [m] 3 x V, of a frame
  Eigen::Index frames = 0;
};

/// How normals move beside a turn that all share: the normal in frame f is, but for its length, the turned sum of the normal
/// in the bind pose and of each target times its weight.
struct MovingNormals {
  std::vector<std::vector<Eigen::Matrix3Xd>> targets;    // K x parts; 3 x D each
  Eigen::MatrixXd weights;                               // K x F, in -1..1
  std::vector<std::vector<Eigen::Matrix3Xd>> of_shapes;  // of each shape x parts
};

/// Fits at most eight targets to the normals of the moved surface (io/drawn_normals.h): the principal components of their
/// offsets, as many as it takes to bring these to 2 degrees (RMS). None where the body moves as a whole. A flat part,
/// whose normals need no help, has 3 x 0 of each. `turns`: of each frame, F. `shapes`, 3 x V each in the bind pose, are what moves the skin by
/// `shape_weights` (S x F) within the course: each gets normals of its own, and the targets are fitted to the rest.
/// Source: Alexa and Müller, "Representing Animations by Principal Components", Eurographics 2000.
MovingNormals fit_normals(const std::vector<Appearance::Part>& parts, const SkinCourse& skin,
                          const std::vector<Eigen::Quaterniond>& turns, const std::vector<Eigen::Matrix3Xd>& shapes,
                          const Eigen::MatrixXd& shape_weights);

}  // namespace hydrostat::io
