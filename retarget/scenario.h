#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "physics/element_block.h"
#include "physics/seam.h"
#include "physics/simplex_mesh.h"
#include "physics/stepper.h"
#include "retarget/push.h"

namespace hydrostat::retarget {

/// A wave over the constraints' activations: share * (offset + amplitude * sin(2 pi frequency t + phase)), added to 1.
struct Wave {
  Eigen::VectorXd share;  // E, in 0..1: how much of it a constraint gets
  Eigen::VectorXd phase;  // [rad] E
  double amplitude = 0, offset = 0;
  double frequency_hz = 0;
  bool is_square = false;  // the sign of the sine in its place
  double from_s = 0, until_s = 1e300;
};

/// An obstacle's velocity for a while; out of all its moves it stands still. Moves at one time add.
template <int Dim>
struct MoveOf {
  int obstacle = 0;
  double from_s = 0, until_s = 1e300;
  physics::VectorOf<Dim> velocity = physics::VectorOf<Dim>::Zero();  // [m/s]
};

/// Nodes that stay where they start until they are let go.
struct Clamp {
  std::vector<int> nodes;
  double until_s = 1e300;
};

/// Whether an effect is on, and why.
struct EffectDecision {
  std::string name;
  bool is_on = false;
  std::string reason;
};

/// A body and all that happens to it: what a simulation without a clip starts from. All places are about a local origin, so that
/// far from the world's no digits are lost.
template <int Dim>
struct ScenarioOf {
  physics::SceneOf<Dim> scene;
  physics::StateOf<Dim> start;
  std::vector<Wave> waves;
  /// In the place of waves, where it is given: fills the activations (E) at a time [s].
  std::function<void(double time_s, Eigen::VectorXd& activation)> drive = {};
  std::vector<PushOf<Dim>> pushes;
  std::vector<MoveOf<Dim>> moves;
  std::optional<physics::FractureOf<Dim>> fracture = {};  // how the body splits, where it can
  std::vector<Clamp> clamps;  // those that hold at the start are the scene's body's `held`
  physics::VectorOf<Dim> origin = physics::VectorOf<Dim>::Zero();  // [m] the local one in the world
  double length = 1, size = 1;  // L [m], longest extent of the rest shape's box; D [m]
  double youngs_modulus = 0;    // [Pa] of the stiffest region
  std::string self_contact_reason = "nobody asked for it";  // why it is on or off
  std::vector<EffectDecision> decisions = {};  // of the other effects that can be told on or off
};

/// Springs and volume energy with the Lamé parameters of the material, for a lattice whose edges point everywhere: such a
/// lattice has lambda = mu by itself, and the volume energy adds what is missing. Needs Poisson's ratio >= 1/4.
template <int Dim>
physics::Material spring_material(const physics::ElementMaterial& material, double damping_time);

/// The body of springs of a mesh of simplices; its materials are one for all or one for each.
template <int Dim>
physics::BodyOf<Dim> make_spring_body(const physics::ElementMesh<Dim>& mesh, double damping_time);

/// Makes `held` what the clamps hold at a time [s]: in ascending order, each once.
void hold_at(const std::vector<Clamp>& clamps, double time_s, std::vector<int>& held);

/// The activations at a time [s]: 1 plus all waves. Allocates nothing once `activation` has its size.
void activations_at(const std::vector<Wave>& waves, double time_s, Eigen::VectorXd& activation);

enum class StartShape {
  kRest,
  kRandom,     // every node anywhere in the box of the rest shape
  kCollapsed,  // the same in a box a thousandth as large about its middle: in one point no force would have a direction
  kFlattened,  // all nodes on the plane through its middle that is level
};
/// Moves the nodes of `x`, the placed rest shape; random ones by `seed`.
template <int Dim>
void distort(StartShape shape, unsigned seed, physics::PointsOf<Dim>& x);

}  // namespace hydrostat::retarget
