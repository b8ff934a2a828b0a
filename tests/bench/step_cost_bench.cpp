// How far counted work (retarget/step_cost.h) is from processor time: bars in the plane and in space, of springs, of triangles or
// tets and of quads or hexahedra, soft and stiff, held in the air, held in water, lying on the ground, on balls, on a block and in two
// halves that bump into each other, with activations and without, by every method in short and long steps. Usage:
// step_cost_bench [-o DIR] [-r ROUNDS] [-f FIT [-k SLOWER]]. Writes DIR/costs.csv (default DIR: out/costs), a line a run with what was
// counted and the least time of ROUNDS (4), and prints in markdown for each method and kind of body the median of counted over measured,
// and within what nine of ten lie. FIT: a file for the table of constants that these times ask for, of a machine that is SLOWER times
// as slow as this one (1).
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <variant>
#include <vector>

#include "io/scene_file.h"
#include "retarget/least_squares.h"
#include "retarget/simulation.h"
#include "retarget/step_cost.h"
#include "retarget/step_parts.h"

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
constexpr std::array<Surroundings, 7> kSurroundings{
    {{"air", true}, {"air", false}, {"ground", true}, {"balls", true}, {"blocks", true}, {"halves", true}, {"water", true}}};

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
  const auto place = [&](double x, double y) { return "[" + std::to_string(x) + ", " + std::to_string(y) + (is_flat ? "]\n" : ", 0.05]\n"); };
  const auto obstacle = [&](const std::string& shape, const std::string& size, double x, double y) {
    return "[[obstacle]]\nshape = \"" + shape + "\"\nsize_m = " + size + "\nposition_m = " + place(x, y);
  };
  const std::string on_ground = text + "[ground]\nheight_m = -0.13\n", cube = is_flat ? "[0.2, 0.2]" : "[0.2, 0.2, 0.2]";
  if (name == "ground") return on_ground;
  if (name == "balls") return on_ground + obstacle("ball", "0.3", 0.1, -0.28) + obstacle("ball", "0.3", -0.3, -0.28);
  if (name == "blocks") return on_ground + obstacle("box", cube, 0.3, -0.225) + obstacle("box", cube, 3, 0);
  if (name == "halves") return on_ground + "[[seam]]\nstrength_pa = 1.0\nnormal = " + (is_flat ? "[1.0, 0.0]\n" : "[1.0, 0.0, 0.0]\n");
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
         "stages,placings,sweeps,assemblies,products,rounds,searched,own_searched,looks,wide_looks,pushes,plain,counted_ms,ms\n";
  for (const Run& run : runs) {
    const auto write = [&](const auto& scenario) {
      const auto& body = scenario.scene.body;
      physics::ContactWork contact = run.work.by_impulses;
      contact += run.work.by_potential;
      long elements = 0;
      for (const auto& block : body.elements) elements += block.block.element_count();
      csv << '"' << run.kind << "\",";
      csv << run.surroundings.name << ',' << run.surroundings.is_active << ',' << run.youngs_modulus << ',' << run.damping_time << ','
          << physics::name_of(run.method) << ','
          << run.dt_s << ',' << body.node_count() << ',' << body.edge_count() << ',' << (body.edge_stiffness.array() > 0).count() << ','
          << (body.edge_damping.array() > 0).count() << ',' << body.volume_stiffness.size() << ',' << elements << ','
          << scenario.scene.contact_points.count() << ',' << run.steps << ',' << run.work.passes << ',' << run.work.stages << ',' << run.work.placings << ',' << run.work.sweeps << ',' << run.work.assemblies << ','
          << run.work.products << ',' << run.work.rounds << ',' << contact.searched << ',' << contact.own_searched << ',' << contact.looks << ','
          << contact.wide_looks << ',' << contact.pushes << ',' << run.is_plain << ',' << run.counted_ms << ',' << run.least_ms << '\n';
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

using retarget::StepParts;

struct Part {
  const char* name;
  double StepParts::*value;
};
constexpr std::array<Part, 12> kParts{{{"one", &StepParts::one}, {"nodes", &StepParts::nodes}, {"edges", &StepParts::edges},
                                       {"springs", &StepParts::springs}, {"dashpots", &StepParts::dashpots}, {"volumes", &StepParts::volumes},
                                       {"simplices", &StepParts::simplices}, {"corotated", &StepParts::corotated}, {"boxes", &StepParts::boxes},
                                       {"active_simplices", &StepParts::active_simplices}, {"active_boxes", &StepParts::active_boxes},
                                       {"wet", &StepParts::wet}}};
constexpr Eigen::Index kPartCount = kParts.size();
/// Where each of them stands in a vector of a method's costs: of steps, passes and assemblies, and those of products, stages and placings.
enum : Eigen::Index { kStep = 0, kPass = kPartCount, kAssembly = 2 * kPartCount, kProduct = 3 * kPartCount, kStage, kPlacing, kCostCount };

/// How often a run paid each cost.
Eigen::VectorXd counts_of(const Run& run) {
  const StepParts parts = std::visit([&](const auto& scenario) { return retarget::parts_of(scenario.scene, run.surroundings.is_active); },
                                     run.scene.scenario);
  Eigen::VectorXd counts(kCostCount);
  for (Eigen::Index p = 0; p < kPartCount; ++p) {
    const double of_part = parts.*kParts[static_cast<std::size_t>(p)].value;
    counts[kStep + p] = run.steps * of_part;
    counts[kPass + p] = (run.work.passes + run.work.sweeps) * of_part;
    counts[kAssembly + p] = run.work.assemblies * of_part;
  }
  counts[kProduct] = run.work.products;
  counts[kStage] = run.work.stages * parts.dashpots;
  counts[kPlacing] = run.work.placings * parts.dashpots;
  return counts;
}

/// The same of retarget::ContactCosts, in its order.
constexpr Eigen::Index kContactCount = 7;
Eigen::Vector<double, kContactCount> contact_counts_of(const Run& run) {
  const physics::ContactWork &impulses = run.work.by_impulses, &potential = run.work.by_potential;
  return {impulses.searched + potential.searched,
          impulses.own_searched + potential.own_searched,
          impulses.wide_looks + potential.wide_looks,
          impulses.looks,
          impulses.pushes,
          potential.looks,
          potential.pushes};
}

bool goes_in_stages(physics::Method method) { return method == physics::Method::kExplicit || method == physics::Method::kSpring; }

/// Whether a method pays for a cost at all.
bool is_paid(physics::Method method, Eigen::Index cost) {
  if (cost == kProduct) return true;
  if (cost > kProduct) return goes_in_stages(method);
  const double StepParts::*part = kParts[static_cast<std::size_t>(cost % kPartCount)].value;
  const bool is_active = part == &StepParts::active_simplices || part == &StepParts::active_boxes;
  const bool is_of_elements = is_active || part == &StepParts::volumes || part == &StepParts::simplices ||
                              part == &StepParts::corotated || part == &StepParts::boxes;
  if (method == physics::Method::kSpring && is_of_elements) return false;  // which it leaves out
  if (cost >= kAssembly && is_active) return false;                        // set before
  return cost < kPass || part != &StepParts::wet;
}

struct Fit {
  std::map<physics::Method, Eigen::VectorXd> costs;  // [ns]
  Eigen::Vector<double, kContactCount> contact;      // [ns]

  double ms(const Run& run) const { return 1e-6 * (costs.at(run.method).dot(counts_of(run)) + contact.dot(contact_counts_of(run))); }
};

/// Costs, none below 0, that come nearest to the times of `runs`, by relative error. Contact is one for all methods, a pass is one for `implicit`
/// and `euler`; what `explicit` assembles is its guard, `euler`.
Fit fitted(const std::vector<const Run*>& runs) {
  constexpr double kHold = 1e-3;  // of what a cost that stands alone would be worth [-]: of two that go together neither runs away
  const Eigen::Index contact = std::size(physics::kMethods) * kCostCount;
  const auto column = [](physics::Method method, Eigen::Index cost) {
    if (method == physics::Method::kEuler && cost >= kPass && cost < kAssembly) method = physics::Method::kImplicit;
    if (method == physics::Method::kExplicit && cost >= kAssembly && cost <= kProduct) method = physics::Method::kEuler;
    return static_cast<Eigen::Index>(method) * kCostCount + cost;
  };
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(runs.size()), contact + kContactCount);
  for (Eigen::Index r = 0; r < rows.rows(); ++r) {
    const Run& run = *runs[static_cast<std::size_t>(r)];
    const Eigen::VectorXd counts = counts_of(run);
    for (Eigen::Index c = 0; c < kCostCount; ++c) {
      if (is_paid(run.method, c)) rows(r, column(run.method, c)) = counts[c];
    }
    rows.row(r).tail<kContactCount>() = contact_counts_of(run);
    rows.row(r) *= 1e-6 / run.least_ms;
  }
  const Eigen::VectorXd lengths = rows.colwise().norm().cwiseMax(1e-300).transpose();
  rows.array().rowwise() /= lengths.transpose().array();
  const retarget::BoundedSolution solution =
      retarget::solve(retarget::held_nonnegative(rows, Eigen::VectorXd::Ones(rows.rows()), kHold), Eigen::VectorXd::Ones(rows.cols()));
  if (!solution.converged) std::fprintf(stderr, "step_cost_bench: the fit: did not settle (%g)\n", solution.kkt_residual);
  Fit fit;
  for (const physics::Method method : physics::kMethods) {
    Eigen::VectorXd& own = fit.costs[method] = Eigen::VectorXd::Zero(kCostCount);
    for (Eigen::Index c = 0; c < kCostCount; ++c) {
      const Eigen::Index k = column(method, c);
      if (is_paid(method, c) && lengths[k] > 1e-200) own[c] = solution.x[k] / lengths[k];
    }
  }
  fit.contact = (solution.x.array() / lengths.array()).tail<kContactCount>();
  return fit;
}

/// With two digits.
std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2g", value);
  if (value >= 10) std::snprintf(text, sizeof text, "%.0f", std::stod(text));
  return text;
}

/// As it is written in retarget/step_cost.cpp.
void write_costs(const Eigen::VectorXd& costs, physics::Method method, std::ofstream& out) {
  out << "        {";
  for (const Eigen::Index block : {kStep, kPass, kAssembly}) {
    out << (block == kStep ? "{" : ",\n         {");
    const char* comma = "";
    for (Eigen::Index p = 0; p < kPartCount; ++p) {
      if (costs[block + p] < 0.05) continue;
      out << comma << '.' << kParts[static_cast<std::size_t>(p)].name << " = " << number(costs[block + p]);
      comma = ", ";
    }
    out << '}';
  }
  out << ", " << number(costs[kProduct]);
  if (goes_in_stages(method)) out << ", " << number(costs[kStage]) << ", " << number(costs[kPlacing]);
  out << "},  // " << physics::name_of(method) << '\n';
}

void write_fit(const std::vector<Run>& runs, double slower, const fs::path& file) {
  std::ofstream out(file);
  std::ostringstream contact;
  std::vector<double> ratios;
  for (const std::size_t dimension : {0U, 1U}) {
    std::vector<const Run*> taken;
    for (const Run& run : runs) {
      if (run.is_plain && run.scene.scenario.index() == dimension) taken.push_back(&run);
    }
    const Fit fit = fitted(taken);
    for (const Run* run : taken) ratios.push_back(fit.ms(*run) / run->least_ms);
    out << "    {\n";
    for (const auto& [method, costs] : fit.costs) write_costs(slower * costs, method, out);
    out << "    },\n";
    contact << "    {";
    for (Eigen::Index k = 0; k < kContactCount; ++k) contact << (k == 0 ? "" : ", ") << number(slower * fit.contact[k]);
    contact << "},\n";
  }
  out << contact.str();
  std::printf("The fit over measured: half within %.2f and %.2f, nine of ten within %.2f and %.2f.\n", quantile(ratios, 0.25), quantile(ratios, 0.75),
              quantile(ratios, 0.05), quantile(ratios, 0.95));
}

}  // namespace
}  // namespace hydrostat::bench

int main(int argc, char** argv) {
  using namespace hydrostat::bench;
  fs::path out = "out/costs", fit;
  int rounds = 4;
  double slower = 1;
  for (int k = 1; k + 1 < argc; k += 2) {
    const std::string option = argv[k];
    if (option == "-o") out = argv[k + 1];
    if (option == "-f") fit = argv[k + 1];
    if (option == "-k") slower = std::atof(argv[k + 1]);
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
  if (!fit.empty()) write_fit(runs, slower, fit);
}
