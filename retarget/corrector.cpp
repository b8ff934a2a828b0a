#include "retarget/corrector.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>

namespace hydrostat::retarget {

Corrector::Corrector(const physics::Scene& scene, const Muscles& muscles, double length, double limit,
                     const CorrectorOptions& options)
    : scene_(scene),
      muscles_(muscles),
      options_(options),
      speed_unit_(std::sqrt(scene.gravity.norm() * length)),
      limit_(limit),
      matrix_(scene.body),
      forces_(scene.body) {
  previous_ = Eigen::VectorXd::Zero(muscles.fields.cols());
  // Stiff against the body's own springs, soft enough for the factor: a point gives half a thousandth of L under the weight.
  contact_stiffness_ = scene.body.mass.sum() * scene.gravity.norm() / (5e-4 * length);
  for (const physics::BodyElements<3>& elements : scene.body.elements) {
    std::vector<ElementFields>& all = element_fields_.emplace_back();
    for (const auto pairs : elements.fit.of_element.colwise()) {
      const Eigen::MatrixXd rows = muscles.fields(pairs, Eigen::all);
      ElementFields& element = all.emplace_back();
      for (Eigen::Index k = 0; k < rows.cols(); ++k) {
        if (!rows.col(k).isZero(0)) element.muscles.push_back(k);
      }
      element.fields = rows(Eigen::all, element.muscles);
    }
  }
}

/// Adds th B phi for each muscle to its column of the response.
void Corrector::add_response_of_springs(const physics::State& state) {
  const physics::Body& body = scene_.body;
  for (int e = 0; e < body.edge_count(); ++e) {
    if (body.edge_stiffness[e] == 0) continue;
    const int i = body.edges(0, e), j = body.edges(1, e);
    const Eigen::Vector3d push =
        options_.horizon_s * body.edge_stiffness[e] * body.rest_length[e] * (state.x.col(j) - state.x.col(i)).normalized();
    for (Eigen::Index k = 0; k < muscles_.fields.cols(); ++k) {
      const double field = muscles_.fields(e, k);
      if (field == 0) continue;
      response_.col(k).segment<3>(3 * j) += field * push;
      response_.col(k).segment<3>(3 * i) -= field * push;
    }
  }
}

void Corrector::add_response_of_elements(const physics::State& state) {
  for (std::size_t b = 0; b < element_fields_.size(); ++b) {
    const auto& [block, fit, materials, fill] = scene_.body.elements[b];
    for (int e = 0; e < block.element_count(); ++e) {
      const ElementFields& element = element_fields_[b][static_cast<std::size_t>(e)];
      const Eigen::MatrixXd forces = options_.horizon_s *
                                     physics::element_force_per_activation<3>(block, fit, e, state.x, forces_.activation()) *
                                     element.fields;
      for (std::size_t k = 0; k < element.muscles.size(); ++k) {
        for (int n = 0; n < block.nodes_per_element(); ++n) {
          response_.col(element.muscles[k]).segment<3>(3 * block.nodes(n, e)) +=
              forces.col(static_cast<Eigen::Index>(k)).segment<3>(3 * n);
        }
      }
    }
  }
}

double Corrector::correct(const physics::State& state, const physics::State& reference, const std::vector<ContactState>& touching, double grip,
                          Eigen::VectorXd& activation) {
  const physics::Body& body = scene_.body;
  const int nodes = body.node_count();
  const double th = options_.horizon_s, mass = body.mass.sum();
  matrix_.set_zero();
  matrix_.add_mass(body, 1);
  matrix_.add_damping(body, state.x, th);
  forces_.set_activation(activation);
  forces_.add_stiffness(state.x, th * th, matrix_);
  const Eigen::Matrix3d stick_block = th * th * contact_stiffness_ * Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d slide_block = th * th * contact_stiffness_ * scene_.ground.normal * scene_.ground.normal.transpose();
  for (int p = 0; p < scene_.contact_points.count(); ++p) {
    const ContactState state_of_point = touching[static_cast<std::size_t>(p)];
    if (state_of_point == ContactState::kOff) continue;
    matrix_.add_contact(scene_.contact_points, p, state_of_point == ContactState::kStick ? stick_block : slide_block);
  }
  if (!matrix_.factor()) return 0;

  // Columns: th B phi for each muscle, and the free deviation last.
  const Eigen::Index muscles = muscles_.fields.cols();
  response_.resize(3 * nodes, muscles + 1);
  response_.setZero();
  add_response_of_springs(state);
  add_response_of_elements(state);
  force_.setZero(3, nodes);
  reference_force_.setZero(3, nodes);
  forces_.add_elastic_forces(state.x, force_);
  forces_.add_elastic_forces(reference.x, reference_force_);
  for (int i = 0; i < nodes; ++i) {
    response_.col(muscles).segment<3>(3 * i) =
        body.mass[i] * (state.v.col(i) - reference.v.col(i)) + th * (force_.col(i) - reference_force_.col(i));
  }
  matrix_.solve_in_place(response_);
  for (int i = 0; i < nodes; ++i) response_.col(muscles).segment<3>(3 * i) += (state.x.col(i) - reference.x.col(i)) / options_.settle_s;

  // Rows: every node by its share of the mass, then the six rows of momentum, all as speeds per sqrt(g L).
  weighted_.resize(3 * nodes + 6, muscles + 1);
  const Eigen::Vector3d com = physics::centre_of_mass(body, state.x);
  const Eigen::Matrix3d inertia = physics::inertia(body, state.x, com);
  const double gyration = std::sqrt(inertia.trace() / 2 / mass);
  const Eigen::Matrix3d inverse_inertia = inertia.inverse();
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(6, 3 * nodes);
  for (int i = 0; i < nodes; ++i) {
    const Eigen::Vector3d r = state.x.col(i) - com;
    Eigen::Matrix3d cross;
    cross << 0, -r.z(), r.y(), r.z(), 0, -r.x(), -r.y(), r.x(), 0;
    rows.block<3, 3>(0, 3 * i).diagonal().setConstant(body.mass[i] / mass);
    rows.block<3, 3>(3, 3 * i) = gyration * body.mass[i] * inverse_inertia * cross;
    weighted_.middleRows<3>(3 * i) = (options_.node_weight * std::sqrt(body.mass[i] / mass) / speed_unit_) * response_.middleRows<3>(3 * i);
  }
  for (const int row : {0, 2, 4}) rows.row(row) *= grip;
  weighted_.bottomRows<6>().noalias() = (options_.root_weight / speed_unit_) * rows * response_;

  normal_.setZero(muscles + 1, muscles + 1);
  normal_.selfadjointView<Eigen::Lower>().rankUpdate(weighted_.transpose());
  Eigen::MatrixXd left = normal_.topLeftCorner(muscles, muscles);
  left.diagonal().array() += options_.effort + options_.change;
  const Eigen::VectorXd right = options_.change * previous_ - normal_.row(muscles).head(muscles).transpose();
  previous_ = left.selfadjointView<Eigen::Lower>().llt().solve(right);
  activation += muscles_.fields * previous_;
  activation = activation.cwiseMax(1 - limit_).cwiseMin(1 + limit_);
  return std::sqrt(previous_.squaredNorm() / static_cast<double>(muscles));
}

}  // namespace hydrostat::retarget
