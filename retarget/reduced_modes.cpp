#include "retarget/reduced_modes.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "retarget/contact_loads.h"
#include "retarget/muscle_response.h"

namespace hydrostat::retarget {
namespace {

constexpr double kTimes[] = {1.0 / 120, 1.0 / 30, 0.1, 0.15};  // [s] for which something acts; without the last, what moves slowly grows unseen
constexpr double kRigidShare = 100;  // a rigid move counts as so many answers: it must not be lost

/// Sums the answers, each as one.
class Snapshots {
 public:
  explicit Snapshots(const physics::Body& body)
      : root_mass_(body.mass.transpose().replicate<3, 1>().reshaped().cwiseSqrt()),
        gram_(Eigen::MatrixXd::Zero(root_mass_.size(), root_mass_.size())) {}

  void take(Eigen::MatrixXd answers, double share) {
    if (answers.cols() == 0) return;  // of what never touches; Eigen would divide by zero
    answers = root_mass_.asDiagonal() * answers;
    for (auto answer : answers.colwise()) {
      if (const double norm = answer.norm(); norm > 0) answer *= share / norm;
    }
    gram_.selfadjointView<Eigen::Lower>().rankUpdate(answers);
  }
  ReducedModes principal(Eigen::Index most) const {
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(gram_);
    const Eigen::MatrixXd axes = solver.eigenvectors().rightCols(std::min(most, gram_.cols()));
    return {root_mass_.cwiseInverse().asDiagonal() * axes, axes.transpose() * root_mass_.asDiagonal()};
  }

 private:
  const Eigen::VectorXd root_mass_;  // 3N
  Eigen::MatrixXd gram_;             // 3N x 3N
};

Eigen::MatrixXd rigid_moves(const physics::Body& body, const Eigen::Matrix3Xd& x) {
  Eigen::MatrixXd moves = Eigen::MatrixXd::Zero(x.size(), 6);
  const Eigen::Vector3d com = physics::centre_of_mass(body, x);
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    for (int c = 0; c < 3; ++c) {
      moves(3 * i + c, c) = 1;
      moves.col(3 + c).segment<3>(3 * i) = Eigen::Vector3d::Unit(c).cross(Eigen::Vector3d(x.col(i) - com));
    }
  }
  return moves;
}

/// Points that touch in one moment at least.
std::vector<int> points_in_use(const std::vector<PlannedMoment>& moments) {
  std::vector<int> used;
  for (std::size_t p = 0; !moments.empty() && p < moments.front().touching.size(); ++p) {
    const auto touches = [p](const PlannedMoment& moment) { return moment.touching[p] != ContactState::kOff; };
    if (std::any_of(moments.begin(), moments.end(), touches)) used.push_back(static_cast<int>(p));
  }
  return used;
}

Eigen::MatrixXd answers_to_contact(const MuscleResponse& response, const physics::ContactPoints& points, const std::vector<int>& used,
                                   Eigen::Index coordinates) {
  Eigen::MatrixXd answers(coordinates, 3 * static_cast<Eigen::Index>(used.size()));
  Eigen::VectorXd answer;
  for (Eigen::Index k = 0; k < answers.cols(); ++k) {
    const int p = used[static_cast<std::size_t>(k / 3)];
    answer.setZero(coordinates);
    for (int c = 0; c < points.nodes.rows(); ++c) answer[3 * points.nodes(c, p) + k % 3] += points.weights(c, p);
    response.solve_in_place(answer);
    answers.col(k) = answer;
  }
  return answers;
}

}  // namespace

ReducedModes find_reduced_modes(const physics::Scene& scene, const Muscles& muscles, const std::vector<PlannedMoment>& moments, double length,
                                int most) {
  const Eigen::Index coordinates = 3 * scene.body.node_count();
  const std::vector<int> used = points_in_use(moments);
  Snapshots snapshots(scene.body);
  physics::InternalForces<3> forces(scene.body);
  for (const double time_s : kTimes) {
    MuscleResponse response(scene, muscles, time_s, contact_stiffness(scene, length, time_s), Eigen::VectorXd::Ones(coordinates));
    for (const PlannedMoment& moment : moments) {
      forces.set_activation(moment.activation);
      snapshots.take(rigid_moves(scene.body, moment.state.x), kRigidShare);
      if (!response.update(moment.state, forces, moment.touching, 1)) continue;
      snapshots.take(response.velocities(), 1);
      snapshots.take(answers_to_contact(response, scene.contact_points, used, coordinates), 1);
    }
  }
  return snapshots.principal(most);
}

}  // namespace hydrostat::retarget
