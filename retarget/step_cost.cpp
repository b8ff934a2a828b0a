#include "retarget/step_cost.h"

#include "physics/system_matrix.h"

namespace hydrostat::retarget {
namespace {

/// What a step goes over: how much of each there is, or what one of each takes [ns].
struct Parts {
  double one = 0, nodes = 0, edges = 0, springs = 0, dashpots = 0, volumes = 0;
  double simplices = 0, corotated = 0, boxes = 0;  // elements; corotated: of the simplices those of that law, on top
  double touching = 0, wet = 0;                    // places of the surface: for each thing that may be touched, each fluid
};
double operator*(const Parts& a, const Parts& b) {
  return a.one * b.one + a.nodes * b.nodes + a.edges * b.edges + a.springs * b.springs + a.dashpots * b.dashpots +
         a.volumes * b.volumes + a.simplices * b.simplices + a.corotated * b.corotated + a.boxes * b.boxes +
         a.touching * b.touching + a.wet * b.wet;
}

template <int Dim>
Parts counts_of(const physics::SceneOf<Dim>& scene) {
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
// Fitted to processor time (least squares of the relative error, no constant below 0; euler's passes as those of implicit): some
// 4,100 runs of tests/bench/run.sh costs on one thread of a machine of two cores that did other work too, the least of two to four
// times. Nine of ten lie within 0.74 and 1.2 of it.
constexpr Cost kCosts[2][5] = {
    {
        {{.one = 820, .nodes = 20, .simplices = 200, .boxes = 230, .touching = 28, .wet = 62},
         {.nodes = 19, .volumes = 4.4, .simplices = 20, .corotated = 6.6, .boxes = 35, .touching = 6.6},
         {.springs = 79, .volumes = 17, .simplices = 620, .boxes = 1100}, 5.5},  // explicit
        {{.nodes = 80, .simplices = 57, .touching = 180, .wet = 76},
         {.nodes = 21, .dashpots = 2.2, .simplices = 13, .boxes = 19},
         {.nodes = 390, .volumes = 210, .simplices = 89}, 8.8},  // implicit
        {{.one = 230, .nodes = 110, .simplices = 100, .boxes = 160, .touching = 410, .wet = 45},
         {.nodes = 21, .dashpots = 2.2, .simplices = 13, .boxes = 19},
         {.springs = 79, .volumes = 17, .simplices = 620, .boxes = 1100}, 5.5},  // euler
        {{.one = 650, .simplices = 160, .boxes = 190, .touching = 23, .wet = 52},
         {.springs = 24, .dashpots = 26, .simplices = 71, .corotated = 6, .boxes = 160},
         {}, 0},  // xpbd
        {{.one = 830, .nodes = 3.3, .touching = 30, .wet = 53},
         {.nodes = 2.2, .edges = 6.7, .touching = 16},
         {}, 0},  // spring
    },
    {
        {{.nodes = 98, .simplices = 260, .boxes = 470, .touching = 68, .wet = 150},
         {.nodes = 43, .springs = 1.1, .dashpots = 2.2, .volumes = 7.6, .simplices = 27, .corotated = 25, .boxes = 170},
         {.springs = 120, .volumes = 190, .simplices = 3000, .boxes = 11000}, 9},  // explicit
        {{.one = 4800, .nodes = 34, .simplices = 150, .touching = 470, .wet = 100},
         {.nodes = 6.5, .dashpots = 4.3, .volumes = 35, .simplices = 34, .corotated = 19, .boxes = 190},
         {.nodes = 980, .springs = 120, .volumes = 400, .simplices = 2700, .boxes = 8500}, 9.7},  // implicit
        {{.one = 1400, .nodes = 49, .simplices = 180, .boxes = 2000, .touching = 750, .wet = 73},
         {.nodes = 6.5, .dashpots = 4.3, .volumes = 35, .simplices = 34, .boxes = 190},
         {.springs = 120, .volumes = 190, .simplices = 3000, .boxes = 11000}, 9},  // euler
        {{.one = 910, .simplices = 200, .boxes = 480, .wet = 150},
         {.nodes = 18, .springs = 9.2, .dashpots = 35, .volumes = 54, .simplices = 150, .corotated = 130, .boxes = 710},
         {}, 0},  // xpbd
        {{.one = 1200, .nodes = 4.4, .touching = 36, .wet = 140},
         {.nodes = 10, .edges = 6.7, .touching = 16},
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
double counted_ms(const physics::SceneOf<Dim>& scene, physics::Method method, double steps, const physics::StepWork& work) {
  const Parts counts = counts_of(scene);
  const Cost& cost = cost_of<Dim>(method);
  return 1e-6 * (steps * (cost.step * counts) + (work.passes + work.sweeps) * (cost.pass * counts) +
                 work.assemblies * (cost.assembly * counts) + work.products * cost.product);
}
template double counted_ms<2>(const physics::SceneOf<2>&, physics::Method, double, const physics::StepWork&);
template double counted_ms<3>(const physics::SceneOf<3>&, physics::Method, double, const physics::StepWork&);

double counted_ms_of_signals(Eigen::Index channels, int harmonics) {
  return 1e-6 * kPlayed * static_cast<double>(channels) * 2 * (harmonics + 1);
}

double counted_ms_of_correction(const physics::Scene& scene, Eigen::Index muscles) {
  const Parts counts = counts_of(scene);
  const physics::SystemMatrix matrix(scene.body);
  const double rows = 3 * counts.nodes, columns = static_cast<double>(muscles);
  const double response = kResponseAssembly * counts + kResponseProduct * matrix.products_to_factor() +
                          kColumnProduct * columns * matrix.products_to_solve() + kNormal * rows * columns * columns / 2;
  return 1e-6 * (kAnew * response + kRows * rows * columns + kMuscles * columns * columns * columns);
}

}  // namespace hydrostat::retarget
