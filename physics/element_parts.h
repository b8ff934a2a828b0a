#pragma once

#include "physics/element_forces.h"
#include "physics/worker_team.h"

namespace hydrostat::physics {

/// The elements of a large block in parts that threads share. A part adds up the forces on its nodes apart from the others;
/// then parts are added in their order. Number and limits of the parts follow from the block alone, and so do all sums: the
/// threads change nothing in them.
template <int Dim>
class ElementParts {
 public:
  explicit ElementParts(const ElementBlock<Dim>& block);

  /// As element_energy and add_element_forces of the whole block, which is the one of the constructor.
  double energy(const ElementBlock<Dim>& block, const ConstNodeMatrix<Dim>& x, const ActiveStrain<Dim>* active,
                WorkerTeam& team);
  void add_forces(const ElementBlock<Dim>& block, const ConstNodeMatrix<Dim>& x, const ActiveStrain<Dim>* active,
                  WorkerTeam& team, NodeMatrix<Dim>& force);

 private:
  struct Part {
    BatchRange range;
    int first_node = 0;           // the least that its elements have
    std::vector<int> lane_nodes;  // the block's of the range, counted from first_node
    NodeMatrix<Dim> force;        // [N] on the nodes from first_node to the greatest
    double energy = 0;            // [J]
  };
  void add_up(int of_part, NodeMatrix<Dim>& force) const;

  std::vector<Part> parts_;
};

/// Whether a block is worth it: waking a thread takes as long as some thousand elements.
template <int Dim>
bool is_large(const ElementBlock<Dim>& block) {
  return block.element_count() >= 5000;
}

}  // namespace hydrostat::physics
