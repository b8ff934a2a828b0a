#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <type_traits>

namespace hydrostat::physics {

// All of physics is one template on Dim: 3 for bodies of tets, 2 for bodies of triangles in the x-y plane, which are one
// metre deep. The names without Of stand for Dim = 3.

template <int Dim>
using VectorOf = Eigen::Matrix<double, Dim, 1>;
template <int Dim>
using BlockOf = Eigen::Matrix<double, Dim, Dim>;
/// One column a node.
template <int Dim>
using PointsOf = Eigen::Matrix<double, Dim, Eigen::Dynamic>;
/// For parameters whose Dim another one gives.
template <int Dim>
using ConstPointsOf = std::type_identity_t<Eigen::Ref<const PointsOf<Dim>>>;
/// A moment, an angular momentum or a rate of turning: a vector in 3D, in 2D the z component alone.
template <int Dim>
using SpinOf = Eigen::Matrix<double, Dim == 2 ? 1 : 3, 1>;
template <int Dim>
using InertiaOf = Eigen::Matrix<double, Dim == 2 ? 1 : 3, Dim == 2 ? 1 : 3>;

/// Of the corners of a tet or triangle, as the columns of tet_edges count them.
template <int Dim>
constexpr int kEdgesPerTet = Dim*(Dim + 1) / 2;
/// Of a tet or triangle: the determinant of its edge vectors over its volume.
template <int Dim>
constexpr double kSimplexFactor = Dim == 2 ? 2 : 6;

template <int Dim>
SpinOf<Dim> cross(const std::type_identity_t<VectorOf<Dim>>& a, const std::type_identity_t<VectorOf<Dim>>& b) {
  if constexpr (Dim == 3) {
    return a.cross(b);
  } else {
    return SpinOf<Dim>(a.x() * b.y() - a.y() * b.x());
  }
}

/// The velocity at `arm` from the centre of a turn of `rate` [1/s].
template <int Dim>
VectorOf<Dim> turning(const std::type_identity_t<SpinOf<Dim>>& rate, const std::type_identity_t<VectorOf<Dim>>& arm) {
  if constexpr (Dim == 3) {
    return rate.cross(arm);
  } else {
    return rate[0] * VectorOf<Dim>(-arm.y(), arm.x());
  }
}

/// Length [m] of a cube or square of that volume.
template <int Dim>
double size_of_volume(double volume) {
  return Dim == 3 ? std::cbrt(volume) : std::sqrt(volume);
}

using ConstPoints = ConstPointsOf<3>;

}  // namespace hydrostat::physics
