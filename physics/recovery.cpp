#include "physics/recovery.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "physics/elastic_forces.h"
#include "physics/impulse_contact.h"
#include "physics/internal_forces.h"
#include "physics/material_rotation.h"

namespace hydrostat::physics {
namespace {

constexpr double kInsideOut = 0.1;    // of the volume [-]: more is led back
constexpr double kFound = 0.5;        // least J of a body that has found back [-]
constexpr double kLongest = 12;       // periods of the oscillator: then the method has to do
constexpr double kSlowest = 1;        // times sqrt(g / D): no oscillator is slower [-]
constexpr double kEnergy = 0.05;      // of the elastic energy [-]: from rest at most 13 % of it ever move

/// The rotation, never a reflection, that turns `rest` closest to `places`, from the sum of m place rest^T (Kabsch 1976).
template <int Dim>
BlockOf<Dim> rotation_of(const BlockOf<Dim>& covariance) {
  const SignedSingularValues<Dim> svd = signed_singular_values<Dim>(covariance);
  return svd.U * svd.V.transpose();
}

template <int Dim>
SceneOf<Dim> without_self_contact(const SceneOf<Dim>& scene) {
  SceneOf<Dim> result = scene;
  result.self_contact.is_on = false;
  return result;
}

/// Which piece a node belongs to: pieces hang together by tets. N; `count` becomes their number.
template <int Dim>
std::vector<int> pieces_of(const BodyOf<Dim>& body, int& count) {
  std::vector<int> parent(static_cast<std::size_t>(body.node_count()));
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int node) {
    while (parent[static_cast<std::size_t>(node)] != node) node = parent[static_cast<std::size_t>(node)];
    return node;
  };
  for (int t = 0; t < body.tet_count(); ++t) {
    for (int k = 1; k <= Dim; ++k) {
      const int a = root(body.tets(0, t)), b = root(body.tets(k, t));
      parent[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    }
  }
  count = 0;
  std::vector<int> piece(parent.size());
  for (int i = 0; i < body.node_count(); ++i) {
    const auto n = static_cast<std::size_t>(i);
    piece[n] = parent[n] == i ? count++ : piece[static_cast<std::size_t>(root(i))];
  }
  return piece;
}

}  // namespace

template <int Dim>
class RecoveringStepper<Dim>::Recovery {
 public:
  explicit Recovery(const SceneOf<Dim>& scene)
      : scene_(scene),
        outside_(without_self_contact(scene)),
        forces_(scene.body),
        contact_(outside_),
        start_{scene.body.rest, scene.body.rest},
        arms_(scene.body.rest),
        whole_volume_(scene.body.rest_volume.sum()),
        size_(size_of_volume<Dim>(whole_volume_)) {
    int count;
    piece_of_ = pieces_of(scene.body, count);
    pieces_.resize(static_cast<std::size_t>(count));
    for (int i = 0; i < scene.body.node_count(); ++i) {
      Piece& piece = piece_of(i);
      piece.mass += scene.body.mass[i];
      piece.rest_centre += scene.body.mass[i] * scene.body.rest.col(i);
    }
    for (Piece& piece : pieces_) piece.rest_centre /= piece.mass;
  }

  bool is_called_for(const PointsOf<Dim>& x) const {
    if (!scene_.body.held.empty()) return false;
    double inside_out = 0;
    for (int t = 0; t < scene_.body.tet_count(); ++t) {
      if (!(jacobian(x, t) > 0)) inside_out += scene_.body.rest_volume[t];
    }
    return inside_out > kInsideOut * whole_volume_;
  }

  ContactWork contact_work() const { return contact_.work(); }

  bool is_over(const PointsOf<Dim>& x) const {
    if (since_s_ * frequency_ > kLongest * 2 * M_PI) return true;
    for (int t = 0; t < scene_.body.tet_count(); ++t) {
      if (!(jacobian(x, t) > kFound)) return false;
    }
    return true;
  }

  /// The oscillators hold a small share of the elastic energy, so that what they bring in is less than what goes.
  void begin(const Eigen::VectorXd& activation, const StateOf<Dim>& state) {
    since_s_ = 0;
    contact_.forget_reach();
    fit(state);
    double per_frequency_squared = 0;  // [J s2]
    for (int i = 0; i < scene_.body.node_count(); ++i) {
      per_frequency_squared += 0.5 * scene_.body.mass[i] * (arms_.col(i) - goal(i)).squaredNorm();
    }
    const double slowest = kSlowest * std::sqrt(9.81 / size_);
    const double elastic = forces_.set_activation(activation) ? forces_.elastic_energy(state.x) : 0;
    frequency_ = std::sqrt(kEnergy * elastic / per_frequency_squared);
    if (!(frequency_ >= slowest)) frequency_ = slowest;
    if (!std::isfinite(frequency_)) frequency_ = 1e3 * slowest;
  }

  Termination step(double dt, const Eigen::VectorXd& activation, const PointsOf<Dim>* effect_force, StateOf<Dim>& state,
                   ImpulsesOf<Dim>& impulses) {
    if (!forces_.set_activation(activation)) return Termination::kDiverged;  // which the method would not take either
    const BodyOf<Dim>& body = scene_.body;
    for (std::size_t n = 0; n < outside_.obstacles.size(); ++n) outside_.obstacles[n].velocity = scene_.obstacles[n].velocity;
    start_ = state;
    since_s_ += dt;
    fit(state);
    clear(impulses);
    contact_.forget_reach();
    impulses.gravity_moment = dt * cross<Dim>(state.x * body.mass, scene_.gravity);
    double fastest = 0;
    for (int i = 0; i < body.node_count(); ++i) {
      // Critically damped and implicit: u1 = u0 - h w^2 (d0 + h u1) - 2 h w u1.
      const Piece& piece = piece_of(i);
      const VectorOf<Dim> apart = arms_.col(i) - goal(i);
      const VectorOf<Dim> own = state.v.col(i) - piece.velocity - turning<Dim>(piece.rate, arms_.col(i));
      const double turn = dt * frequency_;
      state.v.col(i) += (own - (turn * frequency_) * apart) / (1 + 2 * turn + turn * turn) - own + dt * scene_.gravity;
      if (effect_force != nullptr) {
        state.v.col(i) += (dt / body.mass[i]) * effect_force->col(i);
        impulses.effect_moment += dt * cross<Dim>(state.x.col(i), effect_force->col(i));
      }
      fastest = std::max(fastest, state.v.col(i).norm());
    }
    if (effect_force != nullptr) impulses.effect_nodes = dt * *effect_force;
    if (!std::isfinite(state.v.squaredNorm())) {
      state = start_;
      return Termination::kDiverged;
    }
    if (contact_.is_needed()) contact_.push_apart(dt, fastest, state, impulses);
    state.x += dt * state.v;
    return Termination::kDone;
  }

 private:
  struct Piece {
    double mass = 0;
    VectorOf<Dim> rest_centre = VectorOf<Dim>::Zero(), centre = VectorOf<Dim>::Zero(), velocity = VectorOf<Dim>::Zero();
    BlockOf<Dim> turn = BlockOf<Dim>::Identity();
    SpinOf<Dim> rate = SpinOf<Dim>::Zero();
    BlockOf<Dim> covariance = BlockOf<Dim>::Zero();
    InertiaOf<Dim> inertia = InertiaOf<Dim>::Zero();
    SpinOf<Dim> angular_momentum = SpinOf<Dim>::Zero();
  };

  Piece& piece_of(int node) { return pieces_[static_cast<std::size_t>(piece_of_[static_cast<std::size_t>(node)])]; }

  double jacobian(const PointsOf<Dim>& x, int t) const {
    double jacobian;
    jacobian_gradient<Dim>(x, scene_.body.tets, t, scene_.body.rest_volume[t], jacobian);
    return jacobian;
  }

  /// Where a node is to be, from its piece's centre.
  VectorOf<Dim> goal(int node) {
    const Piece& piece = piece_of(node);
    return piece.turn * (scene_.body.rest.col(node) - piece.rest_centre);
  }

  /// Finds each piece's rigid motion and how its rest shape lies best.
  void fit(const StateOf<Dim>& state) {
    const BodyOf<Dim>& body = scene_.body;
    for (Piece& piece : pieces_) {
      piece.centre.setZero();
      piece.velocity.setZero();
      piece.covariance.setZero();
      piece.inertia.setZero();
      piece.angular_momentum.setZero();
    }
    for (int i = 0; i < body.node_count(); ++i) {
      Piece& piece = piece_of(i);
      piece.centre += (body.mass[i] / piece.mass) * state.x.col(i);
      piece.velocity += (body.mass[i] / piece.mass) * state.v.col(i);
    }
    for (int i = 0; i < body.node_count(); ++i) {
      Piece& piece = piece_of(i);
      const VectorOf<Dim> arm = state.x.col(i) - piece.centre;
      arms_.col(i) = arm;
      piece.covariance += body.mass[i] * arm * (body.rest.col(i) - piece.rest_centre).transpose();
      piece.angular_momentum += body.mass[i] * cross<Dim>(arm, state.v.col(i) - piece.velocity);
      if constexpr (Dim == 3) {
        piece.inertia += body.mass[i] * (arm.squaredNorm() * BlockOf<3>::Identity() - arm * arm.transpose());
      } else {
        piece.inertia(0, 0) += body.mass[i] * arm.squaredNorm();
      }
    }
    for (Piece& piece : pieces_) {
      piece.turn = rotation_of<Dim>(piece.covariance);
      piece.rate = piece.inertia.ldlt().solve(piece.angular_momentum);
      if (!piece.rate.allFinite()) piece.rate.setZero();
    }
  }

  const SceneOf<Dim>& scene_;
  SceneOf<Dim> outside_;  // the body passes through itself
  InternalForces<Dim> forces_;
  ImpulseContact<Dim> contact_;
  std::vector<int> piece_of_;  // N
  std::vector<Piece> pieces_;
  StateOf<Dim> start_;  // of the step
  PointsOf<Dim> arms_;  // [m] of the nodes from their pieces' centres
  double whole_volume_, size_;
  double frequency_ = 0, since_s_ = 0;  // [1/s] of the oscillators; [s] since the beginning
};

template <int Dim>
RecoveringStepper<Dim>::RecoveringStepper(const SceneOf<Dim>& scene, std::unique_ptr<StepperOf<Dim>> method)
    : recovery_(std::make_unique<Recovery>(scene)), method_(std::move(method)) {}
template <int Dim>
RecoveringStepper<Dim>::~RecoveringStepper() = default;

template <int Dim>
void RecoveringStepper<Dim>::forget() {
  is_recovering_ = false;
  method_->forget();
}

template <int Dim>
StepWork RecoveringStepper<Dim>::work() const {
  StepWork work = method_->work();
  work.by_impulses += recovery_->contact_work();
  return work;
}

template <int Dim>
Termination RecoveringStepper<Dim>::step(double dt, const Eigen::VectorXd& activation, const PointsOf<Dim>* effect_force,
                                         StateOf<Dim>& state, ImpulsesOf<Dim>& impulses) {
  if (!is_recovering_ && recovery_->is_called_for(state.x)) {
    is_recovering_ = true;
    recovery_->begin(activation, state);
  }
  if (!is_recovering_) return method_->step(dt, activation, effect_force, state, impulses);
  ++steps_;
  method_->forget();
  const Termination termination = recovery_->step(dt, activation, effect_force, state, impulses);
  is_recovering_ = termination == Termination::kDone && !recovery_->is_over(state.x);
  return termination;
}

template class RecoveringStepper<2>;
template class RecoveringStepper<3>;

}  // namespace hydrostat::physics
