#pragma once

#include <limits>
#include <optional>
#include <vector>

#include "physics/contact.h"
#include "physics/obstacle.h"

namespace hydrostat::physics {

/// Water or air around the body.
template <int Dim>
struct FluidOf {
  double density = 1000;                                   // [kg/m3]
  double level = std::numeric_limits<double>::infinity();  // [m] of its surface, upward; infinite: it is everywhere
  VectorOf<Dim> velocity = VectorOf<Dim>::Zero();          // [m/s] of its flow
  double drag = 1, drag_along = 0.02;                      // [-] against and along a face that moves in it
};

/// What acts on the body: nothing else does.
template <int Dim>
struct SceneOf {
  BodyOf<Dim> body;
  ContactPointsOf<Dim> contact_points;
  /// Triangles (segments in 2D) between contact points, Dim x F, counter-clockwise seen from outside (2D: the body on their
  /// left): what pokes in between the points is felt by them. May be empty.
  Eigen::Matrix<int, Dim, Eigen::Dynamic> contact_faces = {};
  GroundOf<Dim> ground;
  bool has_ground = true;
  std::vector<ObstacleOf<Dim>> obstacles = {};
  SelfContact self_contact = {};
  VectorOf<Dim> gravity = -9.81 * VectorOf<Dim>::UnitY();  // [m/s2]
  std::optional<FluidOf<Dim>> water = {}, air = {};        // see plan_effects
  int threads = 1;  // at most so many share a step of a large body; the outcome does not hang on it
};
using Scene = SceneOf<3>;

/// The impulses of one step [N s], with which the momentum of the body balances.
template <int Dim>
struct ImpulsesOf {
  PointsOf<Dim> contact;              // Dim x P, by ground and obstacles on each contact point
  PointsOf<Dim> contact_nodes;        // Dim x N, the same spread on the nodes
  SpinOf<Dim> contact_moment;         // [N m s] about the world's origin
  PointsOf<Dim> effect_nodes;         // Dim x N, declared effects (pushes)
  SpinOf<Dim> effect_moment;          // [N m s]
  SpinOf<Dim> gravity_moment;         // [N m s]
  PointsOf<Dim> hold;                 // Dim x held nodes, by what holds them where they are
  PointsOf<Dim> internal_nodes = {};  // Dim x N, by the body's own surface: sums to zero and has no moment; empty without
                                      // self-contact
  PointsOf<Dim> correction_nodes;     // Dim x N, by which the guard turns a body in flight: no force of the scene, an assist
  double obstacle_work = 0;  // [J] done on the body by obstacles that move and by what lifts it out of them and of itself
};
using Impulses = ImpulsesOf<3>;

template <int Dim>
ImpulsesOf<Dim> make_impulses(const SceneOf<Dim>& scene);
/// Sets all to zero.
template <int Dim>
void clear(ImpulsesOf<Dim>& impulses);
/// Adds those of a part of the step.
template <int Dim>
void add(const ImpulsesOf<Dim>& part, ImpulsesOf<Dim>& sum);

/// At which what starts inside an obstacle is lifted out [m/s]: a quarter of the root of g D, gravity 9.81 where there is
/// none.
template <int Dim>
double push_out_speed(const SceneOf<Dim>& scene);

/// The contact points and faces of the body's whole surface, one point a node of it.
template <int Dim>
void touch_with_whole_surface(SceneOf<Dim>& scene);

}  // namespace hydrostat::physics
