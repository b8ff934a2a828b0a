#include "physics/fluid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "physics/face_key.h"
#include "physics/seam.h"

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

/// Faces between two tets of which one displaces more, seen from that one, and how much more [-].
template <int Dim>
std::vector<std::pair<SurfaceFace, double>> uneven_faces(const BodyOf<Dim>& body) {
  constexpr double kLeast = 1e-9;  // rounding of shares that are alike
  std::map<std::array<int, Dim>, SurfaceFace> first;  // by key_of_face
  std::vector<std::pair<SurfaceFace, double>> faces;
  for (int t = 0; t < static_cast<int>(body.displaced_share.size()); ++t) {
    for (int opposite = 0; opposite <= Dim; ++opposite) {
      const SurfaceFace here{t, opposite};
      const auto [entry, is_new] = first.try_emplace(key_of_face(body, here), here);
      if (is_new) continue;
      const SurfaceFace there = entry->second;
      const double more = body.displaced_share[t] - body.displaced_share[there.tet];
      if (std::abs(more) > kLeast) faces.emplace_back(more > 0 ? here : there, std::abs(more));
    }
  }
  return faces;
}

}  // namespace

template <int Dim>
FluidEffect<Dim>::FluidEffect(const SceneOf<Dim>& scene, const FluidOf<Dim>& fluid)
    : scene_(scene), fluid_(fluid), gravity_(scene.gravity.norm()), drag_(Dim, scene.body.node_count()) {
  up_ = VectorOf<Dim>::UnitY();
  if (gravity_ > 0) up_ = -scene.gravity / gravity_;
  const BodyOf<Dim>& body = scene.body;
  const std::vector<SurfaceFace> surface = surface_faces(body);
  const std::vector<std::pair<SurfaceFace, double>> between = uneven_faces(body);
  surface_count_ = static_cast<Eigen::Index>(surface.size());
  faces_.resize(Dim, static_cast<Eigen::Index>(surface.size() + between.size()));
  displaced_share_.setOnes(faces_.cols());
  Eigen::Index f = 0;
  for (const SurfaceFace& face : surface) {
    if (body.displaced_share.size() > 0) displaced_share_[f] = body.displaced_share[face.tet];
    faces_.col(f++) = nodes_of_face(body, face);
  }
  for (const auto& [face, share] : between) {
    displaced_share_[f] = share;
    faces_.col(f++) = nodes_of_face(body, face);
  }
  part_ = parts_of_nodes(body.tets);
  part_mass_.setZero(static_cast<Eigen::Index>(part_.size()));
  for (std::size_t n = 0; n < part_.size(); ++n) part_mass_[part_[n]] += body.mass[static_cast<Eigen::Index>(n)];
  height_.setZero(part_mass_.size());
}

template <int Dim>
void FluidEffect<Dim>::find_heights(const PointsOf<Dim>& x) {
  height_.setZero();
  for (std::size_t n = 0; n < part_.size(); ++n) {
    const auto i = static_cast<Eigen::Index>(n);
    height_[part_[n]] += scene_.body.mass[i] / part_mass_[part_[n]] * up_.dot(x.col(i));
  }
}

template <int Dim>
void FluidEffect<Dim>::add_forces(double dt, const StateOf<Dim>& state, PointsOf<Dim>& force) {
  const bool is_everywhere = !std::isfinite(fluid_.level);
  if (is_everywhere) find_heights(state.x);
  drag_.setZero();
  for (Eigen::Index f = 0; f < faces_.cols(); ++f) {
    const Eigen::Matrix<int, Dim, 1> face = faces_.col(f);
    const VectorOf<Dim> area = area_of_face<Dim>(state.x, face);
    const double size = area.norm();
    if (!(size > 0)) continue;
    const VectorOf<Dim> normal = area / size;
    std::array<double, Dim> pressure{};
    std::array<bool, Dim> is_wet{};
    const double level = is_everywhere ? height_[part_[static_cast<std::size_t>(face[0])]] : fluid_.level;
    double sum = 0;
    for (int k = 0; k < Dim; ++k) {
      const auto n = static_cast<std::size_t>(k);
      const double depth = level - up_.dot(state.x.col(face[k]));
      is_wet[n] = is_everywhere || depth > 0;
      pressure[n] = is_wet[n] ? fluid_.density * gravity_ * depth : 0;
      sum += pressure[n];
    }
    for (int k = 0; k < Dim; ++k) {
      const auto n = static_cast<std::size_t>(k);
      force.col(face[k]) -= displaced_share_[f] * (pressure[n] + sum) / (Dim * (Dim + 1)) * area;
      if (!is_wet[n] || f >= surface_count_) continue;
      const VectorOf<Dim> through = state.v.col(face[k]) - fluid_.velocity;
      const double ahead = normal.dot(through);
      const VectorOf<Dim> along = through - ahead * normal;
      VectorOf<Dim> resistance = fluid_.drag_along * along.norm() * along;
      if (ahead > 0) resistance += fluid_.drag * ahead * ahead * normal;
      drag_.col(face[k]) -= scene_.body.wetted_share * 0.5 * fluid_.density * size / Dim * resistance;
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
