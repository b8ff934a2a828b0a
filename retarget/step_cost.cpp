#include "retarget/step_cost.h"

#include "physics/system_matrix.h"
#include "retarget/step_parts.h"

namespace hydrostat::retarget {
namespace {

// In the order of physics::Method, in two and three dimensions; where `explicit` assembles it is its guard, `euler`.
// Fitted to processor time by tests/bench/run.sh costs -f FIT: least squares of the relative error, no constant below 0, 6,663 runs that
// no guard took over, the least of three times, one thread. Half of them lie within 0.95 and 1.04 of it, nine of ten within 0.70 and
// 1.14; without the halves, whose breaking is not counted, 0.88 and 1.13. Of two such machines one was 1.7 times as fast as the other: the
// constants lie between them, 1.3 times the faster one's. What stages of dashpots take was measured beside passes of bars of 27 to 4,225
// nodes (15 to 4,641 in the plane), and is told in the worth of these.
constexpr StepCosts kCosts[2][5] = {
    {
        {{.one = 380, .volumes = 12, .simplices = 22, .boxes = 40, .active_simplices = 160, .active_boxes = 190, .wet = 36},
         {.one = 19, .nodes = 8.5, .edges = 2.2, .dashpots = 1.4, .volumes = 1.1, .simplices = 3.6, .corotated = 4.4,
          .boxes = 9.3, .active_simplices = 10, .active_boxes = 9.4},
         {.edges = 47, .volumes = 43, .simplices = 380, .boxes = 690}, 2.9, 4.2, 11},  // explicit
        {{.one = 700, .springs = 8.2, .dashpots = 3.2, .active_simplices = 83, .active_boxes = 87, .wet = 71},
         {.edges = 4.3, .dashpots = 1.3, .volumes = 7.1, .simplices = 8.9, .corotated = 0.65, .boxes = 12,
          .active_simplices = 7.6, .active_boxes = 8},
         {.dashpots = 55, .volumes = 130, .simplices = 100, .corotated = 100, .boxes = 440}, 5.3},  // implicit
        {{.one = 980, .nodes = 57, .volumes = 4.4, .boxes = 25, .active_simplices = 130, .active_boxes = 150, .wet = 17},
         {.edges = 4.3, .dashpots = 1.3, .volumes = 7.1, .simplices = 8.9, .corotated = 0.65, .boxes = 12,
          .active_simplices = 7.6, .active_boxes = 8},
         {.edges = 47, .volumes = 43, .simplices = 380, .boxes = 690}, 2.9},  // euler
        {{.one = 130, .dashpots = 2.3, .simplices = 110, .corotated = 4.4, .boxes = 130, .active_simplices = 14,
          .active_boxes = 12, .wet = 63},
         {.one = 130, .springs = 6.5, .dashpots = 18, .volumes = 14, .simplices = 46, .corotated = 1.4, .boxes = 100},
         {}, 0},  // xpbd
        {{.one = 250, .nodes = 4.2, .edges = 0.42, .wet = 31},
         {.one = 24, .nodes = 3.8, .edges = 3.2, .dashpots = 0.24},
         {}, 0, 4.2, 11},  // spring
    },
    {
        {{.one = 350, .edges = 8.4, .volumes = 19, .simplices = 36, .active_simplices = 210, .active_boxes = 450, .wet = 100},
         {.one = 150, .edges = 7.6, .dashpots = 2.5, .volumes = 4.2, .simplices = 4.9, .corotated = 18, .active_simplices = 9.7,
          .active_boxes = 27},
         {.one = 1400, .springs = 49, .volumes = 130, .simplices = 2100, .boxes = 7800}, 6.8, 3.7, 12},  // explicit
        {{.one = 750, .dashpots = 1.4, .volumes = 40, .corotated = 19, .boxes = 240, .active_simplices = 110,
          .active_boxes = 530, .wet = 110},
         {.one = 190, .edges = 2.9, .springs = 2.2, .dashpots = 2.8, .volumes = 14, .simplices = 14, .corotated = 12,
          .boxes = 61, .active_simplices = 9.2},
         {.springs = 170, .dashpots = 10, .simplices = 1500, .corotated = 45, .boxes = 7400}, 9},  // implicit
        {{.one = 2900, .volumes = 59, .simplices = 47, .boxes = 500, .active_simplices = 150, .active_boxes = 470, .wet = 62},
         {.one = 190, .edges = 2.9, .springs = 2.2, .dashpots = 2.8, .volumes = 14, .simplices = 14, .corotated = 12,
          .boxes = 61, .active_simplices = 9.2},
         {.one = 1400, .springs = 49, .volumes = 130, .simplices = 2100, .boxes = 7800}, 6.8},  // euler
        {{.one = 120, .simplices = 99, .boxes = 270, .active_simplices = 47, .active_boxes = 35, .wet = 180},
         {.one = 150, .springs = 11, .dashpots = 24, .volumes = 28, .simplices = 140, .corotated = 110, .boxes = 490,
          .active_boxes = 3.2},
         {}, 0},  // xpbd
        {{.one = 260, .nodes = 3.1, .edges = 0.82, .springs = 0.051, .wet = 87},
         {.one = 70, .nodes = 6.4, .edges = 4.5, .springs = 0.053, .dashpots = 0.098},
         {}, 0, 3.7, 12},  // spring
    },
};
constexpr ContactCosts kContact[2] = {
    {26, 3200, 240, 0.33, 15, 15, 18},
    {26, 4500, 180, 0, 30, 0.67, 81},
};
// Of corrections likewise, as closed loops of the trot, the worm, a fox, a snake and a man pay them on 32 to 480 nodes (hydrostat bench
// speed): half of these 35 lie within 1.02 and 1.72 of 1.3 times the time, all within 0.69 and 2.11, for how often the response is made
// anew hangs on the motion. All had 117 muscles: what hangs on their number alone is kMuscles' share.
constexpr StepParts kResponseAssembly{.nodes = 45, .edges = 67, .simplices = 1970, .boxes = 6770};
constexpr double kResponseProduct = 10;    // [ns] of two blocks
constexpr double kColumnProduct = 2.5;     // [ns] of a block and one of many columns
constexpr double kNormal = 0.27;          // [ns] of a product in the normal equations
constexpr double kPlayed = 0.13;          // [ns] of a channel and a wave of it, two a harmonic, in playing signals
constexpr double kRows = 7.4;             // [ns] of a row and a muscle, in all that each call asks of the response
constexpr double kMuscles = 0.1;          // [ns] of a cubed muscle: solving within the cones
constexpr double kAnew = 0.66;            // share of the calls that make the response anew: 0.25 to 0.98 in replays of six creatures

double worth(const ContactCosts& costs, const physics::ContactWork& impulses, const physics::ContactWork& potential) {
  return costs.search * (impulses.searched + potential.searched) + costs.own_search * (impulses.own_searched + potential.own_searched) +
         costs.wide_look * (impulses.wide_looks + potential.wide_looks) + costs.impulse_look * impulses.looks +
         costs.impulse_push * impulses.pushes + costs.potential_look * potential.looks + costs.potential_push * potential.pushes;
}

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
                 counts.dashpots * (work.stages * costs.stage + work.placings * costs.placing) +
                 worth(kContact[Dim - 2], work.by_impulses, work.by_potential));
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
