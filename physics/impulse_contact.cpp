#include "physics/impulse_contact.h"

#include <algorithm>
#include <cmath>

namespace hydrostat::physics {
namespace {

constexpr double kReach = 0.1;  // of the shortest edge [-]: places as near as that are watched
constexpr int kSweeps = 30;
constexpr double kTolerance = 1e-7;  // [m/s] change of a place's velocity in a sweep

}  // namespace

template <int Dim>
ImpulseContact<Dim>::ImpulseContact(const SceneOf<Dim>& scene)
    : set_(scene), inverse_mass_(inverse_masses(scene.body)), impulse_(PointsOf<Dim>::Zero(Dim, set_.slot_count())), given_(impulse_) {
  shortest_edge_ = scene.body.rest_length.minCoeff();
  push_out_speed_ = push_out_speed(scene);
  active_.reserve(static_cast<std::size_t>(set_.slot_count()));
  is_candidate_.resize(static_cast<std::size_t>(set_.slot_count()));
}

template <int Dim>
ContactWork ImpulseContact<Dim>::work() const {
  ContactWork work = set_.work();
  work.pushes += pushes_;
  return work;
}

template <int Dim>
void ImpulseContact<Dim>::find_candidates(double farther, const StateOf<Dim>& state) {
  reach_ = kReach * shortest_edge_;
  const bool had_none = set_.candidates().empty();
  set_.find(state, reach_ + farther);
  if (had_none && set_.candidates().empty()) return;
  std::fill(is_candidate_.begin(), is_candidate_.end(), 0);
  for (const ContactOf<Dim>& contact : set_.candidates()) is_candidate_[static_cast<std::size_t>(contact.slot)] = 1;
  for (std::size_t s = 0; s < is_candidate_.size(); ++s) {
    if (is_candidate_[s]) continue;
    impulse_.col(static_cast<Eigen::Index>(s)).setZero();
    given_.col(static_cast<Eigen::Index>(s)).setZero();
  }
}

template <int Dim>
void ImpulseContact<Dim>::apply(const ContactOf<Dim>& contact, const VectorOf<Dim>& impulse, StateOf<Dim>& state) const {
  for (int k = 0; k < contact.node_count; ++k) {
    const auto n = static_cast<std::size_t>(k);
    state.v.col(contact.nodes[n]) += (contact.weights[n] * inverse_mass_[contact.nodes[n]]) * impulse;
  }
}

template <int Dim>
void ImpulseContact<Dim>::gather_active(double h, StateOf<Dim>& state) {
  active_.clear();
  std::vector<ContactOf<Dim>>& candidates = set_.candidates();
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    ContactOf<Dim>& contact = candidates[c];
    set_.update(state.x, state.obstacle_travel, contact);
    if (!std::isfinite(contact.gap) || contact.inverse_mass == 0) {
      impulse_.col(contact.slot).setZero();
      continue;
    }
    const VectorOf<Dim> velocity = contact.of(state.v) - set_.velocity(contact);
    if (contact.gap + h * contact.normal.dot(velocity) < 0 || impulse_.col(contact.slot).squaredNorm() > 0) {
      active_.push_back({static_cast<int>(c), std::min(-contact.gap / h, push_out_speed_)});
      if (!has_given_) apply(contact, impulse_.col(contact.slot), state);  // warm start
    }
  }
}

/// Returns the largest change of a place's velocity [m/s].
template <int Dim>
double ImpulseContact<Dim>::sweep(StateOf<Dim>& state) {
  pushes_ += static_cast<double>(active_.size());
  double change = 0;
  for (const Active& active : active_) {
    const ContactOf<Dim>& contact = set_.candidates()[static_cast<std::size_t>(active.candidate)];
    const VectorOf<Dim> velocity = contact.of(state.v) - set_.velocity(contact);
    const VectorOf<Dim> wanted = impulse_in_cone<Dim>(contact, velocity, active.least_velocity, set_.friction(contact),
                                                      impulse_.col(contact.slot));
    const VectorOf<Dim> step = wanted - impulse_.col(contact.slot);
    change = std::max(change, step.norm() * contact.inverse_mass);
    impulse_.col(contact.slot) = wanted;
    apply(contact, step, state);
  }
  return change;
}

/// What these forces lack is measured on places that the dashpots tied to others within the substep: of what is lacking in all it is
/// phi (DashpotStages), 1 at most, so that the forces come to it without swinging. More than that at once would let them swing where phi
/// is near 1, and feet slip whenever the normal force is at its least.
template <int Dim>
void ImpulseContact<Dim>::add_last_forces(double h, const StateOf<Dim>& state, PointsOf<Dim>& force, ImpulsesOf<Dim>& impulses) {
  has_given_ = true;
  for (ContactOf<Dim>& contact : set_.candidates()) {
    given_.col(contact.slot).setZero();
    if (impulse_.col(contact.slot).squaredNorm() == 0) continue;
    set_.update(state.x, state.obstacle_travel, contact);
    if (!std::isfinite(contact.gap) || contact.inverse_mass == 0) {
      impulse_.col(contact.slot).setZero();
      continue;
    }
    const VectorOf<Dim> last = (h / last_h_) * impulse_.col(contact.slot);  // its normal was another
    const VectorOf<Dim> next = impulse_in_cone<Dim>(contact, VectorOf<Dim>::Zero(), 0, set_.friction(contact), last);
    impulse_.col(contact.slot) = next;
    given_.col(contact.slot) = next;
    for (int k = 0; k < contact.node_count; ++k) {
      const auto n = static_cast<std::size_t>(k);
      if (inverse_mass_[contact.nodes[n]] > 0) force.col(contact.nodes[n]) += (contact.weights[n] / h) * next;
    }
    book(contact, next, state, impulses);
    impulses.obstacle_work += next.dot(set_.velocity(contact));
  }
}

template <int Dim>
void ImpulseContact<Dim>::push_apart(double h, double fastest, StateOf<Dim>& state, ImpulsesOf<Dim>& impulses) {
  // What contact itself may add to a node's speed is within twice the fastest.
  const double farthest = 2 * h * fastest + h * (push_out_speed_ + set_.fastest_obstacle());
  reach_ -= farthest;
  last_h_ = h;
  if (reach_ < 0) find_candidates(farthest, state);
  if (set_.candidates().empty()) {
    active_.clear();
    has_given_ = false;
    set_.move_obstacles(h, state.obstacle_travel);
    return;
  }
  gather_active(h, state);
  for (int k = 0; k < kSweeps; ++k) {
    if (sweep(state) < kTolerance) break;
  }
  book(state, impulses);
  has_given_ = false;
  set_.move_obstacles(h, state.obstacle_travel);
}

template <int Dim>
void ImpulseContact<Dim>::book(const StateOf<Dim>& state, ImpulsesOf<Dim>& impulses) const {
  for (const Active& active : active_) {
    const ContactOf<Dim>& contact = set_.candidates()[static_cast<std::size_t>(active.candidate)];
    VectorOf<Dim> impulse = impulse_.col(contact.slot);
    impulses.obstacle_work += impulse.dot(std::max(0.0, active.least_velocity) * contact.normal);
    if (has_given_) impulse -= given_.col(contact.slot);
    impulses.obstacle_work += impulse.dot(set_.velocity(contact));
    book(contact, impulse, state, impulses);
  }
}

template <int Dim>
void ImpulseContact<Dim>::book(const ContactOf<Dim>& contact, const VectorOf<Dim>& impulse, const StateOf<Dim>& state,
                               ImpulsesOf<Dim>& impulses) const {
  PointsOf<Dim>& of_nodes = contact.is_internal() ? impulses.internal_nodes : impulses.contact_nodes;
  for (int k = 0; k < contact.node_count; ++k) {
    const auto n = static_cast<std::size_t>(k);
    of_nodes.col(contact.nodes[n]) += contact.weights[n] * impulse;
  }
  if (contact.is_internal()) return;
  for (int k = 0; k < contact.point_count; ++k) {
    const auto n = static_cast<std::size_t>(k);
    impulses.contact.col(contact.points[n]) += contact.shares[n] * impulse;
  }
  impulses.contact_moment += cross<Dim>(contact.of(state.x), impulse);
}

template class ImpulseContact<2>;
template class ImpulseContact<3>;

}  // namespace hydrostat::physics
