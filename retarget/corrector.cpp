#include "retarget/corrector.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "retarget/contact_cones.h"
#include "retarget/contact_loads.h"

namespace hydrostat::retarget {

Corrector::Corrector(const physics::Scene& scene, const Muscles& muscles, double length, double limit,
                     const CorrectorOptions& options)
    : scene_(scene),
      muscles_(muscles),
      options_(options),
      speed_unit_(std::sqrt(gravity_unit(scene) * length)),
      limit_(limit),
      matrix_(scene.body),
      forces_(scene.body) {
  previous_ = Eigen::VectorXd::Zero(muscles.fields.cols());
  for (const auto field : muscles.fields.colwise()) {
    std::vector<int>& springs = springs_of_.emplace_back();
    for (int e = 0; e < scene.body.edge_count(); ++e) {
      if (field[e] != 0 && scene.body.edge_stiffness[e] != 0) springs.push_back(e);
    }
  }
  const double unit = options.node_weight / speed_unit_;
  node_shares_ = (unit * unit / scene.body.mass.sum()) * scene.body.mass.transpose().replicate<3, 1>().reshaped();
  // Stiff against the body's own springs, soft enough for the factor: a point gives half a thousandth of L under the weight.
  contact_stiffness_ = scene.body.mass.sum() * gravity_unit(scene) / (5e-4 * length);
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

void Corrector::reset() {
  previous_.setZero();
  has_response_ = false;
}

/// Adds th B phi for each muscle to its column of the response.
void Corrector::add_response_of_springs(const physics::State& state) {
  const physics::Body& body = scene_.body;
  pull_.resize(3, body.edge_count());
  for (int e = 0; e < body.edge_count(); ++e) {
    pull_.col(e) = options_.horizon_s * body.edge_stiffness[e] * body.rest_length[e] *
                   (state.x.col(body.edges(1, e)) - state.x.col(body.edges(0, e))).normalized();
  }
  for (std::size_t k = 0; k < springs_of_.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    for (const int e : springs_of_[k]) {
      const Eigen::Vector3d push = muscles_.fields(e, column) * pull_.col(e);
      response_.col(column).segment<3>(3 * body.edges(1, e)) += push;
      response_.col(column).segment<3>(3 * body.edges(0, e)) -= push;
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

bool Corrector::factor_system(const physics::State& state, const ContactNow& contact) {
  const double th = options_.horizon_s;
  matrix_.set_zero();
  matrix_.add_mass(scene_.body, 1);
  matrix_.add_damping(scene_.body, state.x, th);
  forces_.add_stiffness(state.x, th * th, matrix_);
  const Eigen::Matrix3d stick_block = th * th * contact_stiffness_ * Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d slide_block = th * th * contact_stiffness_ * scene_.ground.normal * scene_.ground.normal.transpose();
  for (int p = 0; p < scene_.contact_points.count(); ++p) {
    const ContactState state_of_point = contact.touching[static_cast<std::size_t>(p)];
    if (state_of_point == ContactState::kOff) continue;
    matrix_.add_contact(scene_.contact_points, p, state_of_point == ContactState::kStick ? stick_block : slide_block);
  }
  return matrix_.factor();
}

/// What the muscles do, A^-1 th B phi for each, and its products. On the path it hardly changes from one control step to the next and
/// is kept for some, while the same points touch; a creature that fights a push needs it fresh. False where the system cannot be
/// factored.
bool Corrector::respond(const physics::State& state, const ContactNow& contact) {
  const bool keeps = has_response_ && momentum_error_ < options_.calm_error && contact.touching == touching_of_response_;
  if (keeps && ++response_age_ < options_.response_every) return true;
  has_response_ = factor_system(state, contact);
  if (!has_response_) return false;
  touching_of_response_ = contact.touching;
  response_age_ = 0;
  response_.setZero(3 * scene_.body.node_count(), muscles_.fields.cols());
  add_response_of_springs(state);
  add_response_of_elements(state);
  matrix_.solve_in_place(response_);
  scaled_ = node_shares_.cwiseSqrt().asDiagonal() * response_;
  node_normal_.setZero(response_.cols(), response_.cols());
  node_normal_.selfadjointView<Eigen::Lower>().rankUpdate(scaled_.transpose());
  return true;
}

void Corrector::find_free_deviation(const physics::State& state, const physics::State& reference) {
  const physics::Body& body = scene_.body;
  force_.setZero(3, body.node_count());
  reference_force_.setZero(3, body.node_count());
  forces_.add_elastic_forces(state.x, force_);
  forces_.add_elastic_forces(reference.x, reference_force_);
  deviation_ = ((state.v - reference.v) * body.mass.asDiagonal() + options_.horizon_s * (force_ - reference_force_)).reshaped();
  matrix_.solve_in_place(deviation_);
}

/// Velocity of the centre of mass, and the body's turning as the speed at its radius of gyration. Returns how far all six are off,
/// in speeds per sqrt(g L).
double Corrector::weigh_momentum(const physics::State& state, double grip) {
  const physics::Body& body = scene_.body;
  const int nodes = body.node_count();
  const double mass = body.mass.sum();
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
  }
  for (const int row : {0, 2, 4}) rows.row(row) *= grip;
  rows *= options_.root_weight / speed_unit_;
  weighted_.topLeftCorner(6, response_.cols()).noalias() = rows * response_;
  weighted_.topRightCorner<6, 1>().noalias() = rows * deviation_;
  return weighted_.topRightCorner<6, 1>().norm() / options_.root_weight;
}

/// The mean of each foot in the air, on its way to where it can catch the body.
void Corrector::weigh_feet(const physics::State& state, const physics::State& reference,
                           const ContactNow& contact) {
  const physics::Body& body = scene_.body;
  const Eigen::Vector3d up = scene_.ground.normal, com = physics::centre_of_mass(body, reference.x);
  const double height = std::max(0.0, up.dot(com) - scene_.ground.offset), gravity = scene_.gravity.norm();
  const double ahead_s = gravity > 0 ? options_.step_ahead * std::sqrt(height / gravity) : 0;
  const Eigen::Vector3d ahead =
      physics::centre_of_mass(body, state.x) - com + ahead_s * (state.v - reference.v) * body.mass / body.mass.sum();
  const Eigen::Vector3d step = options_.step * (ahead - up.dot(ahead) * up);
  const Eigen::Index last = response_.cols();
  Eigen::Index row = 6;
  for (std::size_t k = 0; k < contact.in_air.size(); ++k) {
    const Patch* foot = contact.in_air[k];
    auto mean = weighted_.middleRows<3>(row);
    mean.setZero();
    Eigen::Vector3d error = -step;
    if (!contact.lift.empty()) error -= contact.lift[k] * up;
    const double share = 1 / static_cast<double>(foot->points.size());
    for (const int p : foot->points) {
      for (int c = 0; c < scene_.contact_points.nodes.rows(); ++c) {
        const int node = scene_.contact_points.nodes(c, p);
        const double weight = share * scene_.contact_points.weights(c, p);
        mean.leftCols(last) += weight * response_.middleRows<3>(3 * node);
        mean.col(last) += weight * deviation_.segment<3>(3 * node);
      }
      error += share * (scene_.contact_points.of(state.x, p) - scene_.contact_points.of(reference.x, p));
    }
    mean.col(last) += error / options_.foot_settle_s;
    mean *= options_.foot_weight / speed_unit_;
    row += 3;
  }
}

double Corrector::least_margin() const {
  if (cones_.rows() == 0) return 0;
  return (cones_.leftCols(previous_.size()) * previous_ + cones_.col(previous_.size())).minCoeff();
}

double Corrector::correct(const physics::State& state, const physics::State& reference, const ContactNow& contact,
                          Eigen::VectorXd& activation) {
  const physics::Body& body = scene_.body;
  const Eigen::Index muscles = muscles_.fields.cols();
  forces_.set_activation(activation);
  if (!respond(state, contact)) {
    previous_.setZero();  // nothing is added
    return 0;
  }
  find_free_deviation(state, reference);

  // Rows as speeds per sqrt(g L). Feet come before the error of place is spread over all nodes, for they have their own.
  weighted_.resize(6 + 3 * static_cast<Eigen::Index>(contact.in_air.size()), muscles + 1);
  weigh_feet(state, reference, contact);
  const double weight = body.mass.sum() * gravity_unit(scene_);
  cone_rows(scene_, contact.touching, contact.bearing, contact.force / weight,
            (contact_stiffness_ * options_.horizon_s / weight) * response_, previous_, cones_);
  deviation_ += (state.x - reference.x).reshaped() / options_.settle_s;
  momentum_error_ = weigh_momentum(state, contact.grip);

  normal_.setZero(muscles + 1, muscles + 1);
  normal_.selfadjointView<Eigen::Lower>().rankUpdate(weighted_.transpose());
  Eigen::MatrixXd left = node_normal_ + normal_.topLeftCorner(muscles, muscles);
  const Eigen::VectorXd pulled = response_.transpose() * node_shares_.cwiseProduct(deviation_);
  const double calm = options_.calm / (1 + std::pow(momentum_error_ / options_.calm_error, 2));
  left.diagonal().array() += options_.effort * (1 + calm) + options_.change;
  const Eigen::VectorXd right = options_.change * previous_ - normal_.row(muscles).head(muscles).transpose() - pulled;
  previous_ = solve_within_cones(left, right, cones_, options_.cone_weight);
  activation += muscles_.fields * previous_;
  activation = activation.cwiseMax(1 - limit_).cwiseMin(1 + limit_);
  return std::sqrt(previous_.squaredNorm() / static_cast<double>(muscles));
}

}  // namespace hydrostat::retarget
