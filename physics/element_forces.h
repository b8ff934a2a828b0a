#pragma once

#include "physics/element_activation.h"
#include "physics/element_block.h"

namespace hydrostat::physics {

/// Some of a block's batches of four elements, for work shared out: sums over ranges in a fixed order do not depend on who
/// computes which.
struct BatchRange {
  int first = 0;
  int end = 0;
};
template <int Dim>
BatchRange all_batches(const ElementBlock<Dim>& block) {
  return {0, block.batch_count()};
}

/// Elastic energy [J] at the node positions x [m] Dim x N. `active` may be null: passive.
template <int Dim>
double element_energy(const ElementBlock<Dim>& block, const ConstNodeMatrix<Dim>& x, const ActiveStrain<Dim>* active,
                      BatchRange range);

/// Adds minus the gradient of element_energy to `force` [N] Dim x N. Allocates nothing.
template <int Dim>
void add_element_forces(const ElementBlock<Dim>& block, const ConstNodeMatrix<Dim>& x, const ActiveStrain<Dim>* active,
                        BatchRange range, NodeMatrix<Dim>& force);
/// The same on a part of the nodes: `lane_nodes` are the block's of that range, counted as columns of x and `force`.
template <int Dim>
void add_element_forces(const ElementBlock<Dim>& block, const std::vector<int>& lane_nodes, const ConstNodeMatrix<Dim>& x,
                        const ActiveStrain<Dim>* active, BatchRange range, NodeMatrix<Dim>& force);

}  // namespace hydrostat::physics
