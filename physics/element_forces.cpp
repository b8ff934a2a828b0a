#include "physics/element_forces.h"

#include "physics/element_kernel.h"
#include "physics/wide.h"

namespace hydrostat::physics {
namespace {

/// One pass over a range of batches.
template <int Dim, int Nodes>
struct Sweep {
  using Kernel = ElementKernel<Lanes, Dim, Nodes>;
  using Layout = ElementLayout<Dim, Nodes>;
  using Active = ActiveLayout<Dim, Nodes>;

  const ElementBlock<Dim>& block;
  const int* lane_nodes;  // of the range
  const double* x;
  const ActiveStrain<Dim>* active;
  BatchRange range;

  const int* nodes_of(int batch) const {
    return lane_nodes + static_cast<std::size_t>(batch - range.first) * Nodes * Lanes::kCount;
  }

  typename Kernel::Offsets gather(const int* nodes) const {
    typename Kernel::Offsets offset;
    for (int i = 0; i < Dim; ++i) {
      Lanes first;
      for (int lane = 0; lane < Lanes::kCount; ++lane) first.value[lane] = x[Dim * nodes[lane] + i];
      for (int n = 1; n < Nodes; ++n) {
        Lanes here;
        for (int lane = 0; lane < Lanes::kCount; ++lane) here.value[lane] = x[Dim * nodes[Lanes::kCount * n + lane] + i];
        offset(i, n - 1) = here - first;
      }
    }
    return offset;
  }

  static void scatter(const int* nodes, const typename Kernel::Offsets& forces, double* force) {
    for (int i = 0; i < Dim; ++i) {
      Lanes balance(0.0);
      for (int n = 1; n < Nodes; ++n) balance -= forces(i, n - 1);
      for (int lane = 0; lane < Lanes::kCount; ++lane) {
        force[Dim * nodes[lane] + i] += balance[lane];
        for (int n = 1; n < Nodes; ++n) force[Dim * nodes[Lanes::kCount * n + lane] + i] += forces(i, n - 1)[lane];
      }
    }
  }

  /// Law and activation are settled before the loop: in it they would keep the numbers out of the registers.
  void add_forces(double* force) const {
    constexpr ElasticLaw kNeoHookean = ElasticLaw::kStableNeoHookean, kCorotated = ElasticLaw::kCorotatedLinear;
    if (block.law == kNeoHookean) {
      active ? add_forces_of<kNeoHookean, true>(force) : add_forces_of<kNeoHookean, false>(force);
    } else {
      active ? add_forces_of<kCorotated, true>(force) : add_forces_of<kCorotated, false>(force);
    }
  }

  template <ElasticLaw kLaw, bool kIsActive>
  void add_forces_of(double* force) const {
    for (int batch = range.first; batch < range.end; ++batch) {
      const int* const nodes = nodes_of(batch);
      const ElementData<Lanes> data(block.lanes, batch, Layout::kSize);
      typename Kernel::Strain strain = Kernel::strain_of(data, gather(nodes));
      typename Kernel::Square stress;
      typename Kernel::Hourglass hourglass_force;
      if constexpr (kIsActive) {
        const ElementData<Lanes> shape(active->lanes, batch, Active::kSize);
        const typename Kernel::Square inverse = Kernel::active_inverse(shape);
        strain.F = (strain.F * inverse).eval();
        Kernel::differentiate(kLaw, data, Kernel::active_hourglass(shape), strain, stress, hourglass_force);
        stress = (stress * inverse).eval();  // symmetric
      } else {
        Kernel::differentiate(kLaw, data, Kernel::no_hourglass(), strain, stress, hourglass_force);
      }
      scatter(nodes, Kernel::nodal_forces(data, stress, hourglass_force), force);
    }
  }

  double energy() const {
    Lanes sum(0.0);
    for (int batch = range.first; batch < range.end; ++batch) {
      const ElementData<Lanes> data(block.lanes, batch, Layout::kSize);
      typename Kernel::Strain strain = Kernel::strain_of(data, gather(nodes_of(batch)));
      if (active) {
        const ElementData<Lanes> shape(active->lanes, batch, Active::kSize);
        strain.F = (strain.F * Kernel::active_inverse(shape)).eval();
        sum += Kernel::energy(block.law, data, Kernel::active_hourglass(shape), strain);
      } else {
        sum += Kernel::energy(block.law, data, Kernel::no_hourglass(), strain);
      }
    }
    return sum_of(sum);
  }
};

template <int Dim, int Nodes>
HYDROSTAT_FLATTEN void add_forces(const Sweep<Dim, Nodes>& sweep, double* force) {
  sweep.add_forces(force);
}
template <int Dim, int Nodes>
HYDROSTAT_FLATTEN double energy(const Sweep<Dim, Nodes>& sweep) {
  return sweep.energy();
}

#ifdef HYDROSTAT_WIDE
template <int Dim, int Nodes>
HYDROSTAT_WIDE void add_forces_wide(const Sweep<Dim, Nodes>& sweep, double* force) {
  sweep.add_forces(force);
}
template <int Dim, int Nodes>
HYDROSTAT_WIDE double energy_wide(const Sweep<Dim, Nodes>& sweep) {
  return sweep.energy();
}
#endif

template <int Dim, int Nodes>
void add_forces_here(const Sweep<Dim, Nodes>& sweep, double* force) {
#ifdef HYDROSTAT_WIDE
  static const bool is_wide = processor_is_wide();
  if (is_wide) return add_forces_wide(sweep, force);
#endif
  add_forces(sweep, force);
}

template <int Dim, int Nodes>
double energy_here(const Sweep<Dim, Nodes>& sweep) {
#ifdef HYDROSTAT_WIDE
  static const bool is_wide = processor_is_wide();
  if (is_wide) return energy_wide(sweep);
#endif
  return energy(sweep);
}

template <int Dim>
const int* lane_nodes_of(const ElementBlock<Dim>& block, BatchRange range) {
  return block.lane_nodes.data() + static_cast<std::ptrdiff_t>(range.first) * block.nodes_per_element() * Lanes::kCount;
}

template <int Dim>
void add_forces_of_nodes(const ElementBlock<Dim>& block, const int* lane_nodes, const ConstNodeMatrix<Dim>& x,
                         const ActiveStrain<Dim>* active, BatchRange range, NodeMatrix<Dim>& force) {
  if (block.is_box()) return add_forces_here(Sweep<Dim, 1 << Dim>{block, lane_nodes, x.data(), active, range}, force.data());
  add_forces_here(Sweep<Dim, Dim + 1>{block, lane_nodes, x.data(), active, range}, force.data());
}

}  // namespace

template <int Dim>
double element_energy(const ElementBlock<Dim>& block, const ConstNodeMatrix<Dim>& x, const ActiveStrain<Dim>* active,
                      BatchRange range) {
  const int* const nodes = lane_nodes_of(block, range);
  if (block.is_box()) return energy_here(Sweep<Dim, 1 << Dim>{block, nodes, x.data(), active, range});
  return energy_here(Sweep<Dim, Dim + 1>{block, nodes, x.data(), active, range});
}

template <int Dim>
void add_element_forces(const ElementBlock<Dim>& block, const ConstNodeMatrix<Dim>& x, const ActiveStrain<Dim>* active,
                        BatchRange range, NodeMatrix<Dim>& force) {
  add_forces_of_nodes(block, lane_nodes_of(block, range), x, active, range, force);
}

template <int Dim>
void add_element_forces(const ElementBlock<Dim>& block, const std::vector<int>& lane_nodes, const ConstNodeMatrix<Dim>& x,
                        const ActiveStrain<Dim>* active, BatchRange range, NodeMatrix<Dim>& force) {
  add_forces_of_nodes(block, lane_nodes.data(), x, active, range, force);
}

template double element_energy<2>(const ElementBlock<2>&, const ConstNodeMatrix<2>&, const ActiveStrain<2>*, BatchRange);
template double element_energy<3>(const ElementBlock<3>&, const ConstNodeMatrix<3>&, const ActiveStrain<3>*, BatchRange);
template void add_element_forces<2>(const ElementBlock<2>&, const ConstNodeMatrix<2>&, const ActiveStrain<2>*, BatchRange,
                                    NodeMatrix<2>&);
template void add_element_forces<3>(const ElementBlock<3>&, const ConstNodeMatrix<3>&, const ActiveStrain<3>*, BatchRange,
                                    NodeMatrix<3>&);
template void add_element_forces<2>(const ElementBlock<2>&, const std::vector<int>&, const ConstNodeMatrix<2>&,
                                    const ActiveStrain<2>*, BatchRange, NodeMatrix<2>&);
template void add_element_forces<3>(const ElementBlock<3>&, const std::vector<int>&, const ConstNodeMatrix<3>&,
                                    const ActiveStrain<3>*, BatchRange, NodeMatrix<3>&);

}  // namespace hydrostat::physics
