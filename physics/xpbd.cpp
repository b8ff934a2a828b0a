#include <algorithm>
#include <cmath>
#include <cstdint>

#include "physics/elastic_forces.h"
#include "physics/element_constraint.h"
#include "physics/impulse_contact.h"
#include "physics/stepper.h"

namespace hydrostat::physics {
namespace {

constexpr double kSubstep = 0.002;  // of the time sqrt(D / g) [-]
constexpr double kRunaway = 100;    // of the body's size [-]: what moves as far in a substep has run away

/// Extended position-based dynamics in small substeps of one Gauss-Seidel pass each: stable at every stiffness, softer than
/// the material where its waves cross elements faster than substeps come.
///
/// Constraints are the springs, the volumes and the elements (C = sqrt(2 U) with compliance 1), in the order of a colouring: two of
/// a colour share no node. Dashpots come after the pass, see damp. Linear momentum changes by the booked impulses alone, to rounding.
/// Angular momentum does not: each correction has no moment where it is made, but the places move on before the velocities
/// are taken; what is lost is the method's own and no booked moment covers it. Contact is by impulses on the velocity that
/// moves the body, after the pass.
/// Source: Macklin, Müller, Chentanez, "XPBD", MIG 2016, eq. (18); Macklin et al., "Small steps in physics
/// simulation", SCA 2019, algorithm 1.
template <int Dim>
class XpbdStepper final : public StepperOf<Dim> {
 public:
  explicit XpbdStepper(const SceneOf<Dim>& scene)
      : scene_(scene),
        inverse_mass_(inverse_masses(scene.body)),
        start_{scene.body.rest, scene.body.rest},
        from_(scene.body.rest),
        contact_(scene) {
    const BodyOf<Dim>& body = scene.body;
    const double gravity = scene.gravity.norm();
    size_ = size_of_volume<Dim>(body.rest_volume.sum());
    substep_ = kSubstep * std::sqrt(size_ / (gravity > 0 ? gravity : 9.81));
    if (!body.held.empty()) held_impulse_.setZero(Dim, body.node_count());
    for (const BodyElements<Dim>& elements : body.elements) active_.push_back(make_active_strain(elements.block));
    colour_constraints();
  }

  double substep(double dt) const override { return dt / std::ceil(dt / substep_); }

  StepWork work() const override {
    StepWork work = work_;
    work.by_impulses = contact_.work();
    return work;
  }

  void forget() override { contact_.forget(); }

  Termination step(double dt, const Eigen::VectorXd& activation, const PointsOf<Dim>* effect_force, StateOf<Dim>& state,
                   ImpulsesOf<Dim>& impulses) override {
    const BodyOf<Dim>& body = scene_.body;
    for (std::size_t n = 0; n < active_.size(); ++n) {
      if (!set_activation(body.elements[n].fit, activation, active_[n])) return Termination::kDiverged;
    }
    start_ = state;
    clear(impulses);
    contact_.forget_reach();
    held_impulse_.setZero();
    const int substeps = static_cast<int>(std::ceil(dt / substep_));
    const double h = dt / substeps;
    work_.sweeps += substeps;
    work_.rounds += substeps;
    for (int s = 0; s < substeps; ++s) {
      push(h, effect_force, state, impulses);
      from_ = state.x;
      state.x += h * state.v;
      for (const Constraint& constraint : constraints_) project(constraint, h, activation, state.x);
      state.v = (state.x - from_) / h;
      for (auto e = dashpots_.begin(); e != dashpots_.end(); ++e) damp(*e, 0.5 * h, state);
      for (auto e = dashpots_.rbegin(); e != dashpots_.rend(); ++e) damp(*e, 0.5 * h, state);
      state.x = from_;
      double fastest = 0;
      for (int i = 0; i < body.node_count(); ++i) {
        const double speed_squared = state.v.col(i).squaredNorm();
        if (speed_squared > fastest || std::isnan(speed_squared)) fastest = speed_squared;  // keeps what is not a number
      }
      if (!(h * std::sqrt(fastest) < kRunaway * size_)) {
        state = start_;
        return Termination::kDiverged;
      }
      if (contact_.is_needed()) contact_.push_apart(h, std::sqrt(fastest), state, impulses);
      state.x += h * state.v;
    }
    for (std::size_t n = 0; n < body.held.size(); ++n) {
      const int node = body.held[n];
      impulses.hold.col(static_cast<Eigen::Index>(n)) -= impulses.contact_nodes.col(node) + held_impulse_.col(node);
      if (contact_.has_internal()) impulses.hold.col(static_cast<Eigen::Index>(n)) -= impulses.internal_nodes.col(node);
    }
    return Termination::kDone;
  }

 private:
  enum class Kind : std::uint8_t { kEdge, kVolume, kElement };
  struct Constraint {
    Kind kind;
    int block, index;
  };

  int node_count(const Constraint& constraint) const {
    if (constraint.kind == Kind::kEdge) return 2;
    return constraint.kind == Kind::kVolume ? Dim + 1 : block_of(constraint).nodes_per_element();
  }
  int node(const Constraint& constraint, int k) const {
    if (constraint.kind == Kind::kEdge) return scene_.body.edges(k, constraint.index);
    if (constraint.kind == Kind::kVolume) return scene_.body.tets(k, constraint.index);
    return block_of(constraint).nodes(k, constraint.index);
  }
  const ElementBlock<Dim>& block_of(const Constraint& constraint) const {
    return scene_.body.elements[static_cast<std::size_t>(constraint.block)].block;
  }

  /// Gives each constraint the first colour that none of its nodes has seen, and sorts by colour.
  void colour_constraints() {
    const BodyOf<Dim>& body = scene_.body;
    for (int b = 0; b < static_cast<int>(body.elements.size()); ++b) {
      const int count = body.elements[static_cast<std::size_t>(b)].block.element_count();
      for (int e = 0; e < count; ++e) constraints_.push_back({Kind::kElement, b, e});
    }
    for (int t = 0; t < body.volume_stiffness.size(); ++t) constraints_.push_back({Kind::kVolume, 0, t});
    for (int e = 0; e < body.edge_count(); ++e) {
      if (body.edge_stiffness[e] != 0) constraints_.push_back({Kind::kEdge, 0, e});
      if (body.edge_damping[e] != 0) dashpots_.push_back(e);
    }
    std::vector<std::vector<char>> seen(static_cast<std::size_t>(body.node_count()));
    std::vector<std::vector<Constraint>> colours;
    for (const Constraint& constraint : constraints_) {
      std::size_t colour = 0;
      const auto is_taken = [&] {
        for (int k = 0; k < node_count(constraint); ++k) {
          const std::vector<char>& of_node = seen[static_cast<std::size_t>(node(constraint, k))];
          if (colour < of_node.size() && of_node[colour]) return true;
        }
        return false;
      };
      while (is_taken()) ++colour;
      for (int k = 0; k < node_count(constraint); ++k) {
        std::vector<char>& of_node = seen[static_cast<std::size_t>(node(constraint, k))];
        if (of_node.size() <= colour) of_node.resize(colour + 1, 0);
        of_node[colour] = 1;
      }
      if (colours.size() <= colour) colours.resize(colour + 1);
      colours[colour].push_back(constraint);
    }
    constraints_.clear();
    for (const std::vector<Constraint>& colour : colours) constraints_.insert(constraints_.end(), colour.begin(), colour.end());
  }

  /// Gravity and declared effects, which are booked; held nodes stay.
  void push(double h, const PointsOf<Dim>* effect_force, StateOf<Dim>& state, ImpulsesOf<Dim>& impulses) const {
    const BodyOf<Dim>& body = scene_.body;
    impulses.gravity_moment += h * cross<Dim>(state.x * body.mass, scene_.gravity);
    for (int i = 0; i < body.node_count(); ++i) {
      state.v.col(i) += h * scene_.gravity;
      if (effect_force == nullptr) continue;
      const VectorOf<Dim> impulse = h * effect_force->col(i);
      state.v.col(i) += impulse / body.mass[i];
      impulses.effect_nodes.col(i) += impulse;
      impulses.effect_moment += cross<Dim>(state.x.col(i), impulse);
    }
    for (std::size_t n = 0; n < body.held.size(); ++n) {
      const int node = body.held[n];
      impulses.hold.col(static_cast<Eigen::Index>(n)) -= body.mass[node] * state.v.col(node);
      state.v.col(node).setZero();
    }
  }

  void project(const Constraint& constraint, double h, const Eigen::VectorXd& activation, PointsOf<Dim>& x) {
    switch (constraint.kind) {
      case Kind::kEdge: return project_edge(constraint.index, h, activation, x);
      case Kind::kVolume: return project_volume(constraint.index, h, x);
      case Kind::kElement: return project_element(constraint, h, x);
    }
  }

  /// `push` is the impulse times h [kg m].
  void move(int node, const VectorOf<Dim>& push, double h, PointsOf<Dim>& x) {
    x.col(node) += inverse_mass_[node] * push;
    if (held_impulse_.size() > 0) held_impulse_.col(node) += push / h;
  }

  /// A dashpot on the velocities, as backward Euler has it. A pass over them is a product of contractions, whose eigenvalues may lie
  /// anywhere in the unit circle where they are stiff; what it leaves of the springs' push then turns against them, and feeds the
  /// body. There and back, with half the time each, the product is symmetric, its eigenvalues lie in [0, 1], and it never does.
  void damp(int e, double h, StateOf<Dim>& state) {
    const BodyOf<Dim>& body = scene_.body;
    const int i = body.edges(0, e), j = body.edges(1, e);
    const VectorOf<Dim> span = state.x.col(j) - state.x.col(i);
    const double length = span.norm();
    if (length == 0) return;  // no direction
    const VectorOf<Dim> n = span / length;
    const double damping = body.edge_damping[e] * h, mobility = inverse_mass_[i] + inverse_mass_[j];
    const VectorOf<Dim> impulse = (damping * n.dot(state.v.col(j) - state.v.col(i)) / (1 + damping * mobility)) * n;
    state.v.col(i) += inverse_mass_[i] * impulse;
    state.v.col(j) -= inverse_mass_[j] * impulse;
    if (held_impulse_.size() == 0) return;
    held_impulse_.col(i) += impulse;
    held_impulse_.col(j) -= impulse;
  }

  void project_edge(int e, double h, const Eigen::VectorXd& activation, PointsOf<Dim>& x) {
    const BodyOf<Dim>& body = scene_.body;
    const int i = body.edges(0, e), j = body.edges(1, e);
    const VectorOf<Dim> span = x.col(j) - x.col(i);
    const double length = span.norm();
    if (length == 0) return;  // no direction
    const VectorOf<Dim> n = span / length;
    const double stretch = length - activation[e] * body.rest_length[e], stiffness = body.edge_stiffness[e] * h * h;
    const double pull = stiffness * stretch / (1 + stiffness * (inverse_mass_[i] + inverse_mass_[j]));
    move(i, pull * n, h, x);
    move(j, -pull * n, h, x);
  }

  void project_volume(int t, double h, PointsOf<Dim>& x) {
    const BodyOf<Dim>& body = scene_.body;
    double jacobian;
    const Eigen::Matrix<double, Dim, Dim + 1> gradient =
        jacobian_gradient<Dim>(x, body.tets, t, body.rest_volume[t], jacobian);
    double mobility = 0;
    for (int k = 0; k <= Dim; ++k) mobility += inverse_mass_[body.tets(k, t)] * gradient.col(k).squaredNorm();
    const double stiffness = body.volume_stiffness[t] * h * h;
    const double push = stiffness * (1 - jacobian) / (1 + stiffness * mobility);
    for (int k = 0; k <= Dim; ++k) move(body.tets(k, t), push * gradient.col(k), h, x);
  }

  void project_element(const Constraint& constraint, double h, PointsOf<Dim>& x) {
    const ElementBlock<Dim>& block = block_of(constraint);
    evaluate<Dim>(block, constraint.index, x, active_[static_cast<std::size_t>(constraint.block)], element_);
    double mobility = 0;
    for (int k = 0; k < block.nodes_per_element(); ++k) {
      mobility += inverse_mass_[block.nodes(k, constraint.index)] * element_.gradient.col(k).squaredNorm();
    }
    const double multiplier = -element_.value * h * h / (1 + h * h * mobility);
    for (int k = 0; k < block.nodes_per_element(); ++k) {
      move(block.nodes(k, constraint.index), multiplier * element_.gradient.col(k), h, x);
    }
  }

  const SceneOf<Dim>& scene_;
  Eigen::VectorXd inverse_mass_;  // [1/kg] 0 of held nodes
  StateOf<Dim> start_;
  PointsOf<Dim> from_;  // [m] where the substep starts
  ImpulseContact<Dim> contact_;
  std::vector<ActiveStrain<Dim>> active_;
  std::vector<Constraint> constraints_;
  std::vector<int> dashpots_;  // edges
  ElementConstraint<Dim> element_;
  PointsOf<Dim> held_impulse_;  // [N s] by the constraints on held nodes in this step; empty where none is held
  double substep_ = 0;          // [s] the longest
  double size_ = 0;             // [m]
  StepWork work_;
};

}  // namespace

template <int Dim>
std::unique_ptr<StepperOf<Dim>> make_xpbd_stepper(const SceneOf<Dim>& scene) {
  return std::make_unique<XpbdStepper<Dim>>(scene);
}
template std::unique_ptr<StepperOf<2>> make_xpbd_stepper<2>(const SceneOf<2>&);
template std::unique_ptr<StepperOf<3>> make_xpbd_stepper<3>(const SceneOf<3>&);

}  // namespace hydrostat::physics
