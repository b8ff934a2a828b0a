#pragma once

#include <vector>

#include "retarget/scenario.h"

namespace hydrostat::retarget {

/// What this machine does at most on one thread, as own loops measure it.
struct MachineLimits {
  double bytes_per_s = 0;  // read and written in a = b + s c over arrays that no cache holds
  double flops = 0;        // [1/s] fused products and sums on numbers that stay in registers, two operations each
};
MachineLimits measure_machine();

/// What a substep of `explicit` has to do for one element at least, counted from the formulas.
struct ElementWork {
  double flops = 0;  // 0: not counted for this element and law
  double bytes = 0;  // data of the element, and of its share of the nodes, each once
};
template <int Dim>
ElementWork work_of(const physics::BodyOf<Dim>& body);

struct ScalingOptions {
  physics::Method method = physics::Method::kExplicit;
  double dt_s = 1.0 / 240;
  int threads = 2;          // of the second measurement
  double least_time = 0.1;  // [s] of a measurement, the best of three of which counts
};

/// One body's cost.
struct ScalingRow {
  int elements = 0, nodes = 0;
  double substeps_per_s = 0;
  double cpu_ns = 0;                 // [ns] of processor time an element and substep, on one thread
  double one_ns = 0, shared_ns = 0;  // [ns] on the clock an element and substep: on one thread, on ScalingOptions::threads
  double bytes = 0;                  // of memory that scene and stepper hold, an element
  ElementWork work;
  bool is_whole = true;  // false: the method gave up; the times are then 0
};
template <int Dim>
ScalingRow measure_scaling(const ScenarioOf<Dim>& scenario, const ScalingOptions& options);

/// The power of the number of elements with which the processor time of a substep grows: the slope of a line through the
/// logarithms.
double growth_exponent(const std::vector<ScalingRow>& rows);

}  // namespace hydrostat::retarget
