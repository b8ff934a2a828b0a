#pragma once

#include <memory>
#include <vector>

#include "physics/element_parts.h"
#include "physics/system_matrix.h"

namespace hydrostat::physics {

/// All forces inside one body, for every method: springs and dashpots along edges, volumes, finite elements. What a body does
/// not have costs nothing; after construction nothing is allocated.
template <int Dim>
class InternalForces {
 public:
  /// At most `threads` share the work of a large body; the forces do not hang on how many.
  explicit InternalForces(const BodyOf<Dim>& body, int threads = 1);

  /// Holds the activations [-], E, for what follows; to be called before it. False: one is not finite
  /// or beyond 100, or elements have no shape for them, for one is not above 0.
  bool set_activation(const Eigen::VectorXd& activation);
  const Eigen::VectorXd& activation() const { return activation_; }

  double elastic_energy(const PointsOf<Dim>& x) const;                          // [J]
  void add_elastic_forces(const PointsOf<Dim>& x, PointsOf<Dim>& force) const;  // [N]
  /// Elastic forces and the dashpots'.
  void add_forces(const StateOf<Dim>& state, PointsOf<Dim>& force) const;
  /// The positive semi-definite part of the elastic Hessian, as SystemMatrixOf::add_stiffness and element_stiffness have it.
  void add_stiffness(const PointsOf<Dim>& x, double factor, SystemMatrixOf<Dim>& matrix) const;
  /// Derivative of the elastic forces with respect to the activations [N], Dim N x E. Without elements it does not hang on
  /// the activations. Allocates.
  Eigen::SparseMatrix<double> force_per_activation(const PointsOf<Dim>& x) const;
  /// What pulls the ends of each constraint together [N], E: minus the derivative of the elastic energy with respect to its
  /// rest length a l0, of a spring k (l - a l0). Allocates.
  Eigen::VectorXd tensions(const PointsOf<Dim>& x) const;
  bool has_dashpots() const { return has_dashpots_; }

  /// By how much the volumes and elements are stiffer at x than at rest [-]: an estimate that errs to the high side, >= 1.
  double stiffening(const PointsOf<Dim>& x) const;

 private:
  double energy_of_elements(std::size_t n, const PointsOf<Dim>& x) const;
  void add_forces_of_elements(std::size_t n, const PointsOf<Dim>& x, PointsOf<Dim>& force) const;
  double stiffest_volume(const PointsOf<Dim>& x) const;
  /// Null while the body is passive: elements then do without.
  const ActiveStrain<Dim>* active_of(std::size_t block) const { return is_passive_ ? nullptr : &active_[block]; }

  const BodyOf<Dim>& body_;
  bool has_springs_, has_dashpots_;  // where there are none, elements bear all
  Eigen::VectorXd activation_, inverse_mass_;
  std::vector<ActiveStrain<Dim>> active_;
  bool is_passive_ = true;  // all activations are 1
  std::vector<std::unique_ptr<ElementParts<Dim>>> parts_;  // of the blocks that are large, null for the others
  std::unique_ptr<WorkerTeam> team_;                       // null where no block is
  double stiffest_volume_at_rest_ = 0;  // [1/s2]
};

}  // namespace hydrostat::physics
