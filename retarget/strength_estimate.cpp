#include "retarget/strength_estimate.h"

#include <algorithm>
#include <cmath>

namespace hydrostat::retarget {
namespace {

constexpr double kSmooth = 0.03;                // [s] of each pass
constexpr double kMemory = 1;                   // [s]
constexpr double kUnsure = 0.1;                 // of the plan's strength, before anything was seen
constexpr double kLeast = 0.5, kMostRatio = 2;  // of the ratio, and of that of masses

Eigen::Matrix3d stretching(const Eigen::Matrix3d& moment) {
  const Eigen::Matrix3d symmetric = (moment + moment.transpose()) / 2;
  return symmetric - symmetric.trace() / 3 * Eigen::Matrix3d::Identity();
}

}  // namespace

StrengthEstimate::StrengthEstimate(const physics::Scene& model, double interval_s)
    : model_(model),
      forces_(model.body),
      share_(1 - std::exp(-interval_s / kSmooth)),
      kept_(std::exp(-interval_s / kMemory)),
      steps_alike_(std::max(1.0, 2 * kSmooth / interval_s)),
      force_(3, model.body.node_count()) {}

double StrengthEstimate::mass_ratio() const {
  return momentum_squared_ > 0 && momentum_touch_ > 0 ? std::clamp(momentum_touch_ / momentum_squared_, kLeast, kMostRatio) : 1;
}

/// The mean over the step of the forces that the plan's body would have.
void StrengthEstimate::find_push(double step_s, const physics::State& before, const physics::State& after) {
  force_.setZero();
  for (const double s : {0.5 - std::sqrt(3) / 6, 0.5 + std::sqrt(3) / 6}) {
    const double end = s * s * (3 - 2 * s), leaving = s * (1 - s) * (1 - s), coming = s * s * (s - 1);
    between_.x = before.x + end * (after.x - before.x) + step_s * (leaving * before.v + coming * after.v);
    between_.v = (6 * s * (1 - s) / step_s) * (after.x - before.x) + (1 - s) * (1 - 3 * s) * before.v + s * (3 * s - 2) * after.v;
    forces_.add_forces(between_, force_);
  }
  force_ /= 2;
}

void StrengthEstimate::look(double step_s, const physics::State& before, const physics::State& after,
                            const Eigen::VectorXd& activation, const physics::Impulses& impulses) {
  if (!impulses.effect_nodes.isZero(0) || !forces_.set_activation(activation)) return;
  find_push(step_s, before, after);
  const Eigen::VectorXd& mass = model_.body.mass;
  places_ = (before.x + after.x) / 2;
  places_.colwise() -= (places_ * mass / mass.sum()).eval();
  const Eigen::Matrix3Xd change = (((after.v - before.v) / step_s).colwise() - model_.gravity) * mass.asDiagonal();

  momentum_.add(change.rowwise().sum(), share_);
  touch_.add(impulses.contact_nodes.rowwise().sum() / step_s, share_);
  momentum_squared_ = kept_ * momentum_squared_ + momentum_.twice.squaredNorm();
  momentum_touch_ = kept_ * momentum_touch_ + momentum_.twice.dot(touch_.twice);

  Eigen::Matrix3d wanted = places_ * change.transpose();
  wanted -= places_ * impulses.contact_nodes.transpose() / (mass_ratio() * step_s);
  if (impulses.internal_nodes.size() > 0) wanted -= places_ * impulses.internal_nodes.transpose() / (mass_ratio() * step_s);
  wanted_.add(stretching(wanted), share_);
  push_.add(stretching(places_ * force_.transpose()), share_);
  fit();
}

/// Looks that lie within the smoothing tell the same, so that they count once.
void StrengthEstimate::fit() {
  looks_ = kept_ * looks_ + 1;
  wanted_squared_ = kept_ * wanted_squared_ + wanted_.twice.squaredNorm();
  wanted_push_ = kept_ * wanted_push_ + wanted_.twice.cwiseProduct(push_.twice).sum();
  push_squared_ = kept_ * push_squared_ + push_.twice.squaredNorm();
  if (!(push_squared_ > 0)) return;
  const double fitted = wanted_push_ / push_squared_;
  const double missed = std::max(0.0, wanted_squared_ - fitted * wanted_push_) / push_squared_;
  const double variance = missed * steps_alike_ / looks_, before = kUnsure * kUnsure;
  ratio_ = std::clamp(1 + (fitted - 1) * before / (before + variance), kLeast, kMostRatio);
}

void StrengthEstimate::apply(const Eigen::Matrix3Xd& x, Eigen::VectorXd& activation) const {
  if (ratio_ == 1) return;
  const physics::Body& body = model_.body;
  for (int e = 0; e < body.edge_count(); ++e) {
    const double length = (x.col(body.edges(1, e)) - x.col(body.edges(0, e))).norm() / body.rest_length[e];
    activation[e] = length + (activation[e] - length) / ratio_;
  }
}

}  // namespace hydrostat::retarget
