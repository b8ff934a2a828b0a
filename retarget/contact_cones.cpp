#include "retarget/contact_cones.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

namespace hydrostat::retarget {

void cone_rows(const physics::Scene& scene, const std::vector<ContactState>& touching, const std::vector<bool>& bearing,
               const Eigen::Matrix3Xd& force, const Eigen::MatrixXd& approach, const Eigen::VectorXd& now,
               Eigen::MatrixXd& rows) {
  const physics::ContactPoints& points = scene.contact_points;
  const Eigen::Index muscles = approach.cols();
  const Eigen::Vector3d normal = scene.ground.normal, side = normal.unitOrthogonal(), other = normal.cross(side);
  Eigen::Matrix<double, 5, 3> faces;
  faces << normal.transpose(), (scene.ground.friction * normal + side).transpose(),
      (scene.ground.friction * normal - side).transpose(), (scene.ground.friction * normal + other).transpose(),
      (scene.ground.friction * normal - other).transpose();
  const auto faces_of = [&](int p) -> Eigen::Index {
    const auto k = static_cast<std::size_t>(p);
    if (touching[k] == ContactState::kOff || !bearing[k]) return 0;
    return touching[k] == ContactState::kStick ? 5 : 1;
  };
  Eigen::Index count = 0;
  for (int p = 0; p < points.count(); ++p) count += faces_of(p);
  rows.resize(count, muscles + 1);
  Eigen::Matrix3Xd given(3, muscles + 1);
  Eigen::Index row = 0;
  for (int p = 0; p < points.count(); ++p) {
    const Eigen::Index of_point = faces_of(p);
    if (of_point == 0) continue;
    given.setZero();
    for (int c = 0; c < points.nodes.rows(); ++c) {
      given.leftCols(muscles) -= points.weights(c, p) * approach.middleRows<3>(3 * points.nodes(c, p));
    }
    given.col(muscles) = force.col(p) - given.leftCols(muscles) * now;
    rows.middleRows(row, of_point).noalias() = faces.topRows(of_point) * given;
    rows.col(muscles).segment(row, of_point) = rows.col(muscles).segment(row, of_point).cwiseMax(0);
    row += of_point;
  }
}

Eigen::VectorXd solve_within_cones(const Eigen::MatrixXd& hessian, const Eigen::VectorXd& b, const Eigen::MatrixXd& rows,
                                   double weight) {
  constexpr int kTurns = 50, kHalvings = 30;
  constexpr double kDescent = 1e-4;  // of the slope, that a step has to bring
  const Eigen::Index muscles = hessian.rows();
  Eigen::VectorXd w = hessian.selfadjointView<Eigen::Lower>().llt().solve(b);
  if (rows.rows() == 0 || weight == 0) return w;
  const auto margins = [&](const Eigen::VectorXd& at) -> Eigen::VectorXd {
    return rows.leftCols(muscles) * at + rows.col(muscles);
  };
  const auto cost = [&](const Eigen::VectorXd& at, const Eigen::VectorXd& margin) {
    return 0.5 * at.dot(hessian.selfadjointView<Eigen::Lower>() * at) - b.dot(at) +
           0.5 * weight * weight * margin.cwiseMin(0).squaredNorm();
  };
  Eigen::VectorXd margin = margins(w);
  double here = cost(w, margin);
  std::vector<Eigen::Index> outside, outside_before;
  for (int turn = 0; turn < kTurns; ++turn) {
    outside.clear();
    for (Eigen::Index r = 0; r < rows.rows(); ++r) {
      if (margin[r] < 0) outside.push_back(r);
    }
    if (outside == outside_before) break;
    const Eigen::MatrixXd active = weight * rows(outside, Eigen::all);
    Eigen::MatrixXd stiffer = hessian;
    // Of no rows Eigen would divide by zero; they are none where a step that overshot a cone is taken back.
    if (!outside.empty()) stiffer.selfadjointView<Eigen::Lower>().rankUpdate(active.leftCols(muscles).transpose());
    const Eigen::VectorXd gradient =
        hessian.selfadjointView<Eigen::Lower>() * w - b + active.leftCols(muscles).transpose() * (weight * margin(outside));
    const Eigen::VectorXd way = -stiffer.selfadjointView<Eigen::Lower>().llt().solve(gradient);
    double share = 1, there = here;
    Eigen::VectorXd next, next_margin;
    for (int k = 0; k < kHalvings; ++k, share /= 2) {
      next = w + share * way;
      next_margin = margins(next);
      there = cost(next, next_margin);
      if (there <= here + kDescent * share * gradient.dot(way)) break;
    }
    if (!(there < here)) break;
    w = next, margin = next_margin, here = there;
    outside_before = share == 1 ? outside : std::vector<Eigen::Index>{-1};
  }
  return w;
}

}  // namespace hydrostat::retarget
