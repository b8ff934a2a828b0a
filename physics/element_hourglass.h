#pragma once

#include <Eigen/Core>

#include "physics/material.h"

namespace hydrostat::physics {

template <int Dim>
using Corners = Eigen::Matrix<double, Dim, (1 << Dim)>;  // [m] of a box; bit d of a column's number is its coordinate d

/// How a box (quad or hexahedron) at rest measures the places of its nodes: their mean gradient, and what is left.
template <int Dim>
struct BoxMeasure {
  static constexpr int kNodes = 1 << Dim, kModes = kNodes - 1 - Dim;
  double volume = 0;                                 // [m3], in 2D [m2]
  Eigen::Matrix<double, kNodes, 1> nodal_volume;     // integrals of the shape functions: what each node carries
  Eigen::Matrix<double, kNodes, Dim> gradient;       // x * gradient is the mean deformation gradient; [1/m]
  Eigen::Matrix<double, kNodes, kModes> hourglass;   // x * hourglass is the hourglass part [m], 0 for every linear motion
  Eigen::Matrix<double, kNodes, kModes> pattern;     // the motions that it measures: their mean gradient is 0
  double least_jacobian_ratio = 0;                   // least det of the map from the cube at a corner, over their mean
};
template <int Dim>
BoxMeasure<Dim> measure_box(const Corners<Dim>& corners);

/// Stiffness [N/m] of a box under Hooke's law with enhanced strain, which neither bending nor volume locks: incompatible
/// parabolas (1 - xi^2) of Wilson in Taylor's form, and volume changes that vary as xi eta, eta zeta, zeta xi, condensed.
/// The row of component i of node c is Dim c + i.
/// Source: Taylor, Beresford, Wilson, "A non-conforming element for stress analysis", IJNME 10, 1976; Simo, Armero, Taylor,
/// "Improved versions of assumed enhanced strain tri-linear elements for 3D finite deformation problems", CMAME 110, 1993
/// (three volume modes, section 3). Without the volume modes it is the element C3D8I of CalculiX.
template <int Dim>
Eigen::MatrixXd enhanced_stiffness(const Corners<Dim>& corners, const Lame& lame, bool volume_modes = true);

/// The part of enhanced_stiffness that the mean strain does not have [N/m], over the hourglass coordinates
/// x * measure.hourglass (columns stacked). As the element passes the patch test, the two parts do not couple: mean strain
/// and hourglass together give enhanced_stiffness back, for boxes of every shape.
template <int Dim>
Eigen::MatrixXd hourglass_stiffness(const Corners<Dim>& corners, const BoxMeasure<Dim>& measure, const Lame& lame);

}  // namespace hydrostat::physics
