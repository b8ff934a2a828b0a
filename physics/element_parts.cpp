#include "physics/element_parts.h"

#include <algorithm>

namespace hydrostat::physics {
namespace {

constexpr int kElementsPerPart = 2500;  // enough for what the sum of the parts costs
constexpr int kMostParts = 32;

}  // namespace

template <int Dim>
ElementParts<Dim>::ElementParts(const ElementBlock<Dim>& block)
    : parts_(static_cast<std::size_t>(std::clamp(block.element_count() / kElementsPerPart, 1, kMostParts))) {
  const int count = static_cast<int>(parts_.size()), per_batch = block.nodes_per_element() * Lanes::kCount;
  for (int k = 0; k < count; ++k) {
    Part& part = parts_[static_cast<std::size_t>(k)];
    part.range = {block.batch_count() * k / count, block.batch_count() * (k + 1) / count};
    part.lane_nodes.assign(block.lane_nodes.begin() + part.range.first * per_batch,
                           block.lane_nodes.begin() + part.range.end * per_batch);
    const auto [least, greatest] = std::minmax_element(part.lane_nodes.begin(), part.lane_nodes.end());
    part.first_node = *least;
    part.force.setZero(Dim, *greatest - *least + 1);
    for (int& node : part.lane_nodes) node -= part.first_node;
  }
}

template <int Dim>
double ElementParts<Dim>::energy(const ElementBlock<Dim>& block, const ConstNodeMatrix<Dim>& x,
                                 const ActiveStrain<Dim>* active, WorkerTeam& team) {
  team.share(static_cast<int>(parts_.size()), [&](int k) {
    Part& part = parts_[static_cast<std::size_t>(k)];
    part.energy = element_energy<Dim>(block, x, active, part.range);
  });
  double sum = 0;
  for (const Part& part : parts_) sum += part.energy;
  return sum;
}

template <int Dim>
void ElementParts<Dim>::add_forces(const ElementBlock<Dim>& block, const ConstNodeMatrix<Dim>& x,
                                   const ActiveStrain<Dim>* active, WorkerTeam& team, NodeMatrix<Dim>& force) {
  team.share(static_cast<int>(parts_.size()), [&](int k) {
    Part& part = parts_[static_cast<std::size_t>(k)];
    part.force.setZero();
    add_element_forces<Dim>(block, part.lane_nodes, x.middleCols(part.first_node, part.force.cols()), active, part.range,
                            part.force);
  });
  team.share(static_cast<int>(parts_.size()), [&](int k) { add_up(k, force); });
}

/// Adds all parts up on a share of the nodes.
template <int Dim>
void ElementParts<Dim>::add_up(int of_part, NodeMatrix<Dim>& force) const {
  const auto count = static_cast<Eigen::Index>(parts_.size());
  const Eigen::Index begin = force.cols() * of_part / count, end = force.cols() * (of_part + 1) / count;
  for (const Part& part : parts_) {
    const Eigen::Index from = std::max<Eigen::Index>(begin, part.first_node);
    const Eigen::Index to = std::min<Eigen::Index>(end, part.first_node + part.force.cols());
    if (from < to) force.middleCols(from, to - from) += part.force.middleCols(from - part.first_node, to - from);
  }
}

template class ElementParts<2>;
template class ElementParts<3>;

}  // namespace hydrostat::physics
