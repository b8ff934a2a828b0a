#pragma once

#include <memory>
#include <string>

#include "physics/contact.h"

namespace hydrostat::physics {

/// What acts on the body: nothing else does.
struct Scene {
  Body body;
  ContactPoints contact_points;
  Ground ground;
  bool has_ground = true;
  Eigen::Vector3d gravity = Eigen::Vector3d(0, -9.81, 0);  // [m/s2]
};

/// The impulses of one step [N s], with which the momentum of the body balances.
struct Impulses {
  Eigen::Matrix3Xd contact;        // 3 x P, by the ground on each contact point
  Eigen::Matrix3Xd contact_nodes;  // 3 x N, the same spread on the nodes
  Eigen::Vector3d contact_moment;  // [N m s] about the world's origin
  Eigen::Matrix3Xd effect_nodes;   // 3 x N, declared effects (pushes)
  Eigen::Vector3d effect_moment;   // [N m s]
  Eigen::Vector3d gravity_moment;  // [N m s]
};

enum class Termination { kDone, kDiverged };

/// One method of time integration bound to one scene; it keeps scratch memory, steps allocate nothing.
class Stepper {
 public:
  virtual ~Stepper() = default;
  /// Moves `state` on by `dt` [s] under `activation` (E, held). `effect_force` [N] 3 x N, or null for none.
  /// kDiverged: a value is not finite or the energy ran away; the state is then the one before the step.
  virtual Termination step(double dt, const Eigen::VectorXd& activation, const Eigen::Matrix3Xd* effect_force, State& state,
                           Impulses& impulses) = 0;
  /// The method's own substep [s] for an outer step dt from the rest shape.
  virtual double substep(double dt) const = 0;
};

enum class Method { kExplicit, kEuler };
std::string name_of(Method method);
/// Throws nothing; every scene is accepted. The scene must outlive the stepper.
std::unique_ptr<Stepper> make_stepper(Method method, const Scene& scene);

std::unique_ptr<Stepper> make_explicit_stepper(const Scene& scene);
std::unique_ptr<Stepper> make_euler_stepper(const Scene& scene);

Impulses make_impulses(const Scene& scene);

}  // namespace hydrostat::physics
