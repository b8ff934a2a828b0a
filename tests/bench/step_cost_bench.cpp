// How far counted work (retarget/step_cost.h) is from processor time: bars in the plane and in space, of springs, of triangles or
// tets and of quads or hexahedra, soft and stiff, held in the air, held in water and lying on the ground, with activations and
// without, by every method in short and long steps. Usage: step_cost_bench [-o DIR] [-r ROUNDS]. Writes DIR/costs.csv (default DIR:
// out/costs), a line a run with what was counted and the least time of ROUNDS (4), and prints in markdown for each method and kind of
// body the median of counted over measured, and within what nine of ten lie.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <variant>
#include <vector>

#include "io/scene_file.h"
#include "retarget/simulation.h"
#include "retarget/step_cost.h"

namespace hydrostat::bench {
namespace {

namespace fs = std::filesystem;

constexpr double kDuration = 0.1;                                        // [s]
constexpr std::array<double, 2> kDampingTimes{0, 0.002};                 // [s]
constexpr std::array<double, 2> kYoungsModuli{3e5, 1e7};                 // [Pa]
constexpr std::array<double, 2> kSteps{1.0 / 60, 1.0 / 480};             // [s]
constexpr std::array<std::array<int, 3>, 2> kNodes{{{16, 60, 200}, {24, 90, 300}}};  // wished, in the plane and in space

struct Surroundings {
  const char* name;
  bool is_active;  // activations change from step to step
};
constexpr std::array<Surroundings, 4> kSurroundings{{{"air", true}, {"air", false}, {"ground", true}, {"water", true}}};

struct Kind {
  const char *element, *law;
};
constexpr std::array<Kind, 4> kKinds{{{"tet", "springs"}, {"tet", "stable_neo_hookean"}, {"tet", "corotated_linear"}, {"hex", "stable_neo_hookean"}}};

struct Run {
  io::SceneFile scene;
  std::string kind;
  Surroundings surroundings;
  double youngs_modulus, damping_time;
  physics::Method method;
  double dt_s;
  double least_ms = 1e300, counted_ms = 0, steps = 0;
  physics::StepWork work;
  bool is_plain = true;  // no guard took over
};

/// A bar that is held at one end, or lies on the ground.
std::string scene_text(int dimension, const Kind& kind, int nodes, double youngs_modulus, double damping_time, const Surroundings& surroundings) {
  const bool is_flat = dimension == 2, is_hex = std::string(kind.element) == "hex";
  std::string text = "dimension = " + std::to_string(dimension) + "\n[body]\nshape = \"bar\"\nsize_m = " + (is_flat ? "[1.0, 0.25]" : "[1.0, 0.25, 0.25]") +
                     "\nnodes = " + std::to_string(nodes) + "\nelement = \"" + (!is_flat ? kind.element : is_hex ? "quad" : "triangle") +
                     "\"\n[material]\nlaw = \"" + kind.law + "\"\nyoungs_modulus_pa = " + std::to_string(youngs_modulus) +
                     "\ndamping_time_s = " + std::to_string(damping_time) + "\n";
  if (surroundings.is_active) text += "[[activation]]\namplitude = 0.1\nfrequency_hz = 2.0\n";
  const std::string name = surroundings.name;
  if (name == "ground") return text + "[ground]\nheight_m = -0.13\n";
  if (name == "water") text += "[water]\n";
  return text + "[[clamp]]\noffset_m = 0.49\nnormal = " + (is_flat ? "[-1.0, 0.0]\n" : "[-1.0, 0.0, 0.0]\n");
}

std::vector<Run> all_runs(const fs::path& file) {
  std::vector<Run> runs;
  const auto add = [&](int dimension, const Kind& kind, int nodes, double youngs_modulus, double damping_time, const Surroundings& surroundings) {
    std::ofstream(file) << scene_text(dimension, kind, nodes, youngs_modulus, damping_time, surroundings);
    const io::SceneFile scene = io::read_scene_file(file);
    for (const physics::Method method : physics::kMethods) {
      for (const double dt_s : kSteps) {
        runs.push_back({scene, scene.element + ", " + kind.law, surroundings, youngs_modulus, damping_time, method, dt_s, 1e300, 0, 0, {}, true});
      }
    }
  };
  for (const int dimension : {2, 3}) {
    for (const Kind& kind : kKinds) {
      for (const int nodes : kNodes[static_cast<std::size_t>(dimension - 2)]) {
        for (const double youngs_modulus : kYoungsModuli) {
          for (const double damping_time : kDampingTimes) {
            for (const Surroundings& surroundings : kSurroundings) add(dimension, kind, nodes, youngs_modulus, damping_time, surroundings);
          }
        }
      }
    }
  }
  return runs;
}

void take(Run& run) {
  retarget::SimulationOptions options;
  options.method = run.method;
  options.dt_s = run.dt_s;
  options.duration_s = kDuration;
  options.figures = false;
  const auto simulate_in = [&](const auto& scenario) {
    const retarget::Simulation made = simulate(scenario, options);
    run.least_ms = std::min(run.least_ms, made.report.ms_per_sim_s * made.report.duration_s);
    run.steps = std::round(made.report.duration_s / run.dt_s);
    run.work = made.work;
    run.is_plain = !made.report.diverged && made.report.guard_steps == 0;
    run.counted_ms = retarget::counted_ms(scenario.scene, run.method, run.surroundings.is_active, run.steps, run.work);
  };
  std::visit(simulate_in, run.scene.scenario);
}

void write_csv(const std::vector<Run>& runs, const fs::path& file) {
  std::ofstream csv(file);
  csv << "kind,surroundings,active,youngs_modulus_pa,damping_s,method,dt_s,nodes,edges,springs,dashpots,volumes,elements,places,steps,passes,"
         "sweeps,assemblies,products,rounds,plain,counted_ms,ms\n";
  for (const Run& run : runs) {
    const auto write = [&](const auto& scenario) {
      const auto& body = scenario.scene.body;
      long elements = 0;
      for (const auto& block : body.elements) elements += block.block.element_count();
      csv << '"' << run.kind << "\",";
      csv << run.surroundings.name << ',' << run.surroundings.is_active << ',' << run.youngs_modulus << ',' << run.damping_time << ','
          << physics::name_of(run.method) << ','
          << run.dt_s << ',' << body.node_count() << ',' << body.edge_count() << ',' << (body.edge_stiffness.array() > 0).count() << ','
          << (body.edge_damping.array() > 0).count() << ',' << body.volume_stiffness.size() << ',' << elements << ','
          << scenario.scene.contact_points.count() << ',' << run.steps << ',' << run.work.passes << ',' << run.work.sweeps << ',' << run.work.assemblies << ','
          << run.work.products << ',' << run.work.rounds << ',' << run.is_plain << ',' << run.counted_ms << ',' << run.least_ms << '\n';
    };
    std::visit(write, run.scene.scenario);
  }
}

double quantile(std::vector<double>& values, double part) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(part * static_cast<double>(values.size() - 1))];
}

void print_table(const std::vector<Run>& runs) {
  std::map<std::string, std::vector<double>> ratios;
  for (const Run& run : runs) {
    if (!run.is_plain) continue;
    for (const std::string& kind : {run.kind, std::string("all")}) {
      ratios["`" + physics::name_of(run.method) + "` | " + kind].push_back(run.counted_ms / run.least_ms);
    }
  }
  std::printf("| method | body | runs | counted over measured: median | nine of ten |\n| --- | --- | --- | --- | --- |\n");
  for (auto& [name, values] : ratios) {
    std::printf("| %s | %zu | %.2f | %.2f to %.2f |\n", name.c_str(), values.size(), quantile(values, 0.5), quantile(values, 0.05), quantile(values, 0.95));
  }
}

}  // namespace
}  // namespace hydrostat::bench

int main(int argc, char** argv) {
  using namespace hydrostat::bench;
  fs::path out = "out/costs";
  int rounds = 4;
  for (int k = 1; k + 1 < argc; k += 2) {
    const std::string option = argv[k];
    if (option == "-o") out = argv[k + 1];
    if (option == "-r") rounds = std::max(1, std::atoi(argv[k + 1]));
  }
  fs::create_directories(out);
  std::vector<Run> runs = all_runs(out / "scene.toml");
  for (int round = 1; round <= rounds; ++round) {  // far apart in time: what else goes on passes
    for (Run& run : runs) take(run);
    std::fprintf(stderr, "round %d of %d\n", round, rounds);
  }
  write_csv(runs, out / "costs.csv");
  print_table(runs);
}
