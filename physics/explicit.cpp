#include <algorithm>
#include <cmath>

#include "physics/elastic_forces.h"
#include "physics/stepper.h"
#include "physics/system_matrix.h"

namespace hydrostat::physics {
namespace {

constexpr double kStepMargin = 0.8;    // of the linear stability bound
constexpr double kMostSubsteps = 1e5;  // of a step: a shape that wants more has run away
constexpr double kPushOutSpeed = 0.5;  // [m/s] at most, with which a point that starts below the ground is lifted
constexpr double kReach = 0.1;         // of the shortest edge [-]: points as near as that are watched
constexpr int kContactSweeps = 30;
constexpr double kContactTolerance = 1e-7;  // [m/s] change of a contact point's velocity in a sweep

struct StiffestMode {
  double damping;            // [1/s]
  double frequency_squared;  // [1/s2]
};

double longest_substep(const StiffestMode& mode) {
  return (std::sqrt(mode.damping * mode.damping + 4 * mode.frequency_squared) - mode.damping) / mode.frequency_squared;
}

/// The mode that limits the substep h of the linear motion about the rest shape: while 4 M - 2 h D - h^2 K stays positive,
/// the roots of the amplification polynomial stay in the unit disc. The dashpots act along edges alone, the stiffest modes
/// are those of volume: with D itself the bound is several times longer than with D = (largest damping time) K.
template <int Dim>
StiffestMode stiffest_mode_at_rest(const BodyOf<Dim>& body) {
  SystemMatrixOf<Dim> stiffness(body), damping(body);
  stiffness.set_zero();
  stiffness.add_stiffness(body, body.rest, Eigen::VectorXd::Ones(body.edge_count()), 1);
  damping.set_zero();
  damping.add_damping(body, body.rest, 1);
  Eigen::VectorXd root_mass(Dim * body.node_count());
  for (int i = 0; i < body.node_count(); ++i) root_mass.segment<Dim>(Dim * i).setConstant(std::sqrt(body.mass[i]));
  Eigen::VectorXd y(root_mass.size()), kz(y.size()), dz(y.size());
  for (Eigen::Index i = 0; i < y.size(); ++i) y[i] = std::cos(1.7 * static_cast<double>(i * i % 97));
  // Power iteration on M^-1 (2 h D + h^2 K) / 4 while h follows its largest eigenvalue toward 1, by Rayleigh's quotient.
  StiffestMode mode{};
  for (int k = 0; k < 300; ++k) {
    y.normalize();
    const Eigen::VectorXd z = y.cwiseQuotient(root_mass);
    kz = (stiffness.lower().template selfadjointView<Eigen::Lower>() * z).cwiseQuotient(root_mass);
    dz = (damping.lower().template selfadjointView<Eigen::Lower>() * z).cwiseQuotient(root_mass);
    mode = {y.dot(dz), y.dot(kz)};
    const double h = longest_substep(mode);
    y = 2 * h * dz + h * h * kz;
  }
  return mode;
}

/// Largest of the tets' own frequencies squared [1/s2] by their volume springs: these stiffen with the square of the area of
/// their faces.
template <int Dim>
double stiffest_volume(const BodyOf<Dim>& body, const ConstPointsOf<Dim>& x, const Eigen::VectorXd& inverse_mass) {
  double largest = 0;
  for (int t = 0; t < body.tet_count(); ++t) {
    double jacobian;
    const Eigen::Matrix<double, Dim, Dim + 1> gradient =
        jacobian_gradient<Dim>(x, body.tets, t, body.rest_volume[t], jacobian);
    double sum = 0;
    for (int k = 0; k <= Dim; ++k) sum += gradient.col(k).squaredNorm() * inverse_mass[body.tets(k, t)];
    largest = std::max(largest, body.volume_stiffness[t] * sum);
  }
  return largest;
}

/// Symplectic Euler (velocity Verlet with velocities at half steps) with contact by impulses.
///
/// Internal forces are pairwise and taken at the positions from which the step starts, so linear and angular momentum
/// change by the booked impulses alone, to rounding. Contact is solved on the velocity that moves the body: a point at gap g
/// may approach with g / h at most; projected Gauss-Seidel over the points inside Coulomb's cone (Moreau's time stepping).
template <int Dim>
class ExplicitStepper final : public StepperOf<Dim> {
 public:
  explicit ExplicitStepper(const SceneOf<Dim>& scene)
      : scene_(scene),
        force_(Dim, scene.body.node_count()),
        impulse_(PointsOf<Dim>::Zero(Dim, scene.contact_points.count())),
        inverse_mass_(scene.body.mass.cwiseInverse()),
        point_inverse_mass_(scene.contact_points.count()) {
    mode_at_rest_ = stiffest_mode_at_rest(scene.body);
    stiffest_volume_at_rest_ = stiffest_volume(scene.body, scene.body.rest, inverse_mass_);
    const ContactPointsOf<Dim>& points = scene.contact_points;
    for (int p = 0; p < points.count(); ++p) {
      point_inverse_mass_[p] = 0;
      for (int k = 0; k <= Dim; ++k) {
        point_inverse_mass_[p] += points.weights(k, p) * points.weights(k, p) * inverse_mass_[points.nodes(k, p)];
      }
    }
    candidates_.reserve(static_cast<std::size_t>(points.count()));
    active_.reserve(static_cast<std::size_t>(points.count()));
    shortest_edge_ = scene.body.rest_length.minCoeff();
  }

  double substep(double dt) const override { return dt / std::ceil(dt / (kStepMargin * longest_substep(mode_at_rest_))); }

  Termination step(double dt, const Eigen::VectorXd& activation, const PointsOf<Dim>* effect_force, StateOf<Dim>& state,
                   ImpulsesOf<Dim>& impulses) override {
    start_ = state;
    // The bound at rest, shortened by as much as the shape from which the step starts is stiffer.
    StiffestMode mode = mode_at_rest_;
    mode.frequency_squared *= std::max(1.0, stiffest_volume(scene_.body, state.x, inverse_mass_) / stiffest_volume_at_rest_);
    const double count = std::ceil(dt / (kStepMargin * longest_substep(mode)));
    if (!(count <= kMostSubsteps)) return Termination::kDiverged;
    const int substeps = static_cast<int>(count);
    const double h = dt / substeps;
    impulses.contact.setZero();
    impulses.contact_nodes.setZero();
    impulses.contact_moment.setZero();
    impulses.effect_nodes.setZero();
    impulses.effect_moment.setZero();
    impulses.gravity_moment.setZero();
    double reach = 0;  // [m] that the body may still move before points beyond the candidates can touch
    for (int s = 0; s < substeps; ++s) {
      force_.setZero();
      add_internal_forces(scene_.body, state, activation, force_);
      if (effect_force != nullptr) {
        force_ += *effect_force;
        impulses.effect_nodes += h * *effect_force;
        for (int i = 0; i < scene_.body.node_count(); ++i) {
          impulses.effect_moment += h * cross<Dim>(state.x.col(i), effect_force->col(i));
        }
      }
      double fastest = 0;
      for (int i = 0; i < scene_.body.node_count(); ++i) {
        state.v.col(i) += h * (inverse_mass_[i] * force_.col(i) + scene_.gravity);
        const double speed_squared = state.v.col(i).squaredNorm();
        if (!(speed_squared <= fastest)) fastest = speed_squared;  // keeps what is not a number
      }
      impulses.gravity_moment += h * cross<Dim>(state.x * scene_.body.mass, scene_.gravity);
      const double farthest = h * std::sqrt(fastest);
      if (!(farthest < shortest_edge_)) {
        state = start_;
        return Termination::kDiverged;
      }
      if (scene_.has_ground) {
        reach -= 2 * farthest + h * kPushOutSpeed;  // what contact itself may add is within that
        if (reach < 0) reach = find_candidates(2 * farthest + h * kPushOutSpeed, state);
        push_apart(h, state, impulses);
      }
      state.x += h * state.v;
    }
    return Termination::kDone;
  }

 private:
  double gap(const ConstPointsOf<Dim>& x, int p) const {
    return scene_.ground.normal.dot(scene_.contact_points.of(x, p)) - scene_.ground.offset;
  }

  /// The points that may touch the ground in this substep, in which no node moves farther than `farthest` [m], and in some
  /// to come; what is left for those is returned [m].
  double find_candidates(double farthest, const StateOf<Dim>& state) {
    const double reach = kReach * shortest_edge_;
    candidates_.clear();
    for (int p = 0; p < scene_.contact_points.count(); ++p) {
      if (gap(state.x, p) < reach + farthest) {
        candidates_.push_back(p);
      } else {
        impulse_.col(p).setZero();
      }
    }
    return reach;
  }

  void apply(int p, const VectorOf<Dim>& impulse, StateOf<Dim>& state) const {
    const ContactPointsOf<Dim>& points = scene_.contact_points;
    for (int k = 0; k <= Dim; ++k) {
      const int i = points.nodes(k, p);
      state.v.col(i) += (points.weights(k, p) * inverse_mass_[i]) * impulse;
    }
  }

  void push_apart(double h, StateOf<Dim>& state, ImpulsesOf<Dim>& impulses) {
    const ContactPointsOf<Dim>& points = scene_.contact_points;
    const VectorOf<Dim> normal = scene_.ground.normal;
    active_.clear();
    for (const int p : candidates_) {
      const double distance = gap(state.x, p);
      if (distance + h * normal.dot(points.of(state.v, p)) < 0 || impulse_.col(p).squaredNorm() > 0) {
        active_.push_back({p, std::min(-distance / h, kPushOutSpeed)});
        apply(p, impulse_.col(p), state);  // warm start
      }
    }
    for (int sweep = 0; sweep < kContactSweeps; ++sweep) {
      double change = 0;
      for (const Active& contact : active_) {
        const int p = contact.point;
        const VectorOf<Dim> velocity = points.of(state.v, p);
        VectorOf<Dim> wanted = impulse_.col(p);
        const double normal_velocity = normal.dot(velocity);
        const double normal_impulse =
            std::max(0.0, normal.dot(wanted) + (contact.least_velocity - normal_velocity) / point_inverse_mass_[p]);
        VectorOf<Dim> tangential =
            wanted - normal.dot(wanted) * normal - (velocity - normal_velocity * normal) / point_inverse_mass_[p];
        const double limit = scene_.ground.friction * normal_impulse, size = tangential.norm();
        if (size > limit) tangential *= limit / size;
        wanted = normal_impulse * normal + tangential;
        const VectorOf<Dim> step = wanted - impulse_.col(p);
        change = std::max(change, step.norm() * point_inverse_mass_[p]);
        impulse_.col(p) = wanted;
        apply(p, step, state);
      }
      if (change < kContactTolerance) break;
    }
    for (const Active& contact : active_) {
      const int p = contact.point;
      impulses.contact.col(p) += impulse_.col(p);
      for (int k = 0; k <= Dim; ++k) {
        impulses.contact_nodes.col(points.nodes(k, p)) += points.weights(k, p) * impulse_.col(p);
      }
      const VectorOf<Dim> place = points.of(state.x, p), impulse = impulse_.col(p);
      impulses.contact_moment += cross<Dim>(place, impulse);
    }
  }

  struct Active {
    int point;
    double least_velocity;  // [m/s] along the normal
  };

  const SceneOf<Dim>& scene_;
  PointsOf<Dim> force_, impulse_;  // [N], [N s] of the last substep
  Eigen::VectorXd inverse_mass_, point_inverse_mass_;
  StateOf<Dim> start_;
  StiffestMode mode_at_rest_{};         // of the body at rest
  double stiffest_volume_at_rest_ = 0;  // [1/s2]
  double shortest_edge_ = 0;            // [m]
  std::vector<int> candidates_;
  std::vector<Active> active_;
};

}  // namespace

template <int Dim>
std::unique_ptr<StepperOf<Dim>> make_explicit_stepper(const SceneOf<Dim>& scene) {
  return std::make_unique<ExplicitStepper<Dim>>(scene);
}
template std::unique_ptr<StepperOf<2>> make_explicit_stepper<2>(const SceneOf<2>&);
template std::unique_ptr<StepperOf<3>> make_explicit_stepper<3>(const SceneOf<3>&);

}  // namespace hydrostat::physics
