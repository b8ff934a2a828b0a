// What damping costs: processor time of explicit and of implicit at 240 steps/s over the damping time and Young's modulus,
// on a bar of 192 tets and on a body of springs of 200 nodes, both held at one end and let go under gravity. Usage:
// damping_bench [-o DIR]. Writes DIR/damping.csv (default DIR: out/damping) and prints the table in markdown, and for each
// damping time from which Young's modulus on implicit is cheaper.
#include <gtest/gtest.h>  // which the scenes of the tests want

#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <limits>

#include "tests/physics/element_method_scene.h"

namespace hydrostat::bench {
namespace {

using physics::Method;

constexpr double kDampingTimes[] = {0, 0.001, 0.003, 0.01, 0.03};   // [s]
constexpr double kYoungsModuli[] = {1e5, 3e5, 1e6, 3e6, 1e7, 3e7};  // [Pa]
constexpr double kDuration = 0.5;                                   // [s]
constexpr int kStepsPerSecond = 240;
constexpr int kRepeats = 3;  // the best of which counts

double cpu_seconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

physics::Scene tet_bar(double youngs_modulus, double damping_time) {
  physics::Scene scene = physics::cantilever<3>(8, 2, physics::Cut::kSixTets, {1000, youngs_modulus, 0.4});
  const physics::ElementMesh<3> mesh =
      physics::element_bar<3>({8, 2, 2}, {1, 0.25, 0.25}, physics::Cut::kSixTets, {1000, youngs_modulus, 0.4});
  const std::vector<int> held = scene.body.held;
  scene.body =
      physics::make_body(mesh, physics::ElementBodyOptions{physics::ElasticLaw::kStableNeoHookean, 0, damping_time});
  scene.body.held = held;
  return scene;
}

physics::Scene spring_bar(double youngs_modulus, double damping_time) {
  physics::Material material;
  material.youngs_modulus = youngs_modulus;
  material.damping_time = damping_time;
  physics::Scene scene = physics::in_the_air<3>(physics::bar<3>(7, 4, 4, 0.1, material), true);
  for (int i = 0; i < scene.body.node_count(); ++i) {
    if (scene.body.rest(0, i) < 1e-9) scene.body.held.push_back(i);
  }
  return scene;
}

struct Cost {
  double ms_per_second = std::numeric_limits<double>::infinity();
  double substeps_per_second = 0;
  long guard_steps = 0;
  physics::State end;
};

Cost cost_of(Method method, const physics::Scene& scene) {
  Cost cost;
  const Eigen::VectorXd passive = Eigen::VectorXd::Ones(scene.body.edge_count());
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    const std::unique_ptr<physics::Stepper> stepper = make_stepper(method, scene);
    physics::Impulses impulses = make_impulses(scene);
    cost.end = {scene.body.rest, Eigen::Matrix3Xd::Zero(3, scene.body.node_count())};
    cost.substeps_per_second = 1 / stepper->substep(1.0 / kStepsPerSecond);
    const double start = cpu_seconds();
    for (int k = 0; k < kDuration * kStepsPerSecond; ++k) {
      if (stepper->step(1.0 / kStepsPerSecond, passive, nullptr, cost.end, impulses) != physics::Termination::kDone)
        return cost;
    }
    cost.ms_per_second = std::min(cost.ms_per_second, 1e3 * (cpu_seconds() - start) / kDuration);
    cost.guard_steps = stepper->guard_steps();
  }
  return cost;
}

/// Where the ratio of two times that go with powers of E passes 1 between two moduli.
double crossing(double e0, double ratio0, double e1, double ratio1) {
  return e0 * std::pow(e1 / e0, std::log(ratio0) / (std::log(ratio0) - std::log(ratio1)));
}

void sweep(const char* name, physics::Scene (*make)(double, double), std::ofstream& csv,
           std::vector<std::string>& crossings) {
  char text[200];
  for (const double damping_time : kDampingTimes) {
    double last_e = 0, last_ratio = 0, cross = 0;
    for (const double youngs_modulus : kYoungsModuli) {
      const physics::Scene scene = make(youngs_modulus, damping_time);
      const Cost fast = cost_of(Method::kExplicit, scene), still = cost_of(Method::kImplicit, scene);
      const double apart = (fast.end.x - still.end.x).norm() / std::sqrt(static_cast<double>(scene.body.node_count()));
      std::printf("| %s | %g | %.0e | %.0f | %.3g%s | %.3g%s | %.1e |\n", name, damping_time, youngs_modulus,
                  fast.substeps_per_second, fast.ms_per_second, fast.guard_steps > 0 ? " (guard)" : "", still.ms_per_second,
                  still.guard_steps > 0 ? " (guard)" : "", apart);
      std::fflush(stdout);
      csv << name << ',' << damping_time << ',' << youngs_modulus << ',' << fast.substeps_per_second << ','
          << fast.ms_per_second << ',' << still.ms_per_second << ',' << apart << ',' << fast.guard_steps << ','
          << still.guard_steps << '\n';
      const double ratio = fast.ms_per_second / still.ms_per_second;
      if (last_ratio > 0 && last_ratio < 1 && ratio >= 1) cross = crossing(last_e, last_ratio, youngs_modulus, ratio);
      if (last_ratio == 0 && ratio >= 1) cross = youngs_modulus;
      last_e = youngs_modulus;
      last_ratio = ratio;
    }
    if (cross > 0) {
      std::snprintf(text, sizeof text, "%s, damping time %g s: implicit is cheaper from about %.1e Pa on", name,
                    damping_time, cross);
    } else {
      std::snprintf(text, sizeof text, "%s, damping time %g s: explicit is cheaper at all of them", name, damping_time);
    }
    crossings.push_back(text);
  }
}

}  // namespace
}  // namespace hydrostat::bench

int main(int argc, char** argv) {
  const std::filesystem::path out = argc == 3 && std::string(argv[1]) == "-o" ? argv[2] : "out/damping";
  std::filesystem::create_directories(out);
  std::ofstream csv(out / "damping.csv");
  csv << "body,damping_time_s,youngs_modulus_pa,explicit_substeps_per_s,explicit_ms_per_s,implicit_ms_per_s,apart_m,"
         "explicit_guard_steps,implicit_guard_steps\n";
  std::printf(
      "| body | damping time [s] | E [Pa] | explicit: substeps/s | CPU ms per s | implicit, 240 steps/s: CPU ms per s | "
      "apart at the end, RMS [m] |\n");
  std::printf("| --- | --- | --- | --- | --- | --- | --- |\n");
  std::vector<std::string> crossings;
  hydrostat::bench::sweep("192 tets", hydrostat::bench::tet_bar, csv, crossings);
  hydrostat::bench::sweep("200 nodes of springs", hydrostat::bench::spring_bar, csv, crossings);
  std::printf("\n");
  for (const std::string& crossing : crossings) std::printf("%s\n", crossing.c_str());
}
