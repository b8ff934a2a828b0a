#include "physics/internal_forces.h"

#include <algorithm>
#include <cmath>

#include "physics/elastic_forces.h"
#include "physics/element_forces.h"

namespace hydrostat::physics {
namespace {

constexpr double kMostActivation = 100;  // what is longer is a fault of whoever commands it [-]

}  // namespace

template <int Dim>
InternalForces<Dim>::InternalForces(const BodyOf<Dim>& body, int threads)
    : body_(body),
      has_springs_(body.elements.empty() || !body.edge_stiffness.isZero(0) || body.volume_stiffness.size() > 0),
      has_dashpots_(body.elements.empty() || !body.edge_damping.isZero(0)),
      activation_(Eigen::VectorXd::Ones(body.edge_count())),
      inverse_mass_(body.mass.cwiseInverse()) {
  for (const BodyElements<Dim>& elements : body.elements) {
    active_.push_back(make_active_strain(elements.block));
    parts_.push_back(is_large(elements.block) ? std::make_unique<ElementParts<Dim>>(elements.block) : nullptr);
    if (parts_.back() != nullptr && team_ == nullptr) team_ = std::make_unique<WorkerTeam>(threads);
  }
  stiffest_volume_at_rest_ = stiffest_volume(body.rest);
}

template <int Dim>
bool InternalForces<Dim>::set_activation(const Eigen::VectorXd& activation) {
  if (!(activation.array().abs() <= kMostActivation).all()) return false;
  if (active_.empty() || activation != activation_) {
    activation_ = activation;
    is_passive_ = (activation.array() == 1).all();
    for (std::size_t n = 0; n < active_.size(); ++n) {
      if (!physics::set_activation(body_.elements[n].fit, activation, active_[n])) {
        activation_.setConstant(std::nan(""));  // the strains hold nothing: the next call sets them
        return false;
      }
    }
  }
  return true;
}

template <int Dim>
double InternalForces<Dim>::energy_of_elements(std::size_t n, const PointsOf<Dim>& x) const {
  const ElementBlock<Dim>& block = body_.elements[n].block;
  if (parts_[n] != nullptr) return parts_[n]->energy(block, x, active_of(n), *team_);
  return element_energy<Dim>(block, x, active_of(n), all_batches(block));
}

template <int Dim>
void InternalForces<Dim>::add_forces_of_elements(std::size_t n, const PointsOf<Dim>& x, PointsOf<Dim>& force) const {
  const ElementBlock<Dim>& block = body_.elements[n].block;
  if (parts_[n] != nullptr) return parts_[n]->add_forces(block, x, active_of(n), *team_, force);
  add_element_forces<Dim>(block, x, active_of(n), all_batches(block), force);
}

template <int Dim>
double InternalForces<Dim>::elastic_energy(const PointsOf<Dim>& x) const {
  double energy = has_springs_ ? physics::elastic_energy(body_, x, activation_) : 0;
  for (std::size_t n = 0; n < active_.size(); ++n) energy += energy_of_elements(n, x);
  return energy;
}

template <int Dim>
void InternalForces<Dim>::add_elastic_forces(const PointsOf<Dim>& x, PointsOf<Dim>& force) const {
  if (has_springs_) physics::add_elastic_forces(body_, x, activation_, force);
  for (std::size_t n = 0; n < active_.size(); ++n) add_forces_of_elements(n, x, force);
}

template <int Dim>
void InternalForces<Dim>::add_forces(const StateOf<Dim>& state, PointsOf<Dim>& force) const {
  if (has_springs_ || has_dashpots_) add_internal_forces(body_, state, activation_, force);
  for (std::size_t n = 0; n < active_.size(); ++n) add_forces_of_elements(n, state.x, force);
}

template <int Dim>
void InternalForces<Dim>::add_stiffness(const PointsOf<Dim>& x, double factor, SystemMatrixOf<Dim>& matrix) const {
  if (has_springs_) matrix.add_stiffness(body_, x, activation_, factor);
  for (std::size_t n = 0; n < active_.size(); ++n) {
    const ElementBlock<Dim>& block = body_.elements[n].block;
    for (int e = 0; e < block.element_count(); ++e) {
      const ElementMatrix stiffness = element_stiffness<Dim>(block, e, x, active_of(n), Definiteness::kProjected);
      matrix.add_element(block, e, body_.elements[n].fit.of_element, stiffness, factor);
    }
  }
}

template <int Dim>
Eigen::SparseMatrix<double> InternalForces<Dim>::force_per_activation(const PointsOf<Dim>& x) const {
  std::vector<Eigen::Triplet<double>> entries;
  for (int e = 0; has_springs_ && e < body_.edge_count(); ++e) {
    const int low = body_.edges(0, e), high = body_.edges(1, e);
    const VectorOf<Dim> push = body_.edge_stiffness[e] * body_.rest_length[e] * (x.col(high) - x.col(low)).normalized();
    for (int i = 0; i < Dim; ++i) {
      entries.emplace_back(Dim * low + i, e, -push[i]);
      entries.emplace_back(Dim * high + i, e, push[i]);
    }
  }
  for (const BodyElements<Dim>& elements : body_.elements) {
    const ElementBlock<Dim>& block = elements.block;
    for (int k = 0; k < block.element_count(); ++k) {
      const Eigen::MatrixXd forces = element_force_per_activation<Dim>(block, elements.fit, k, x, activation_);
      for (int p = 0; p < forces.cols(); ++p) {
        for (int r = 0; r < forces.rows(); ++r) {
          entries.emplace_back(Dim * block.nodes(r / Dim, k) + r % Dim, elements.fit.of_element(p, k), forces(r, p));
        }
      }
    }
  }
  Eigen::SparseMatrix<double> result(x.size(), body_.edge_count());
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

template <int Dim>
Eigen::VectorXd InternalForces<Dim>::tensions(const PointsOf<Dim>& x) const {
  Eigen::VectorXd result(body_.edge_count());
  for (int e = 0; e < body_.edge_count(); ++e) {
    const double length = (x.col(body_.edges(1, e)) - x.col(body_.edges(0, e))).norm();
    result[e] = body_.edge_stiffness[e] * (length - activation_[e] * body_.rest_length[e]);
  }
  for (const BodyElements<Dim>& elements : body_.elements) {
    for (int k = 0; k < elements.block.element_count(); ++k) {
      const Eigen::RowVectorXd energy = element_energy_per_activation<Dim>(elements.block, elements.fit, k, x, activation_);
      for (int p = 0; p < energy.size(); ++p) {
        const int e = elements.fit.of_element(p, k);
        result[e] -= energy[p] / body_.rest_length[e];
      }
    }
  }
  return result;
}

/// Largest of the tets' own frequencies squared [1/s2] by their volume springs: these stiffen with the square of the area of
/// their faces.
template <int Dim>
double InternalForces<Dim>::stiffest_volume(const PointsOf<Dim>& x) const {
  double largest = 0;
  for (int t = 0; t < body_.volume_stiffness.size(); ++t) {
    double jacobian;
    const Eigen::Matrix<double, Dim, Dim + 1> gradient =
        jacobian_gradient<Dim>(x, body_.tets, t, body_.rest_volume[t], jacobian);
    double sum = 0;
    for (int k = 0; k <= Dim; ++k) sum += gradient.col(k).squaredNorm() * inverse_mass_[body_.tets(k, t)];
    largest = std::max(largest, body_.volume_stiffness[t] * sum);
  }
  return largest;
}

template <int Dim>
double InternalForces<Dim>::stiffening(const PointsOf<Dim>& x) const {
  double growth = 1;
  if (stiffest_volume_at_rest_ > 0) growth = std::max(growth, stiffest_volume(x) / stiffest_volume_at_rest_);
  for (std::size_t n = 0; n < active_.size(); ++n) {
    growth = std::max(growth, element_stiffening<Dim>(body_.elements[n].block, x, active_of(n)));
  }
  return growth;
}

template class InternalForces<2>;
template class InternalForces<3>;

}  // namespace hydrostat::physics
