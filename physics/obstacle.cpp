#include "physics/obstacle.h"

#include <cmath>

namespace hydrostat::physics {
namespace {

template <int Dim>
double box_distance(const VectorOf<Dim>& half_extents, const VectorOf<Dim>& point, VectorOf<Dim>& normal) {
  const VectorOf<Dim> beyond = point.cwiseAbs() - half_extents;
  const VectorOf<Dim> outside = beyond.cwiseMax(0.0);
  const double distance = outside.norm();
  if (distance > 0) {
    for (int d = 0; d < Dim; ++d) normal[d] = std::copysign(outside[d] / distance, point[d]);
    return distance;
  }
  Eigen::Index nearest;
  const double depth = beyond.maxCoeff(&nearest);
  normal.setZero();
  normal[nearest] = std::copysign(1.0, point[nearest]);
  return depth;
}

template <int Dim>
double ball_distance(double radius, const VectorOf<Dim>& point, VectorOf<Dim>& normal) {
  const double distance = point.norm();
  normal = distance > 0 ? VectorOf<Dim>(point / distance) : VectorOf<Dim>::UnitY();
  return distance - radius;
}

}  // namespace

template <int Dim>
double signed_distance(const ObstacleOf<Dim>& obstacle, const VectorOf<Dim>& travel, const VectorOf<Dim>& point,
                       VectorOf<Dim>& normal) {
  const VectorOf<Dim> local = obstacle.turn.transpose() * (point - obstacle.place - travel);
  double distance;
  VectorOf<Dim> local_normal;
  if (const auto* const box = std::get_if<BoxOf<Dim>>(&obstacle.shape)) {
    distance = box_distance<Dim>(box->half_extents, local, local_normal);
  } else if (const auto* const ball = std::get_if<Ball>(&obstacle.shape)) {
    distance = ball_distance<Dim>(ball->radius, local, local_normal);
  } else if (const auto* const mesh = std::get_if<ClosedMeshOf<Dim>>(&obstacle.shape)) {
    distance = mesh->signed_distance(local, local_normal);
  } else {
    distance = local.y();
    local_normal = VectorOf<Dim>::UnitY();
  }
  normal = obstacle.turn * local_normal;
  return distance;
}

template <int Dim>
double distance_at_least(const ObstacleOf<Dim>& obstacle, const VectorOf<Dim>& travel, const VectorOf<Dim>& point) {
  VectorOf<Dim> normal;
  const auto* const mesh = std::get_if<ClosedMeshOf<Dim>>(&obstacle.shape);
  if (mesh == nullptr) return signed_distance(obstacle, travel, point, normal);
  const VectorOf<Dim> local = obstacle.turn.transpose() * (point - obstacle.place - travel);
  return box_distance<Dim>((mesh->high() - mesh->low()) / 2, local - (mesh->high() + mesh->low()) / 2, normal);
}

template <int Dim>
CornersOf<Dim> corners_of(const ObstacleOf<Dim>& obstacle) {
  CornersOf<Dim> corners;
  corners.places.resize(Dim, 0);
  if (const auto* const box = std::get_if<BoxOf<Dim>>(&obstacle.shape)) {
    corners.places.resize(Dim, 1 << Dim);
    for (int c = 0; c < 1 << Dim; ++c) {
      for (int d = 0; d < Dim; ++d) corners.places(d, c) = (c >> d & 1) != 0 ? box->half_extents[d] : -box->half_extents[d];
    }
    corners.normals = corners.places.cwiseSign() / std::sqrt(Dim);
  } else if (const auto* const ball = std::get_if<Ball>(&obstacle.shape)) {
    corners.places.setZero(Dim, 1);
    corners.normals.setZero(Dim, 1);
    corners.radius = ball->radius;
  } else if (const auto* const mesh = std::get_if<ClosedMeshOf<Dim>>(&obstacle.shape)) {
    corners.places = mesh->vertices()(Eigen::all, mesh->convex_vertices());
    corners.normals = mesh->vertex_normals()(Eigen::all, mesh->convex_vertices());
  }
  corners.normals = obstacle.turn * corners.normals;
  corners.places = (obstacle.turn * corners.places).colwise() + obstacle.place;
  return corners;
}

#define HYDROSTAT_INSTANTIATE(Dim)                                                                                          \
  template double signed_distance<Dim>(const ObstacleOf<Dim>&, const VectorOf<Dim>&, const VectorOf<Dim>&, VectorOf<Dim>&); \
  template double distance_at_least<Dim>(const ObstacleOf<Dim>&, const VectorOf<Dim>&, const VectorOf<Dim>&);               \
  template CornersOf<Dim> corners_of<Dim>(const ObstacleOf<Dim>&);
HYDROSTAT_INSTANTIATE(2)
HYDROSTAT_INSTANTIATE(3)
#undef HYDROSTAT_INSTANTIATE

}  // namespace hydrostat::physics
