#include "retarget/tensor_field.h"

#include <Eigen/SparseCholesky>
#include <vector>

#include "retarget/mesh_places.h"

namespace hydrostat::retarget {
namespace {

constexpr double kFieldCalm = 1e-2;  // per squared difference of the tensors at a constraint's ends

using Direction = Eigen::Matrix<double, 6, 1>;

/// What a tensor is along a direction, as coefficients of its six numbers.
Direction along(const Eigen::Vector3d& n) {
  Direction c;
  c << n.x() * n.x(), n.y() * n.y(), n.z() * n.z(), 2 * n.x() * n.y(), 2 * n.y() * n.z(), 2 * n.x() * n.z();
  return c;
}

}  // namespace

Eigen::MatrixXd tensors_along(const Eigen::Ref<const Eigen::Matrix3Xd>& rest,
                              const Eigen::Ref<const Eigen::Matrix2Xi>& edges,
                              const Eigen::Ref<const Eigen::MatrixXd>& values) {
  std::vector<Eigen::Triplet<double>> terms;
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(6 * rest.cols(), values.cols());
  for (Eigen::Index e = 0; e < edges.cols(); ++e) {
    const int ends[] = {edges(0, e), edges(1, e)};
    const Direction row = 0.5 * along((rest.col(ends[1]) - rest.col(ends[0])).normalized());
    for (const int i : ends) {
      right.middleRows<6>(6 * i) += row * values.row(e);
      for (const int j : ends) {
        for (int r = 0; r < 6; ++r) {
          for (int c = 0; c < 6; ++c) {
            const double calm = r == c ? (i == j ? kFieldCalm : -kFieldCalm) : 0;
            terms.emplace_back(6 * i + r, 6 * j + c, row[r] * row[c] + calm);
          }
        }
      }
    }
  }
  Eigen::SparseMatrix<double> normal(6 * rest.cols(), 6 * rest.cols());
  normal.setFromTriplets(terms.begin(), terms.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(normal);
  return factor.solve(right);
}

Eigen::MatrixXd values_along(const Eigen::MatrixXd& tensors, const ControlMesh& of, const Eigen::MatrixXd& bone_weights,
                             const ControlMesh& mesh, const Eigen::Matrix2Xi& constraints) {
  constexpr double kOn[] = {1.0 / 6, 0.5, 5.0 / 6};
  const Eigen::Index edges = constraints.cols();
  Eigen::Matrix3Xd points(3, 3 * edges);
  Eigen::MatrixXd bones(mesh.bone_weights.rows(), 3 * edges);
  for (Eigen::Index e = 0; e < edges; ++e) {
    const int i = constraints(0, e), j = constraints(1, e);
    for (int k = 0; k < 3; ++k) {
      points.col(3 * e + k) = (1 - kOn[k]) * mesh.nodes.col(i) + kOn[k] * mesh.nodes.col(j);
      bones.col(3 * e + k) = (1 - kOn[k]) * mesh.bone_weights.col(i) + kOn[k] * mesh.bone_weights.col(j);
    }
  }
  const Places places = locate(of, bone_weights, points, bones);
  Eigen::MatrixXd values = Eigen::MatrixXd::Zero(edges, tensors.cols());
  for (Eigen::Index e = 0; e < edges; ++e) {
    const Direction direction = along((mesh.nodes.col(constraints(1, e)) - mesh.nodes.col(constraints(0, e))).normalized());
    for (int k = 0; k < 3; ++k) {
      for (int c = 0; c < 4; ++c) {
        values.row(e) +=
            places.weights(c, 3 * e + k) / 3 * direction.transpose() * tensors.middleRows<6>(6 * places.nodes(c, 3 * e + k));
      }
    }
  }
  return values;
}

}  // namespace hydrostat::retarget
