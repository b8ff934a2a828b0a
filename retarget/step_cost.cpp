#include "retarget/step_cost.h"

#include "physics/system_matrix.h"

namespace hydrostat::retarget {
namespace {

/// What a step goes over: how much of each there is, or what one of each takes [ns].
struct Parts {
  double one = 0, nodes = 0, edges = 0, springs = 0, dashpots = 0, volumes = 0;
  double simplices = 0, corotated = 0, boxes = 0;    // elements; corotated: of the simplices those of that law, on top
  double active_simplices = 0, active_boxes = 0;     // likewise where activations change
  double touching = 0, wet = 0;                      // places of the surface: for each thing that may be touched, each fluid
};
double operator*(const Parts& a, const Parts& b) {
  return a.one * b.one + a.nodes * b.nodes + a.edges * b.edges + a.springs * b.springs + a.dashpots * b.dashpots +
         a.volumes * b.volumes + a.simplices * b.simplices + a.corotated * b.corotated + a.boxes * b.boxes +
         a.active_simplices * b.active_simplices + a.active_boxes * b.active_boxes + a.touching * b.touching +
         a.wet * b.wet;
}

template <int Dim>
Parts counts_of(const physics::SceneOf<Dim>& scene, bool is_active) {
  const physics::BodyOf<Dim>& body = scene.body;
  Parts counts;
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
  const double places = scene.contact_points.count();
  counts.touching = places * (static_cast<double>(scene.obstacles.size()) + (scene.has_ground ? 1 : 0));
  counts.wet = places * ((scene.water ? 1 : 0) + (scene.air ? 1 : 0));
  return counts;
}

/// [ns] of a method.
struct Cost {
  Parts step, pass, assembly;  // an outer step, a pass over the body (a sweep over its constraints), an assembled matrix
  double product;              // of two blocks
};
// In the order of physics::Method, in two and three dimensions; where `explicit` assembles it is its guard, euler.
// Fitted to processor time (least squares of the relative error, no constant below 0; euler's passes as those of implicit): 3,819
// runs of tests/bench/run.sh costs on one thread of a machine of two cores that did much other work too, the least of three times.
// Half of them lie within 0.87 and 1.07 of it, nine of ten within 0.71 and 1.19: where a time was longer something else ran.
constexpr Cost kCosts[2][5] = {
    {
        {{.one = 960, .nodes = 31, .simplices = 16, .boxes = 16, .active_simplices = 210, .active_boxes = 230, .touching = 73, .wet = 73},
         {.nodes = 9.1, .dashpots = 2.3, .volumes = 10, .simplices = 10, .corotated = 2.3, .boxes = 21, .active_simplices = 14,
          .active_boxes = 13, .touching = 6.8},
         {.volumes = 190, .simplices = 610, .boxes = 1100}, 3.2},  // explicit
        {{.one = 750, .active_simplices = 77, .active_boxes = 96, .touching = 200, .wet = 83},
         {.nodes = 19, .dashpots = 3.2, .volumes = 11, .simplices = 5.3, .boxes = 8.5, .active_simplices = 12, .active_boxes = 9.6},
         {.volumes = 440, .simplices = 540, .boxes = 850}, 6.4},  // implicit
        {{.one = 860, .nodes = 57, .boxes = 100, .active_simplices = 110, .active_boxes = 140, .touching = 560, .wet = 160},
         {.nodes = 19, .dashpots = 3.2, .volumes = 11, .active_simplices = 12},
         {.volumes = 190, .simplices = 610, .boxes = 1100}, 3.2},  // euler
        {{.one = 1000, .simplices = 110, .boxes = 110, .active_simplices = 33, .active_boxes = 44, .touching = 32, .wet = 110},
         {.nodes = 4, .dashpots = 25, .volumes = 42, .simplices = 75, .boxes = 140},
         {}, 0},  // xpbd
        {{.one = 920, .nodes = 6.9, .touching = 41, .wet = 80},
         {.nodes = 10, .edges = 3.4, .touching = 11},
         {}, 0},  // spring
    },
    {
        {{.one = 360, .nodes = 92, .simplices = 33, .boxes = 31, .active_simplices = 250, .active_boxes = 560, .touching = 38, .wet = 130},
         {.nodes = 15, .springs = 2.2, .dashpots = 2.2, .volumes = 12, .simplices = 17, .corotated = 23, .boxes = 120,
          .active_simplices = 17, .active_boxes = 79, .touching = 16},
         {.springs = 150, .simplices = 2900, .boxes = 11000}, 10},  // explicit
        {{.one = 3700, .boxes = 650, .touching = 280, .wet = 130},
         {.nodes = 8.6, .springs = 5.3, .dashpots = 3.2, .volumes = 13, .simplices = 20, .corotated = 14, .boxes = 73,
          .active_simplices = 21, .active_boxes = 61, .touching = 6.4},
         {.nodes = 510, .springs = 100, .simplices = 2000, .boxes = 11000}, 14},  // implicit
        {{.nodes = 210, .boxes = 1200, .active_simplices = 200, .touching = 580},
         {.nodes = 8.6, .springs = 5.3, .dashpots = 3.2, .volumes = 13},
         {.springs = 150, .simplices = 2900, .boxes = 11000}, 10},  // euler
        {{.simplices = 100, .boxes = 260, .active_simplices = 120, .active_boxes = 320, .wet = 150},
         {.springs = 17, .dashpots = 35, .volumes = 39, .simplices = 170, .corotated = 110, .boxes = 800},
         {}, 0},  // xpbd
        {{.one = 1300, .nodes = 7, .touching = 42, .wet = 140},
         {.nodes = 8.1, .edges = 7, .touching = 13},
         {}, 0},  // spring
    },
};
// Of corrections likewise, in replays of two dogs, a snake and a frog on 28 to 870 nodes, 48 to 72 of each: three of four
// levels lie within 0.85 and 1.2 of it, all within 0.7 and 1.6. All had 117 muscles: what hangs on their number alone is
// kMuscles' share.
constexpr Parts kResponseAssembly{.nodes = 67, .edges = 100, .simplices = 2940, .boxes = 10100};
constexpr double kResponseProduct = 15;  // [ns] of two blocks
constexpr double kColumnProduct = 3.8;  // [ns] of a block and one of many columns
constexpr double kNormal = 0.41;        // [ns] of a product in the normal equations
constexpr double kPlayed = 0.2;         // [ns] of a channel and a wave of it, two a harmonic, in playing signals
constexpr double kRows = 11;            // [ns] of a row and a muscle, in all that each call asks of the response
constexpr double kMuscles = 0.15;       // [ns] of a cubed muscle: solving within the cones
constexpr double kAnew = 0.66;          // share of the calls that make the response anew: 0.25 to 0.98 in replays of six creatures

template <int Dim>
const Cost& cost_of(physics::Method method) {
  return kCosts[Dim - 2][static_cast<std::size_t>(method)];
}

}  // namespace

template <int Dim>
double counted_ms(const physics::SceneOf<Dim>& scene, physics::Method method, bool is_active, double steps,
                  const physics::StepWork& work) {
  const Parts counts = counts_of(scene, is_active);
  const Cost& cost = cost_of<Dim>(method);
  return 1e-6 * (steps * (cost.step * counts) + (work.passes + work.sweeps) * (cost.pass * counts) +
                 work.assemblies * (cost.assembly * counts) + work.products * cost.product);
}
template double counted_ms<2>(const physics::SceneOf<2>&, physics::Method, bool, double, const physics::StepWork&);
template double counted_ms<3>(const physics::SceneOf<3>&, physics::Method, bool, double, const physics::StepWork&);

double counted_ms_of_signals(Eigen::Index channels, int harmonics) {
  return 1e-6 * kPlayed * static_cast<double>(channels) * 2 * (harmonics + 1);
}

double counted_ms_of_correction(const physics::Scene& scene, Eigen::Index muscles) {
  const Parts counts = counts_of(scene, true);
  const physics::SystemMatrix matrix(scene.body);
  const double rows = 3 * counts.nodes, columns = static_cast<double>(muscles);
  const double response = kResponseAssembly * counts + kResponseProduct * matrix.products_to_factor() +
                          kColumnProduct * columns * matrix.products_to_solve() + kNormal * rows * columns * columns / 2;
  return 1e-6 * (kAnew * response + kRows * rows * columns + kMuscles * columns * columns * columns);
}

}  // namespace hydrostat::retarget
