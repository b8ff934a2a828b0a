#include "retarget/corrector.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "retarget/contact_cones.h"
#include "retarget/contact_loads.h"
#include "retarget/dense_product.h"

namespace hydrostat::retarget {
namespace {

constexpr double kContactTime = 1.0 / 30;  // [s] for which contact is as stiff as the usual gain wants it, whatever its horizon
constexpr double kLedFoot = 3;  // times as much weighs a foot on uneven ground, where it is to be put in a place

/// 3N: the squared weight of each row of nodes.
Eigen::VectorXd shares_of_nodes(const physics::Body& body, double weight) {
  return (weight * weight / body.mass.sum()) * body.mass.transpose().replicate<3, 1>().reshaped();
}

/// R x 3N: the projection of fields that `heading` has turned.
Eigen::MatrixXd turned(Eigen::MatrixXd project, const Eigen::Matrix3d& heading) {
  for (Eigen::Index i = 0; i < project.cols(); i += 3) project.middleCols<3>(i) *= heading.transpose();
  return project;
}

}  // namespace

Corrector::Corrector(const physics::Scene& scene, const Muscles& muscles, double length, double limit,
                     const CorrectorOptions& options)
    : scene_(scene),
      muscles_(muscles),
      options_(options),
      length_(length),
      speed_unit_(std::sqrt(gravity_unit(scene) * length)),
      limit_(limit),
      contact_stiffness_(contact_stiffness(scene, length, options.regulator.reach > 0 ? options.horizon_s : kContactTime)),
      node_shares_(shares_of_nodes(scene.body, options.node_weight / speed_unit_)),
      responses_(scene, muscles, options.horizon_s, contact_stiffness_, node_shares_),
      forces_(scene.body) {
  previous_ = Eigen::VectorXd::Zero(muscles.fields.cols());
}

void Corrector::reset() {
  previous_.setZero();
  predicted_.resize(0);
  disturbance_.resize(0);
  responses_.forget();
}

/// What comes of velocities that are so far off, and of the forces beyond the reference's.
void Corrector::solve_free_deviation(const Eigen::Matrix3Xd& velocity) {
  deviation_ = (velocity * scene_.body.mass.asDiagonal() + options_.horizon_s * (force_ - reference_force_)).reshaped();
  responses_.solve_in_place(deviation_);
}

/// What comes without any muscle.
void Corrector::find_free_deviation(const physics::State& state, const physics::State& reference) {
  force_.setZero(3, scene_.body.node_count());
  reference_force_.setZero(3, scene_.body.node_count());
  forces_.add_elastic_forces(state.x, force_);
  forces_.add_elastic_forces(reference.x, reference_force_);
  solve_free_deviation(state.v - reference.v);
}

/// The same by all forces halfway through the step, where those of the `settled` reference balance; dashpots count as they turn with
/// the body.
void Corrector::find_free_deviation_of_settled(const physics::State& state, const physics::State& settled) {
  force_.setZero(3, scene_.body.node_count());
  reference_force_.setZero(3, scene_.body.node_count());
  const Eigen::Matrix3Xd ahead = 0.5 * options_.horizon_s * settled.v;
  forces_.add_forces({state.x + ahead, settled.v}, force_);
  forces_.add_forces({settled.x + ahead, settled.v}, reference_force_);
  solve_free_deviation(state.v - settled.v);
}

/// Velocity of the centre of mass, and the body's turning as the speed at its radius of gyration. Returns how far all six are off, as
/// far as `contact` weighs them, in speeds per sqrt(g L).
double Corrector::weigh_momentum(const physics::State& state, const ContactNow& contact) {
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
  for (const int row : {0, 2, 4}) rows.row(row) *= contact.grip;
  for (const int row : {3, 5}) rows.row(row) *= contact.upright;
  rows *= options_.root_weight / speed_unit_;
  weighted_.topLeftCorner(6, responses_.velocities().cols()).noalias() = rows * responses_.velocities();
  weighted_.topRightCorner<6, 1>().noalias() = rows * deviation_;
  return weighted_.topRightCorner<6, 1>().norm() / options_.root_weight;
}

/// To where the body can be caught, and how soon a foot has to be there.
void Corrector::find_step(const physics::State& state, const physics::State& reference) {
  const physics::Body& body = scene_.body;
  const Eigen::Vector3d up = scene_.ground.normal, com = physics::centre_of_mass(body, reference.x);
  const double height = std::max(0.0, up.dot(com) - scene_.ground.offset), gravity = scene_.gravity.norm();
  const double ahead_s = gravity > 0 ? options_.step_ahead * std::sqrt(height / gravity) : 0;
  const Eigen::Vector3d ahead =
      physics::centre_of_mass(body, state.x) - com + ahead_s * (state.v - reference.v) * body.mass / body.mass.sum();
  step_ = options_.step * (ahead - up.dot(ahead) * up);
  const double long_step = options_.long_step * height;
  haste_ = long_step > 0 ? std::clamp(step_.norm() / long_step - 1, 0.0, 1.0) : 0;
}

/// The mean of each foot in the air, on its way to where it can catch the body.
void Corrector::weigh_feet(const physics::State& state, const physics::State& reference,
                           const ContactNow& contact) {
  const physics::ContactPoints& points = scene_.contact_points;
  const Eigen::Vector3d up = scene_.ground.normal;
  const Eigen::Index last = responses_.velocities().cols();
  Eigen::Index row = 6;
  for (std::size_t k = 0; k < contact.in_air.size(); ++k) {
    const Patch* foot = contact.in_air[k];
    auto mean = weighted_.middleRows<3>(row);
    mean.setZero();
    Eigen::Vector3d error = -step_;
    const double share = 1 / static_cast<double>(foot->points.size());
    double height = std::numeric_limits<double>::infinity();  // of the sole, by plan
    for (const int p : foot->points) {
      for (int c = 0; c < points.nodes.rows(); ++c) {
        const int node = points.nodes(c, p);
        const double weight = share * points.weights(c, p);
        mean.leftCols(last) += weight * responses_.velocities().middleRows<3>(3 * node);
        mean.col(last) += weight * deviation_.segment<3>(3 * node);
      }
      const Eigen::Vector3d planned = points.of(reference.x, p);
      error += share * (points.of(state.x, p) - planned);
      height = std::min(height, up.dot(planned) - scene_.ground.offset);
    }
    // What is led over uneven ground is to clear it first.
    error += contact.lead.empty() ? Eigen::Vector3d(haste_ * std::max(0.0, height) * up) : -contact.lead[k];
    mean.col(last) += error / options_.foot_settle_s;
    mean *= (contact.lead.empty() ? 1 : kLedFoot) * options_.foot_weight / speed_unit_;
    row += 3;
  }
}

std::vector<bool> Corrector::held_to_cones(const ContactNow& contact) const {
  std::vector<bool> held = contact.bearing;
  for (std::size_t p = 0; haste_ > 0 && p < held.size(); ++p) held[p] = held[p] || contact.on_leg[p];
  return held;
}

double Corrector::least_margin() const {
  if (cones_.rows() == 0) return 0;
  return (cones_.leftCols(previous_.size()) * previous_ + cones_.col(previous_.size())).minCoeff();
}

/// Finds the muscles' response; false: nothing is to be added.
bool Corrector::begin(const physics::State& state, const ContactNow& contact, const Eigen::VectorXd& activation, int response_every) {
  forces_.set_activation(activation);
  if (!responses_.update(state, forces_, contact.touching, response_every)) {
    previous_.setZero();
    return false;
  }
  return true;
}

void Corrector::find_cones(const ContactNow& contact) {
  const double weight = scene_.body.mass.sum() * gravity_unit(scene_);
  cone_rows(scene_, contact.touching, held_to_cones(contact), contact.force / weight,
            (contact_stiffness_ * options_.horizon_s / weight) * responses_.velocities(), previous_, cones_);
}

/// By the muscles that are best within the cones.
double Corrector::act(const Eigen::MatrixXd& left, const Eigen::VectorXd& right, Eigen::VectorXd& activation) {
  previous_ = solve_within_cones(left, right, cones_, options_.cone_weight);
  activation += muscles_.fields * previous_;
  activation = activation.cwiseMax(1 - limit_).cwiseMin(1 + limit_);
  return std::sqrt(previous_.squaredNorm() / static_cast<double>(previous_.size()));
}

double Corrector::correct(const physics::State& state, const physics::State& reference, const ContactNow& contact,
                          Eigen::VectorXd& activation) {
  const Eigen::Index muscles = muscles_.fields.cols();
  const bool is_calm = momentum_error_ < options_.calm_error;  // a creature that fights a push needs its response fresh
  if (!begin(state, contact, activation, is_calm ? options_.response_every : 1)) return 0;
  find_free_deviation(state, reference);

  // Rows as speeds per sqrt(g L). Feet come before the error of place is spread over all nodes, for they have their own.
  weighted_.resize(6 + 3 * static_cast<Eigen::Index>(contact.in_air.size()), muscles + 1);
  find_step(state, reference);
  weigh_feet(state, reference, contact);
  find_cones(contact);
  deviation_ += (state.x - reference.x).reshaped() / options_.settle_s;
  momentum_error_ = weigh_momentum(state, contact);

  normal_.setZero(muscles + 1, muscles + 1);
  normal_.selfadjointView<Eigen::Lower>().rankUpdate(weighted_.transpose());
  Eigen::MatrixXd left = responses_.node_normal() + normal_.topLeftCorner(muscles, muscles);
  const Eigen::VectorXd pulled = responses_.velocities().transpose() * node_shares_.cwiseProduct(deviation_);
  const double calm = options_.calm / (1 + std::pow(momentum_error_ / options_.calm_error, 2));
  left.diagonal().array() += options_.effort * (1 + calm) + options_.change;
  const Eigen::VectorXd right = options_.change * previous_ - normal_.row(muscles).head(muscles).transpose() - pulled;
  return act(left, right, activation);
}

/// What the last prediction has missed, for the coming one, where a regulator was at work in the step before.
void Corrector::learn_disturbance(const Eigen::VectorXd& deviation) {
  const RegulatorOptions& options = options_.regulator;
  if (disturbance_.size() == 0) disturbance_.setZero(deviation.size());
  disturbance_ *= options.keep;
  if (predicted_.size() > 0) disturbance_ += options.learn * (deviation - predicted_);
}

double Corrector::regulate(const CostToGo& cost, double time_s, const Eigen::Matrix3d& heading, const physics::State& state,
                           const physics::State& reference, const ContactNow& contact, Eigen::VectorXd& activation) {
  learn_disturbance(deviation_along(cost.modes(), heading, state, reference, length_, speed_unit_));
  predicted_.resize(0);
  if (!begin(state, contact, activation, 1)) return 0;
  find_free_deviation_of_settled(state, cost.settled(time_s, heading, reference));
  find_cones(contact);
  const Eigen::Index modes = cost.modes().count();
  const double step = options_.horizon_s * speed_unit_ / length_, next_s = time_s + options_.horizon_s;
  const Eigen::MatrixXd project = turned(cost.modes().project, heading);
  const Eigen::MatrixXd speeds = product(project, responses_.velocities()) / speed_unit_;  // by each muscle; places go with them
  Eigen::VectorXd free(2 * modes);                                                 // z by no muscle
  free.tail(modes) = project * deviation_ / speed_unit_;
  free.head(modes) = step * free.tail(modes) + project * (state.x - reference.x).reshaped() / length_;
  free += disturbance_;

  const auto [of_speeds, with_step] = by_step(cost.at(next_s).cast<double>(), step);
  const Eigen::VectorXd lasting = options_.regulator.last * (cost.at_disturbed(next_s).cast<double>() * disturbance_);
  const Eigen::VectorXd ahead = cost.pull(next_s).cast<double>() + lasting;
  const Eigen::VectorXd pull = with_step.transpose() * free + step * ahead.head(modes) + ahead.tail(modes);
  Eigen::MatrixXd left = product_of_transposed(speeds, product(of_speeds, speeds));
  left.diagonal().array() += options_.regulator.effort;
  const double rms = act(left, -speeds.transpose() * pull, activation);
  predicted_ = free;
  predicted_.tail(modes) += speeds * previous_;
  predicted_.head(modes) += step * (speeds * previous_);
  return rms;
}

void Corrector::follow(const Eigen::VectorXd& muscles) {
  previous_ = muscles;
  predicted_.resize(0);
  disturbance_ *= options_.regulator.keep;
}

}  // namespace hydrostat::retarget
