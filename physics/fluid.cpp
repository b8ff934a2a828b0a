#include "physics/fluid.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace hydrostat::physics {
namespace {

/// Outward, as long as the face is large [m2]; in 2D a segment a metre deep.
VectorOf<2> area_of(const VectorOf<2>& a, const VectorOf<2>& b) { return {b.y() - a.y(), a.x() - b.x()}; }
VectorOf<3> area_of(const VectorOf<3>& a, const VectorOf<3>& b, const VectorOf<3>& c) { return 0.5 * (b - a).cross(c - a); }

template <int Dim>
VectorOf<Dim> area_of_face(const PointsOf<Dim>& x, const Eigen::Matrix<int, Dim, 1>& face) {
  if constexpr (Dim == 2) {
    return area_of(x.col(face[0]), x.col(face[1]));
  } else {
    return area_of(x.col(face[0]), x.col(face[1]), x.col(face[2]));
  }
}

}  // namespace

template <int Dim>
FluidEffect<Dim>::FluidEffect(const SceneOf<Dim>& scene, const FluidOf<Dim>& fluid)
    : scene_(scene), fluid_(fluid), gravity_(scene.gravity.norm()), drag_(Dim, scene.body.node_count()) {
  up_ = VectorOf<Dim>::UnitY();
  if (gravity_ > 0) up_ = -scene.gravity / gravity_;
  const std::vector<SurfaceFace> faces = surface_faces(scene.body);
  faces_.resize(Dim, static_cast<Eigen::Index>(faces.size()));
  for (std::size_t f = 0; f < faces.size(); ++f)
    faces_.col(static_cast<Eigen::Index>(f)) = nodes_of_face(scene.body, faces[f]);
}

template <int Dim>
void FluidEffect<Dim>::add_forces(double dt, const StateOf<Dim>& state, PointsOf<Dim>& force) {
  const bool is_everywhere = !std::isfinite(fluid_.level);
  drag_.setZero();
  for (Eigen::Index f = 0; f < faces_.cols(); ++f) {
    const Eigen::Matrix<int, Dim, 1> face = faces_.col(f);
    const VectorOf<Dim> area = area_of_face<Dim>(state.x, face);
    const double size = area.norm();
    if (!(size > 0)) continue;
    const VectorOf<Dim> normal = area / size;
    std::array<double, Dim> pressure{};
    std::array<bool, Dim> is_wet{};
    double sum = 0;
    for (int k = 0; k < Dim; ++k) {
      const auto n = static_cast<std::size_t>(k);
      const double depth = (is_everywhere ? 0 : fluid_.level) - up_.dot(state.x.col(face[k]));
      is_wet[n] = is_everywhere || depth > 0;
      pressure[n] = is_wet[n] ? fluid_.density * gravity_ * depth : 0;
      sum += pressure[n];
    }
    for (int k = 0; k < Dim; ++k) {
      const auto n = static_cast<std::size_t>(k);
      force.col(face[k]) -= (pressure[n] + sum) / (Dim * (Dim + 1)) * area;
      if (!is_wet[n]) continue;
      const VectorOf<Dim> through = state.v.col(face[k]) - fluid_.velocity;
      const double ahead = normal.dot(through);
      const VectorOf<Dim> along = through - ahead * normal;
      VectorOf<Dim> resistance = fluid_.drag_along * along.norm() * along;
      if (ahead > 0) resistance += fluid_.drag * ahead * ahead * normal;
      drag_.col(face[k]) -= 0.5 * fluid_.density * size / Dim * resistance;
    }
  }
  for (Eigen::Index i = 0; i < drag_.cols(); ++i) {
    const double pull = drag_.col(i).norm();
    if (!(pull > 0)) continue;
    const double speed = (state.v.col(i) - fluid_.velocity).norm();
    force.col(i) += drag_.col(i) / (1 + dt * pull / (scene_.body.mass[i] * speed));
  }
}

template class FluidEffect<2>;
template class FluidEffect<3>;

}  // namespace hydrostat::physics
