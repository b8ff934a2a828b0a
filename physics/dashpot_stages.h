#pragma once

#include <vector>

#include "physics/body.h"
#include "physics/element_lanes.h"

namespace hydrostat::physics {

/// The dashpots of a body integrated by themselves, the other forces held, in stages of a substep that is much longer than what
/// explicit Euler could bear: s stages reach about s^2 / 4 times as far.
///
/// A Runge-Kutta-Legendre method of second order for v' = (f - D v) / m with the edges held where they lie. Its result is
/// v + phi (f - D v) h / m, phi(h D / m) between 0 and 1: symplectic Euler with masses that are larger by 1 / phi for what the
/// dashpots brake. With an odd number of stages 2 / phi - h D / m is nowhere less than 2, so that a substep that the elastic forces
/// bear by themselves stays stable, and what is overdamped creeps at its own rate. Dashpots pull along their edges in every stage,
/// so that neither momentum changes. Edges turn meanwhile: they lie as they are held in the middle of the substep, for velocities
/// are half a substep away from places, and before and after it they feel what they turn into (else a body that turns would be
/// stretched, substep by substep, by more than its dashpots let the springs take back).
/// Source: Meyer, Balsara, Aslam, "A stabilized Runge-Kutta-Legendre method for explicit super-time-stepping of parabolic and
/// mixed equations", JCP 257, 2014, eq. (16) to (19).
template <int Dim>
class DashpotStages {
 public:
  explicit DashpotStages(const BodyOf<Dim>& body);

  /// Up to which product of a substep and a rate of the dashpots so many stages, an odd number above 1, stay stable [-].
  static double reach(int stages) { return 0.5 * (stages * stages + stages - 2); }

  /// By how much the dashpots at one node brake more at x, in the direction in which they brake most, than at rest [-]: at least 1.
  double stiffening(const PointsOf<Dim>& x);

  /// Turns constant forces [N] Dim x N into the mean over the substep h [s] of these and of the dashpots' at places x [m], half a
  /// substep after the nodes had the velocities v [m/s] with which it begins. Held nodes keep their velocity.
  void add_mean_forces(const PointsOf<Dim>& x, const PointsOf<Dim>& v, double h, int stages, PointsOf<Dim>& force);

 private:
  struct Stage {
    double time;                            // when its forces are taken, of the substep [-]
    double last, before, rate, first_rate;  // factors of the last two stages' impulses and of h times the last and first forces
  };
  struct Node {
    Lanes velocity;  // [m/s]
    Lanes force;     // [N]
  };
  struct Course {
    Lanes start;                  // [m/s]
    Lanes constant, first_force;  // [N]
    Lanes impulse, last_impulse;  // [N s]
  };
  struct Ends {
    int low, high;
  };
  void set_stages(int stages);
  double most_at_a_node(const PointsOf<Dim>& x);
  void integrate(const double* x, const double* v, double h, double* force);
  void integrate_here(const double* x, const double* v, double h, double* force);
  void integrate_wide(const double* x, const double* v, double h, double* force);
  void set_edges(double h);
  void add_forces(double time);

  const BodyOf<Dim>& body_;
  Eigen::VectorXd inverse_mass_;  // 0 of held nodes [1/kg]
  std::vector<Node> nodes_;
  std::vector<Course> courses_;  // of the nodes
  std::vector<Ends> edges_;      // those with damping, and up to three of no length
  std::vector<double> damping_;  // [N s/m]
  std::vector<Lanes> along_;     // each edge at its place, times the root of its damping [(N s/m)^(1/2)]
  std::vector<Lanes> turning_;   // of four edges: by how much their rates grow a second because they turn, times that root
  std::vector<Stage> stages_;
  std::vector<Eigen::Matrix<double, Dim, Dim>> blocks_;  // [N s/m] of each node
  double most_at_rest_ = 0;                              // [1/s]
};

}  // namespace hydrostat::physics
