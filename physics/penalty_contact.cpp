#include "physics/penalty_contact.h"

#include <algorithm>
#include <cmath>

#include "physics/element_constraint.h"

namespace hydrostat::physics {
namespace {

constexpr double kSinkage = 0.0005;          // of the body's size [-]: how deep one place sinks that bears the whole weight
constexpr int kSweeps = 30;
constexpr double kTolerance = 1e-8;          // [m/s] change of a place's velocity in a sweep
constexpr double kOwnStiffness = 10;         // of a place against the body itself, over that of a cell of the body
constexpr double kOwnReach = 0.01;           // of the body's size [-], beside what its motion needs
constexpr double kWeightOfNoGravity = 9.81;  // [m/s2] takes gravity's place in the contact stiffness where there is none

/// About the force over the stretch of one cell of the body [N/m]: mean Young's modulus times the mean edge (2D: times a metre).
template <int Dim>
double cell_stiffness(const BodyOf<Dim>& body) {
  double modulus_volume = 0;  // make_body's rule turned round
  for (int e = 0; e < body.edge_count(); ++e) {
    modulus_volume += body.edge_stiffness[e] * body.rest_length[e] * body.rest_length[e] / kEdgesPerTet<Dim>;
  }
  for (const BodyElements<Dim>& elements : body.elements) {
    for (int e = 0; e < elements.block.element_count(); ++e) modulus_volume += youngs_modulus_times_volume(elements.block, e);
  }
  return modulus_volume / body.rest_volume.sum() * (Dim == 3 ? body.rest_length.mean() : 1);
}

}  // namespace

template <int Dim>
PenaltyContact<Dim>::PenaltyContact(const SceneOf<Dim>& scene)
    : set_(scene),
      stretch_(PointsOf<Dim>::Zero(Dim, set_.slot_count())),
      depth_at_rest_(Eigen::VectorXd::Zero(set_.slot_count())),
      touching_(static_cast<std::size_t>(set_.slot_count()), 0) {
  const double gravity = scene.gravity.norm();
  size_ = size_of_volume<Dim>(scene.body.rest_volume.sum());
  stiffness_ = scene.body.mass.sum() * (gravity > 0 ? gravity : kWeightOfNoGravity) / (kSinkage * size_);
  if (has_internal()) own_stiffness_ = std::max(stiffness_, kOwnStiffness * cell_stiffness(scene.body));
  push_out_speed_ = push_out_speed(scene);
  touches_.reserve(static_cast<std::size_t>(set_.slot_count()));
}

template <int Dim>
void PenaltyContact<Dim>::forget() {
  std::fill(touching_.begin(), touching_.end(), 0);
  set_.forget();
}

template <int Dim>
ContactWork PenaltyContact<Dim>::work() const {
  ContactWork work = work_;
  return work += set_.work();
}

template <int Dim>
void PenaltyContact<Dim>::begin(const StateOf<Dim>& start, const PointsOf<Dim>& foreseen, double dt, double reach) {
  touches_.clear();
  travel_ = start.obstacle_travel;
  set_.move_obstacles(dt, travel_);
  double own_reach = 0;
  if (has_internal()) {
    for (Eigen::Index i = 0; i < foreseen.cols(); ++i) {
      own_reach = std::max(own_reach, std::max((foreseen.col(i) - start.x.col(i)).norm(), dt * start.v.col(i).norm()));
    }
    own_reach += kOwnReach * size_;
  }
  set_.find(start, reach, own_reach);
  for (ContactOf<Dim>& contact : set_.candidates()) {
    const PointsOf<Dim>& x = contact.is_internal() ? start.x : foreseen;
    set_.update(x, travel_, contact);
    if (!std::isfinite(contact.gap)) continue;
    touches_.emplace_back();
    Touch& touch = touches_.back();
    touch.contact = contact;
    touch.friction_normal = contact.normal;
    touch.plane_offset = contact.normal.dot(contact.of(x)) - contact.gap;
    touch.stiffness = contact.is_internal() ? own_stiffness_ : stiffness_;
    lay_anchor(start, dt, touch);
  }
}

template <int Dim>
void PenaltyContact<Dim>::lay_anchor(const StateOf<Dim>& start, double dt, Touch& touch) const {
  const int slot = touch.contact.slot;
  const bool goes_on = touching_[static_cast<std::size_t>(slot)] != 0;
  touch.anchor = touch.contact.of(start.x) + dt * set_.velocity(touch.contact);
  if (goes_on) touch.anchor -= stretch_.col(slot);
  VectorOf<Dim> normal;
  double deep = depth_at_rest_[slot];
  touch.depth_at_rest = 0;
  if (!goes_on || deep > 0) {
    // The surface as it was when the step began.
    const double below = std::max(0.0, depth(touch, start.x, normal) - dt * normal.dot(set_.velocity(touch.contact)));
    if (!goes_on) deep = below;
    const double lift = std::min(deep, dt * push_out_speed_), pressed = std::max(0.0, below - deep);
    touch.lift_work = touch.stiffness * (pressed + 0.5 * lift) * lift;
    deep -= lift;
  }
  touch.depth_at_rest = deep;
}

/// Of the place below its spring's rest [m]; negative where it is free.
template <int Dim>
double PenaltyContact<Dim>::depth(const Touch& touch, const PointsOf<Dim>& x, VectorOf<Dim>& normal) const {
  if (touch.contact.point_count == 1) return -set_.gap(x, travel_, touch.contact, normal) - touch.depth_at_rest;
  normal = touch.contact.normal;
  return touch.plane_offset - normal.dot(touch.contact.of(x)) - touch.depth_at_rest;
}

/// From a place's anchor to the place, along the surface [m].
template <int Dim>
VectorOf<Dim> PenaltyContact<Dim>::slip(const Touch& touch, const PointsOf<Dim>& x) const {
  const VectorOf<Dim> whole = touch.contact.of(x) - touch.anchor;
  return whole - touch.friction_normal.dot(whole) * touch.friction_normal;
}

template <int Dim>
void PenaltyContact<Dim>::update_friction(const PointsOf<Dim>& x) {
  work_.looks += static_cast<double>(touches_.size());
  for (Touch& touch : touches_) {
    touch.last_limit = touch.limit;
    touch.limit = set_.friction(touch.contact) * touch.stiffness * std::max(0.0, depth(touch, x, touch.friction_normal));
  }
}

template <int Dim>
void PenaltyContact<Dim>::shorten_friction_update(double part) {
  for (Touch& touch : touches_) touch.limit = part * touch.limit + (1 - part) * touch.last_limit;
}

template <int Dim>
double PenaltyContact<Dim>::potential(const PointsOf<Dim>& x) {
  work_.looks += static_cast<double>(touches_.size());
  double sum = 0;
  VectorOf<Dim> normal;
  for (const Touch& touch : touches_) {
    const double deep = std::max(0.0, depth(touch, x, normal));
    if (deep > 0 || touch.limit > 0) ++work_.pushes;
    sum += 0.5 * touch.stiffness * deep * deep;
    if (touch.limit == 0) continue;
    const double distance = slip(touch, x).norm(), pull = touch.stiffness * distance;
    sum += pull <= touch.limit ? 0.5 * pull * distance : touch.limit * (distance - 0.5 * touch.limit / touch.stiffness);
  }
  return sum;
}

template <int Dim>
void PenaltyContact<Dim>::add_forces(const PointsOf<Dim>& x, PointsOf<Dim>& force) {
  work_.looks += static_cast<double>(touches_.size());
  VectorOf<Dim> normal;
  for (Touch& touch : touches_) {
    touch.force.setZero();
    const double deep = depth(touch, x, normal);
    if (deep > 0 || touch.limit > 0) ++work_.pushes;
    if (deep > 0) touch.force = touch.stiffness * deep * normal;
    if (touch.limit > 0) {
      const VectorOf<Dim> from_anchor = slip(touch, x);
      const double pull = touch.stiffness * from_anchor.norm();
      touch.force -= (touch.stiffness * (pull > touch.limit ? touch.limit / pull : 1)) * from_anchor;
    }
    for (int k = 0; k < touch.contact.node_count; ++k) {
      const auto n = static_cast<std::size_t>(k);
      force.col(touch.contact.nodes[n]) += touch.contact.weights[n] * touch.force;
    }
  }
}

template <int Dim>
void PenaltyContact<Dim>::add_stiffness(const PointsOf<Dim>& x, double factor, SystemMatrixOf<Dim>& matrix) {
  work_.looks += static_cast<double>(touches_.size());
  VectorOf<Dim> normal;
  for (const Touch& touch : touches_) {
    BlockOf<Dim> block = BlockOf<Dim>::Zero();
    if (depth(touch, x, normal) > 0) block = touch.stiffness * normal * normal.transpose();
    if (touch.limit > 0) {
      const VectorOf<Dim> from_anchor = slip(touch, x);
      const double distance = from_anchor.norm();
      BlockOf<Dim> tangential = BlockOf<Dim>::Identity() - touch.friction_normal * touch.friction_normal.transpose();
      if (touch.stiffness * distance > touch.limit) {
        tangential -= from_anchor * from_anchor.transpose() / (distance * distance);
        tangential *= touch.limit / distance;
      } else {
        tangential *= touch.stiffness;
      }
      block += tangential;
    }
    const ContactOf<Dim>& contact = touch.contact;
    if (!block.isZero(0)) ++work_.pushes;
    if (!contact.is_internal()) {
      matrix.add_contact(contact.node_count, contact.nodes.data(), contact.weights.data(), factor * block);
    } else if (!block.isZero(0)) {
      matrix.add_coupling(contact.node_count, contact.nodes.data(), contact.weights.data(), factor * block);
    }
  }
}

template <int Dim>
double PenaltyContact<Dim>::lift_work() const {
  double sum = 0;
  for (const Touch& touch : touches_) sum += touch.lift_work;
  return sum;
}

template <int Dim>
void PenaltyContact<Dim>::book(double dt, const PointsOf<Dim>& x, ImpulsesOf<Dim>& impulses) const {
  for (const Touch& touch : touches_) {
    const ContactOf<Dim>& contact = touch.contact;
    const VectorOf<Dim> impulse = dt * touch.force;
    impulses.obstacle_work += impulse.dot(set_.velocity(contact));
    PointsOf<Dim>& of_nodes = contact.is_internal() ? impulses.internal_nodes : impulses.contact_nodes;
    for (int k = 0; k < contact.node_count; ++k) {
      const auto n = static_cast<std::size_t>(k);
      of_nodes.col(contact.nodes[n]) += contact.weights[n] * impulse;
    }
    if (contact.is_internal()) continue;
    for (int k = 0; k < contact.point_count; ++k) {
      const auto n = static_cast<std::size_t>(k);
      impulses.contact.col(contact.points[n]) += contact.shares[n] * impulse;
    }
    impulses.contact_moment += cross<Dim>(contact.of(x), impulse);
  }
}

template <int Dim>
void PenaltyContact<Dim>::stop_approach(const PointsOf<Dim>& x, const Eigen::VectorXd& inverse_mass, PointsOf<Dim>& v) {
  work_.looks += static_cast<double>(touches_.size());
  VectorOf<Dim> normal;
  for (Touch& touch : touches_) {
    touch.force.setZero();  // impulses from here on
    touch.stops = depth(touch, x, normal) > 0 && touch.contact.inverse_mass > 0;
    if (!touch.stops) continue;
    touch.contact.normal = normal;
    if (touch.contact.is_internal()) {
      ContactOf<Dim> at_end = touch.contact;
      set_.carry(x, at_end);
      touch.stops = at_end.inverse_mass > 0;
      touch.start_weights = touch.contact.weights;
      touch.contact = at_end;
    }
  }
  for (int k = 0; k < kSweeps; ++k) {
    double change = 0;
    for (Touch& touch : touches_) {
      if (!touch.stops) continue;
      ++work_.pushes;
      const ContactOf<Dim>& contact = touch.contact;
      const VectorOf<Dim> velocity = contact.of(v) - set_.velocity(contact);
      const VectorOf<Dim> wanted = impulse_in_cone<Dim>(contact, velocity, 0, set_.friction(contact), touch.force);
      const VectorOf<Dim> step = wanted - touch.force;
      change = std::max(change, step.norm() * contact.inverse_mass);
      touch.force = wanted;
      for (int n = 0; n < contact.node_count; ++n) {
        const auto node = static_cast<std::size_t>(n);
        v.col(contact.nodes[node]) += (contact.weights[node] * inverse_mass[contact.nodes[node]]) * step;
      }
    }
    if (change < kTolerance) break;
  }
}

template <int Dim>
void PenaltyContact<Dim>::end(const PointsOf<Dim>& x, PointsOf<Dim>& obstacle_travel) {
  std::fill(touching_.begin(), touching_.end(), 0);
  work_.looks += static_cast<double>(touches_.size());
  VectorOf<Dim> normal;
  for (Touch& touch : touches_) {
    if (touch.stops && touch.contact.is_internal()) touch.contact.weights = touch.start_weights;
    const int slot = touch.contact.slot;
    const bool touches = touch.limit > 0 || depth(touch, x, normal) > 0;
    touching_[static_cast<std::size_t>(slot)] = touches ? 1 : 0;
    if (!touches) continue;
    const VectorOf<Dim> from_anchor = slip(touch, x);
    const double pull = touch.stiffness * from_anchor.norm();
    stretch_.col(slot) = (pull > touch.limit ? touch.limit / pull : 1) * from_anchor;
    depth_at_rest_[slot] = touch.depth_at_rest;
  }
  obstacle_travel = travel_;
}

template class PenaltyContact<2>;
template class PenaltyContact<3>;

}  // namespace hydrostat::physics
