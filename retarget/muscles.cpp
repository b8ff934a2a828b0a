#include "retarget/muscles.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace hydrostat::retarget {
namespace {

constexpr int kFields = 9;
const char* const kFieldNames[kFields] = {"stretch", "squeeze_x", "squeeze_y", "shear_xy", "shear_yz", "shear_xz", "bend_x", "bend_y", "twist"};

/// Strain along the unit direction n at place p (both in the bone's frame, p per half width) of field k.
double strain_along(int k, const Eigen::Vector3d& p, const Eigen::Vector3d& n) {
  switch (k) {
    case 0: return n.z() * n.z();
    case 1: return n.x() * n.x();
    case 2: return n.y() * n.y();
    case 3: return 2 * n.x() * n.y();
    case 4: return 2 * n.y() * n.z();
    case 5: return 2 * n.x() * n.z();
    case 6: return p.x() * n.z() * n.z();
    case 7: return p.y() * n.z() * n.z();
    default: return 2 * (p.x() * n.y() - p.y() * n.x()) * n.z();
  }
}

/// Rows of `bone_weights` summed into regions: bone b counts for region[b].
std::vector<int> merge_bones(const Skeleton& skeleton, const Eigen::MatrixXd& bone_weights, const Eigen::VectorXd& mass, int most_regions) {
  const int bones = skeleton.count();
  std::vector<int> region(static_cast<std::size_t>(bones));
  std::vector<double> share(static_cast<std::size_t>(bones));
  const Eigen::VectorXd mass_of_bone = bone_weights * mass;
  for (int b = 0; b < bones; ++b) region[static_cast<std::size_t>(b)] = b, share[static_cast<std::size_t>(b)] = mass_of_bone[b];
  const auto join = [&](int from, int into) {
    for (int& r : region) r = r == from ? into : r;
    share[static_cast<std::size_t>(into)] += share[static_cast<std::size_t>(from)];
    share[static_cast<std::size_t>(from)] = 0;
  };
  for (;;) {
    int smallest = -1, living = 0;
    for (int b = 0; b < bones; ++b) {
      if (region[static_cast<std::size_t>(b)] != b) continue;
      ++living;
      if (smallest < 0 || share[static_cast<std::size_t>(b)] < share[static_cast<std::size_t>(smallest)]) smallest = b;
    }
    if (living <= 1 || (living <= most_regions && share[static_cast<std::size_t>(smallest)] > 0.004 * mass.sum())) return region;
    // It joins the region above it; the topmost region joins the first one below it, a tree of its own any other.
    int above = -1, below = -1, other = -1;
    for (int b = 0; b < bones; ++b) {
      const int its = region[static_cast<std::size_t>(b)], parent = skeleton.parents[static_cast<std::size_t>(b)];
      const int of_parent = parent < 0 ? its : region[static_cast<std::size_t>(parent)];
      if (its == smallest && of_parent != smallest && above < 0) above = of_parent;
      if (its != smallest && of_parent == smallest && below < 0) below = its;
      if (its != smallest && other < 0) other = its;
    }
    const int into = above >= 0 ? above : below >= 0 ? below : other;
    join(smallest, into);
  }
}

}  // namespace

Muscles make_muscles(const physics::Body& body, const Skeleton& skeleton, const Eigen::MatrixXd& bone_weights, int most_regions) {
  const int bones = skeleton.count(), edges = body.edge_count();
  const std::vector<int> region = merge_bones(skeleton, bone_weights, body.mass, most_regions);
  Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(bones, body.node_count());
  for (int b = 0; b < bones; ++b) weights.row(region[static_cast<std::size_t>(b)]) += bone_weights.row(b);

  Muscles muscles;
  std::vector<Eigen::VectorXd> columns;
  Eigen::VectorXd best = Eigen::VectorXd::Constant(edges, -1);
  muscles.edge_bone.resize(static_cast<std::size_t>(edges));
  for (int b = 0; b < bones; ++b) {
    if (region[static_cast<std::size_t>(b)] != b) continue;
    const Eigen::VectorXd owned = weights.row(b).transpose().cwiseProduct(body.mass);
    if (owned.sum() <= 0) continue;
    const std::string& name = skeleton.names[static_cast<std::size_t>(b)];
    // z: from the bone's origin to the middle of what it owns beyond, else its region's longest axis.
    const Eigen::Vector3d centre = body.rest * owned / owned.sum();
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (int i = 0; i < body.node_count(); ++i) {
      const Eigen::Vector3d arm = body.rest.col(i) - centre;
      spread += owned[i] / owned.sum() * arm * arm.transpose();
    }
    Eigen::Vector3d along = centre - skeleton.bind_pose[static_cast<std::size_t>(b)].translation();
    if (along.norm() < 0.3 * std::sqrt(spread.trace())) along = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(2);
    along.normalize();
    Eigen::Vector3d across = Eigen::Vector3d::UnitX() - along.x() * along;
    if (across.norm() < 0.5) across = Eigen::Vector3d::UnitZ() - along.z() * along;
    Eigen::Matrix3d axes;
    axes.col(2) = along;
    axes.col(0) = across.normalized();
    axes.col(1) = along.cross(axes.col(0));
    const Eigen::Vector3d half = (axes.transpose() * spread * axes).diagonal().cwiseSqrt() * 1.7 + Eigen::Vector3d::Constant(1e-9);
    Eigen::MatrixXd fields(edges, kFields);
    for (int e = 0; e < edges; ++e) {
      const int i = body.edges(0, e), j = body.edges(1, e);
      const double weight = 0.5 * (weights(b, i) + weights(b, j));
      if (weight > best[e]) {
        best[e] = weight;
        muscles.edge_bone[static_cast<std::size_t>(e)] = name;
      }
      const Eigen::Vector3d n = axes.transpose() * (body.rest.col(j) - body.rest.col(i)).normalized();
      const Eigen::Vector3d p = (axes.transpose() * (0.5 * (body.rest.col(i) + body.rest.col(j)) - centre)).cwiseQuotient(half);
      for (int k = 0; k < kFields; ++k) fields(e, k) = weight * strain_along(k, p, n);
    }
    for (int k = 0; k < kFields; ++k) {
      const double largest = fields.col(k).cwiseAbs().maxCoeff();
      if (largest < 1e-6) continue;
      columns.push_back(fields.col(k) / largest);
      muscles.names.push_back(name + "/" + kFieldNames[k]);
    }
  }
  muscles.fields.resize(edges, static_cast<Eigen::Index>(columns.size()));
  for (std::size_t k = 0; k < columns.size(); ++k) muscles.fields.col(static_cast<Eigen::Index>(k)) = columns[k];
  return muscles;
}

}  // namespace hydrostat::retarget
