#include "retarget/step_cost.h"

#include "physics/system_matrix.h"
#include "retarget/step_parts.h"

namespace hydrostat::retarget {
namespace {

// In the order of physics::Method, in two and three dimensions; where `explicit` assembles it is its guard, `euler`.
// Fitted to processor time by tests/bench/run.sh costs -f FIT: least squares of the relative error, no constant below 0, 4,778 runs that
// no guard took over, the least of three times. Half of them lie within 0.97 and 1.03 of it, nine of ten within 0.90 and 1.10, on the
// machine on which they were taken: one thread, nothing beside it. Of two such machines one was 1.7 times as fast as the other;
// the constants lie between them, 1.3 times the faster one's.
constexpr StepCosts kCosts[2][5] = {
    {
        {{.one = 400, .volumes = 11, .simplices = 22, .boxes = 40, .active_simplices = 160, .active_boxes = 180, .wet = 38},
         {.nodes = 9.8, .edges = 2.9, .dashpots = 1.1, .simplices = 2.1, .corotated = 4.3, .boxes = 6, .active_simplices = 11,
          .active_boxes = 10},
         {.nodes = 6.1, .edges = 77, .simplices = 340, .boxes = 560},
         3.1, 9.5, 6.2, 27},  // explicit
        {{.dashpots = 11, .volumes = 34, .corotated = 5.1, .active_simplices = 94, .active_boxes = 120, .wet = 43},
         {.one = 10, .nodes = 16, .dashpots = 1.1, .simplices = 2, .corotated = 0.66, .boxes = 2.2, .active_simplices = 7,
          .active_boxes = 6.9},
         {.one = 1600, .nodes = 73, .edges = 39, .dashpots = 51, .volumes = 88, .simplices = 77, .corotated = 84, .boxes = 170},
         7.3, 160, 0, 7.4},  // implicit
        {{.one = 180, .nodes = 75, .boxes = 22, .active_simplices = 120, .active_boxes = 160, .wet = 20},
         {.one = 10, .nodes = 16, .dashpots = 1.1, .simplices = 2, .corotated = 0.66, .boxes = 2.2, .active_simplices = 7,
          .active_boxes = 6.9},
         {.nodes = 6.1, .edges = 77, .simplices = 340, .boxes = 560},
         3.1, 160, 0, 7.4},  // euler
        {{.one = 320, .simplices = 100, .boxes = 110, .active_simplices = 17, .active_boxes = 23, .wet = 51},
         {.one = 87, .springs = 7.2, .dashpots = 20, .volumes = 14, .simplices = 47, .corotated = 2.1, .boxes = 100},
         {},
         0, 9.5, 6.2, 27},  // xpbd
        {{.one = 290, .nodes = 3.2, .edges = 0.36, .wet = 29},
         {.one = 18, .nodes = 4.2, .edges = 3.2},
         {},
         0, 9.5, 6.2, 27},  // spring
    },
    {
        {{.one = 490, .edges = 8.1, .volumes = 17, .simplices = 32, .active_simplices = 200, .active_boxes = 440, .wet = 100},
         {.one = 110, .edges = 7.5, .dashpots = 2.2, .volumes = 5.1, .simplices = 5.1, .corotated = 20, .active_simplices = 11,
          .active_boxes = 31},
         {.one = 2200, .springs = 31, .volumes = 160, .simplices = 2100, .boxes = 7800},
         6.8, 16, 4.7, 36},  // explicit
        {{.springs = 20, .dashpots = 7.4, .volumes = 10, .corotated = 26, .active_simplices = 73, .active_boxes = 460, .wet = 92},
         {.one = 300, .edges = 1.3, .dashpots = 2.2, .volumes = 20, .simplices = 16, .corotated = 13, .boxes = 110,
          .active_simplices = 11, .active_boxes = 6.1},
         {.one = 3000, .edges = 180, .dashpots = 73, .simplices = 1100, .corotated = 65, .boxes = 3000},
         9.4, 290, 0, 3.6},  // implicit
        {{.one = 2200, .volumes = 75, .simplices = 64, .boxes = 550, .active_simplices = 170, .active_boxes = 380, .wet = 57},
         {.one = 300, .edges = 1.3, .dashpots = 2.2, .volumes = 20, .simplices = 16, .corotated = 13, .boxes = 110,
          .active_simplices = 11, .active_boxes = 6.1},
         {.one = 2200, .springs = 31, .volumes = 160, .simplices = 2100, .boxes = 7800},
         6.8, 290, 0, 3.6},  // euler
        {{.one = 160, .simplices = 92, .boxes = 230, .active_simplices = 43, .active_boxes = 51, .wet = 130},
         {.one = 120, .springs = 11, .dashpots = 25, .volumes = 32, .simplices = 140, .corotated = 110, .boxes = 490,
          .active_simplices = 3.5, .active_boxes = 13},
         {},
         0, 16, 4.7, 36},  // xpbd
        {{.one = 290, .nodes = 4.8, .edges = 0.44, .wet = 86},
         {.one = 51, .nodes = 6, .edges = 4.8},
         {},
         0, 16, 4.7, 36},  // spring
    },
};
// Of corrections likewise, as closed loops of the trot, the worm, a fox and a snake pay them on 32 to 760 nodes (hydrostat bench speed): half of
// these 32 lie within 0.98 and 1.33 of 1.3 times the time, all within 0.72 and 1.82. All had 117 muscles: what hangs on their number alone is
// kMuscles' share.
constexpr StepParts kResponseAssembly{.nodes = 45, .edges = 67, .simplices = 1970, .boxes = 6770};
constexpr double kResponseProduct = 10;   // [ns] of two blocks
constexpr double kColumnProduct = 2.5;   // [ns] of a block and one of many columns
constexpr double kNormal = 0.27;         // [ns] of a product in the normal equations
constexpr double kPlayed = 0.13;         // [ns] of a channel and a wave of it, two a harmonic, in playing signals
constexpr double kRows = 7.4;            // [ns] of a row and a muscle, in all that each call asks of the response
constexpr double kMuscles = 0.1;         // [ns] of a cubed muscle: solving within the cones
constexpr double kAnew = 0.66;           // share of the calls that make the response anew: 0.25 to 0.98 in replays of six creatures

template <int Dim>
const StepCosts& costs_of(physics::Method method) {
  return kCosts[Dim - 2][static_cast<std::size_t>(method)];
}

}  // namespace

template <int Dim>
StepParts parts_of(const physics::SceneOf<Dim>& scene, bool is_active) {
  const physics::BodyOf<Dim>& body = scene.body;
  StepParts counts;
  counts.one = 1;
  counts.nodes = body.node_count();
  counts.edges = body.edge_count();
  counts.springs = static_cast<double>((body.edge_stiffness.array() > 0).count());
  counts.dashpots = static_cast<double>((body.edge_damping.array() > 0).count());
  counts.volumes = static_cast<double>(body.volume_stiffness.size());
  for (const physics::BodyElements<Dim>& elements : body.elements) {
    const double count = elements.block.element_count();
    (elements.block.is_box() ? counts.boxes : counts.simplices) += count;
    if (!elements.block.is_box() && elements.block.law == physics::ElasticLaw::kCorotatedLinear) counts.corotated += count;
  }
  if (is_active) {
    counts.active_simplices = counts.simplices;
    counts.active_boxes = counts.boxes;
  }
  counts.wet = static_cast<double>(scene.contact_points.count()) * ((scene.water ? 1 : 0) + (scene.air ? 1 : 0));
  return counts;
}
template StepParts parts_of<2>(const physics::SceneOf<2>&, bool);
template StepParts parts_of<3>(const physics::SceneOf<3>&, bool);

template <int Dim>
double counted_ms(const physics::SceneOf<Dim>& scene, physics::Method method, bool is_active, double steps,
                  const physics::StepWork& work) {
  const StepParts counts = parts_of(scene, is_active);
  const StepCosts& costs = costs_of<Dim>(method);
  return 1e-6 * (steps * worth(costs.step, counts) + (work.passes + work.sweeps) * worth(costs.pass, counts) +
                 work.assemblies * worth(costs.assembly, counts) + work.products * costs.product +
                 work.searched * costs.search + work.looks * costs.look + work.pushes * costs.push);
}
template double counted_ms<2>(const physics::SceneOf<2>&, physics::Method, bool, double, const physics::StepWork&);
template double counted_ms<3>(const physics::SceneOf<3>&, physics::Method, bool, double, const physics::StepWork&);

double counted_ms_of_signals(Eigen::Index channels, int harmonics) {
  return 1e-6 * kPlayed * static_cast<double>(channels) * 2 * (harmonics + 1);
}

double counted_ms_of_correction(const physics::Scene& scene, Eigen::Index muscles) {
  const StepParts counts = parts_of(scene, true);
  const physics::SystemMatrix matrix(scene.body);
  const double rows = 3 * counts.nodes, columns = static_cast<double>(muscles);
  const double response = worth(kResponseAssembly, counts) + kResponseProduct * matrix.products_to_factor() +
                          kColumnProduct * columns * matrix.products_to_solve() + kNormal * rows * columns * columns / 2;
  return 1e-6 * (kAnew * response + kRows * rows * columns + kMuscles * columns * columns * columns);
}

}  // namespace hydrostat::retarget
