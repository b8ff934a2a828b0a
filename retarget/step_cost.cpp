#include "retarget/step_cost.h"

#include "physics/system_matrix.h"

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
// Fitted to the processor time of 360 runs (least squares of the relative error, no constant below 0): bars of 20 to 300
// nodes in the plane and of 40 to 400 in space, of springs, triangles or tets, quads or hexahedra, with and without
// dashpots, clamped at one end, by every method at 60 and 240 steps/s; one thread of a machine that did other work too, the
// best of eight times. Nine of ten runs lie within 0.6 and 1.25 of it.
constexpr Cost kSubstep[] = {{31, 4, 0, 5, 9, 0}, {24, 4, 29, 30, 200, 0}};  // explicit
// What springs' own substep takes of that of `explicit`, and what an outer step does, is from bars of 27 to 400 nodes, each in
// three steps, the best of nine times.
constexpr Cost kSpringSubstep[] = {{30, 0, 0, 0, 0, 1.7}, {2, 0, 0, 0, 0, 15.5}};
constexpr double kGuardedStep[] = {36, 130};  // [ns] of a node
constexpr Cost kPass[] = {{0, 6, 36, 37, 76, 0}, {0, 4, 39, 31, 200, 0}};  // implicit, euler
constexpr Cost kSweep[] = {{19, 14, 18, 80, 140, 0}, {0, 26, 58, 235, 850, 0}};
constexpr Cost kAssembly[] = {{300, 0, 21, 516, 906, 0}, {67, 100, 0, 2940, 10100, 0}};
constexpr double kProduct[] = {2.1, 15};  // [ns] of two blocks
// Of corrections likewise, in replays of two dogs, a snake and a frog on 28 to 870 nodes, 48 to 72 of each: three of four
// levels lie within 0.85 and 1.2 of it, all within 0.7 and 1.6. All had 117 muscles: what hangs on their number alone is
// kMuscles' share.
constexpr double kColumnProduct = 3.8;  // [ns] of a block and one of many columns
constexpr double kNormal = 0.41;        // [ns] of a product in the normal equations
constexpr double kPlayed = 0.2;         // [ns] of a channel and a wave of it, two a harmonic, in playing signals
constexpr double kRows = 11;            // [ns] of a row and a muscle, in all that each call asks of the response
constexpr double kMuscles = 0.15;       // [ns] of a cubed muscle: solving within the cones
constexpr double kAnew = 0.66;          // share of the calls that make the response anew: 0.25 to 0.98 in replays of six creatures

const Cost& cost_of_pass(physics::Method method, int row) {
  if (method == physics::Method::kExplicit) return kSubstep[row];
  return method == physics::Method::kSpring ? kSpringSubstep[row] : kPass[row];
}

}  // namespace

template <int Dim>
double counted_ms(const physics::SceneOf<Dim>& scene, physics::Method method, const physics::StepWork& work) {
  const Counts counts = counts_of(scene.body);
  constexpr int kRow = Dim - 2;
  return 1e-6 * (work.passes * cost_of_pass(method, kRow).of(counts) + work.sweeps * kSweep[kRow].of(counts) +
                 work.assemblies * kAssembly[kRow].of(counts) + work.products * kProduct[kRow]);
}
template double counted_ms<2>(const physics::SceneOf<2>&, physics::Method, const physics::StepWork&);
template double counted_ms<3>(const physics::SceneOf<3>&, physics::Method, const physics::StepWork&);

template <int Dim>
double counted_ms_of_steps(const physics::SceneOf<Dim>& scene, physics::Method method, double steps) {
  if (method != physics::Method::kExplicit) return 0;
  return 1e-6 * kGuardedStep[Dim - 2] * scene.body.node_count() * steps;
}
template double counted_ms_of_steps<2>(const physics::SceneOf<2>&, physics::Method, double);
template double counted_ms_of_steps<3>(const physics::SceneOf<3>&, physics::Method, double);

double counted_ms_of_signals(Eigen::Index channels, int harmonics) {
  return 1e-6 * kPlayed * static_cast<double>(channels) * 2 * (harmonics + 1);
}

double counted_ms_of_correction(const physics::Scene& scene, Eigen::Index muscles) {
  const Counts counts = counts_of(scene.body);
  const physics::SystemMatrix matrix(scene.body);
  const double rows = 3 * counts.nodes, columns = static_cast<double>(muscles);
  const double response = kAssembly[1].of(counts) + kProduct[1] * matrix.products_to_factor() +
                          kColumnProduct * columns * matrix.products_to_solve() + kNormal * rows * columns * columns / 2;
  return 1e-6 * (kAnew * response + kRows * rows * columns + kMuscles * columns * columns * columns);
}

}  // namespace hydrostat::retarget
