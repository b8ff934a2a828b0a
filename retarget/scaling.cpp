#include "retarget/scaling.h"

#include <malloc.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <limits>
#include <memory>

namespace hydrostat::retarget {

using physics::BodyOf;
using physics::SceneOf;
using physics::StateOf;

namespace {

constexpr int kScalingRepeats = 3;
constexpr std::size_t kStreamed = std::size_t{1} << 23;  // numbers an array: three are more than caches hold
constexpr int kFused = 1 << 22;                          // rounds of kChains operations on four numbers each
constexpr int kChains = 12;  // that do not wait for each other: latency times width of today's units

double cpu_seconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

double clock_seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

double heap_bytes() {
  const auto heap = mallinfo2();
  return static_cast<double>(heap.uordblks + heap.hblkhd);
}

typedef double Quad __attribute__((vector_size(32)));  // NOLINT: attributes want a typedef

template <class Number>
inline double fuse_all() {
  Number sums[kChains];
  for (int k = 0; k < kChains; ++k) sums[k] = Number{} + 0.1 * k;
  Number factor = Number{} + 0.999999, term = Number{} + 1e-6;
  for (int round = 0; round < kFused; ++round) {
#pragma GCC unroll 12
    for (int k = 0; k < kChains; ++k) sums[k] = sums[k] * factor + term;
  }
  double sum = 0;
  for (int k = 0; k < kChains; ++k) sum += sums[k][0] + sums[k][1] + sums[k][2] + sums[k][3];
  return sum;
}

#if defined(__x86_64__) && defined(__GNUC__)
[[gnu::noinline, gnu::flatten, gnu::target("avx2,fma")]] double fuse_wide() { return fuse_all<Quad>(); }
bool is_wide() { return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"); }
#else
double fuse_wide() { return fuse_all<Quad>(); }
bool is_wide() { return false; }
#endif
[[gnu::noinline]] double fuse_plain() { return fuse_all<Quad>(); }

volatile double kept;  // so that no loop is left out

double measure_flops() {
  double best = std::numeric_limits<double>::infinity();
  for (int repeat = 0; repeat < kScalingRepeats; ++repeat) {
    const double start = cpu_seconds();
    kept = is_wide() ? fuse_wide() : fuse_plain();
    best = std::min(best, cpu_seconds() - start);
  }
  return 2.0 * 4 * kChains * kFused / best;
}

double measure_bandwidth() {
  std::vector<double> a(kStreamed, 0.0), b(kStreamed, 1.0), c(kStreamed, 2.0);
  double best = std::numeric_limits<double>::infinity();
  for (int repeat = 0; repeat < kScalingRepeats; ++repeat) {
    const double start = cpu_seconds();
    for (std::size_t k = 0; k < kStreamed; ++k) a[k] = b[k] + 0.5 * c[k];
    best = std::min(best, cpu_seconds() - start);
    kept = a[kStreamed / 2];
  }
  return 3.0 * sizeof(double) * kStreamed / best;
}

/// Stands on stepping one scene; times are of a step.
template <int Dim>
struct Stopwatch {
  const ScenarioOf<Dim>& scenario;
  const ScalingOptions& options;
  double cpu = 0, clock = 0;  // [s] the best
  double substep = 0;         // [s]
  double heap = 0;            // [bytes]
  bool is_whole = true;

  void run(int threads) {
    const double before = heap_bytes();
    SceneOf<Dim> scene = scenario.scene;
    scene.threads = threads;
    const std::unique_ptr<physics::StepperOf<Dim>> stepper = make_stepper(options.method, scene);
    heap = heap_bytes() - before;
    substep = stepper->substep(options.dt_s);
    physics::ImpulsesOf<Dim> impulses = make_impulses(scene);
    StateOf<Dim> state = scenario.start;
    Eigen::VectorXd activation = Eigen::VectorXd::Ones(scene.body.edge_count());
    activations_at(scenario.waves, 0, activation);
    const auto step = [&] {
      is_whole =
          is_whole && stepper->step(options.dt_s, activation, nullptr, state, impulses) == physics::Termination::kDone;
    };
    step();  // wakes caches and threads
    cpu = clock = std::numeric_limits<double>::infinity();
    for (int repeat = 0; repeat < kScalingRepeats && is_whole; ++repeat) {
      const double cpu_start = cpu_seconds(), start = clock_seconds();
      int steps = 0;
      for (; is_whole && (steps == 0 || clock_seconds() - start < options.least_time); ++steps) step();
      cpu = std::min(cpu, (cpu_seconds() - cpu_start) / steps);
      clock = std::min(clock, (clock_seconds() - start) / steps);
    }
  }
};

}  // namespace

MachineLimits measure_machine() { return {measure_bandwidth(), measure_flops()}; }

namespace {

// Of a node: x and v read and written, the force set to zero, read and written, mass and its inverse read.
template <int Dim>
constexpr double kBytesOfNode = (7 * Dim + 2) * sizeof(double);
constexpr double kFlopsOfNode = 15;

/// Of a body of springs with volumes, for a tet.
template <int Dim>
ElementWork work_of_springs(const BodyOf<Dim>& body) {
  const double tets = body.tet_count(), edges = body.edge_count() / tets, nodes = body.node_count() / tets;
  ElementWork work;
  work.bytes = edges * (2 * sizeof(int) + 4 * sizeof(double)) + (Dim + 1) * sizeof(int) + 2 * sizeof(double) +
               kBytesOfNode<Dim> * nodes;
  // Spring with dashpot: 3 span, 5 its square, 5 spring, 3 rates, 8 dashpot, 3 pull, 6 to add. Volume: 9 spans, 27 normals of
  // faces, 11 pressure, 9 forces, 9 of the first node, 12 to add.
  if (Dim == 3) work.flops = 33 * edges + 77 + kFlopsOfNode * nodes;
  return work;
}

}  // namespace

template <int Dim>
ElementWork work_of(const BodyOf<Dim>& body) {
  if (body.elements.empty()) return work_of_springs(body);
  ElementWork work;
  if (body.elements.size() != 1) return work;
  const physics::ElementBlock<Dim>& block = body.elements.front().block;
  const double elements = block.element_count(), numbers = static_cast<double>(block.lanes.size()) * physics::Lanes::kCount;
  work.bytes = (numbers / elements) * sizeof(double) + block.nodes_per_element() * sizeof(int) +
               kBytesOfNode<Dim> * body.node_count() / elements;
  // Stable neo-Hookean tet: 9 spans, 45 F, 27 cofactors, 5 J, 18 invariant, 8 shear and its factor, 4 pressure, 27 stress,
  // 54 forces, 9 of the first node, 12 to add.
  if (Dim == 3 && !block.is_box() && block.law == physics::ElasticLaw::kStableNeoHookean) {
    work.flops = 218 + kFlopsOfNode * body.node_count() / elements;
  }
  return work;
}

template <int Dim>
ScalingRow measure_scaling(const ScenarioOf<Dim>& scenario, const ScalingOptions& options) {
  const BodyOf<Dim>& body = scenario.scene.body;
  ScalingRow row;
  row.elements = body.elements.empty() ? body.tet_count() : body.elements.front().block.element_count();
  row.nodes = body.node_count();
  row.work = work_of(body);
  Stopwatch<Dim> one{scenario, options}, shared{scenario, options};
  one.run(1);
  shared.run(options.threads);
  row.is_whole = one.is_whole && shared.is_whole;
  row.substeps_per_s = 1 / one.substep;
  row.bytes = one.heap / row.elements;
  if (!row.is_whole) return row;
  const double per_element = 1e9 * one.substep / options.dt_s / row.elements;
  row.cpu_ns = one.cpu * per_element;
  row.one_ns = one.clock * per_element;
  row.shared_ns = shared.clock * per_element;
  return row;
}

double growth_exponent(const std::vector<ScalingRow>& rows) {
  double count = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (const ScalingRow& row : rows) {
    if (!row.is_whole) continue;
    const double elements = std::log(row.elements), time = std::log(row.cpu_ns * row.elements);
    ++count;
    x += elements;
    y += time;
    xx += elements * elements;
    xy += elements * time;
  }
  return (count * xy - x * y) / (count * xx - x * x);
}

template ElementWork work_of<2>(const BodyOf<2>&);
template ElementWork work_of<3>(const BodyOf<3>&);
template ScalingRow measure_scaling<2>(const ScenarioOf<2>&, const ScalingOptions&);
template ScalingRow measure_scaling<3>(const ScenarioOf<3>&, const ScalingOptions&);

}  // namespace hydrostat::retarget
