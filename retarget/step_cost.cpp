#include "retarget/step_cost.h"

namespace hydrostat::retarget {
namespace {

/// What a body is made of, as loops see it.
struct Counts {
  double nodes = 0, springs = 0, volumes = 0, simplices = 0, boxes = 0, pairs = 0;
};

template <int Dim>
Counts counts_of(const physics::BodyOf<Dim>& body) {
  Counts counts;
  counts.nodes = body.node_count();
  counts.pairs = body.edge_count();
  if (body.elements.empty() || body.edge_damping.maxCoeff() > 0) counts.springs = body.edge_count();
  counts.volumes = static_cast<double>(body.volume_stiffness.size());
  for (const physics::BodyElements<Dim>& elements : body.elements) {
    (elements.block.is_box() ? counts.boxes : counts.simplices) += elements.block.element_count();
  }
  return counts;
}

/// [ns] of each part, in two and three dimensions.
struct Cost {
  double nodes, springs, volumes, simplices, boxes, pairs;
  double of(const Counts& counts) const {
    return nodes * counts.nodes + springs * counts.springs + volumes * counts.volumes + simplices * counts.simplices +
           boxes * counts.boxes + pairs * counts.pairs;
  }
};
// Estimates for one thread at 2 GHz, from the times of tets, substeps and steps in README's "Speed against accuracy"; not yet
// fitted to runs of their own.
constexpr Cost kPass[] = {{12, 13, 12, 12, 45, 0}, {16, 17, 26, 24, 260, 0}};
constexpr Cost kSweep[] = {{25, 40, 45, 100, 400, 0}, {30, 45, 80, 170, 1700, 0}};
constexpr Cost kAssembly[] = {{20, 60, 120, 500, 2200, 10}, {40, 110, 400, 1300, 22000, 20}};
constexpr double kProduct[] = {6, 14};  // [ns] of two blocks

}  // namespace

template <int Dim>
double counted_ms(const physics::SceneOf<Dim>& scene, const physics::StepWork& work) {
  const Counts counts = counts_of(scene.body);
  constexpr int kRow = Dim - 2;
  return 1e-6 * (work.passes * kPass[kRow].of(counts) + work.sweeps * kSweep[kRow].of(counts) +
                 work.assemblies * kAssembly[kRow].of(counts) + work.products * kProduct[kRow]);
}
template double counted_ms<2>(const physics::SceneOf<2>&, const physics::StepWork&);
template double counted_ms<3>(const physics::SceneOf<3>&, const physics::StepWork&);

}  // namespace hydrostat::retarget
