#include "retarget/displacement.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace hydrostat::retarget {
namespace {

double area_of(const Eigen::Matrix3Xd& x, const Eigen::Vector3i& corners) {
  return (x.col(corners[1]) - x.col(corners[0])).cross(x.col(corners[2]) - x.col(corners[0])).norm() / 2;
}

/// T; or nothing.
Eigen::VectorXd filled_shares(const physics::Body& body, double volume_m3) {
  Eigen::VectorXd shares;
  if (!body.elements.empty()) {
    const Eigen::VectorXd& fill = body.elements.front().fill;
    const int tets = body.tet_count() / static_cast<int>(fill.size());  // of an element
    shares = Eigen::VectorXd::NullaryExpr(body.tet_count(), [&](Eigen::Index t) { return fill[t / tets]; });
  } else if (body.volume_stiffness.size() > 0) {
    shares = body.volume_stiffness.cwiseQuotient(body.rest_volume) * (volume_m3 / body.volume_stiffness.sum());
  }
  return shares.cwiseMin(1);
}

}  // namespace

void fit_displacement(const SkinnedMesh& skin, double volume_m3, physics::Body& body) {
  body.displaced_share = filled_shares(body, volume_m3);
  if (body.displaced_share.size() == 0) return;
  double of_skin = 0, of_tets = 0;
  for (const auto corners : skin.triangles.colwise()) of_skin += area_of(skin.vertices, corners);
  for (const physics::SurfaceFace& face : physics::surface_faces(body)) of_tets += area_of(body.rest, physics::nodes_of_face(body, face));
  body.wetted_share = std::min(1.0, of_skin / of_tets);
}

}  // namespace hydrostat::retarget
