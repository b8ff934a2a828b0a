// One run of the stability suite: a hard scene, a kind of body, a method, a size; tests/stability/run.sh calls it for all of them.
//   stability_run list [slice]            the keys of all runs, or of the short ones
//   stability_run run KEY DIR             runs one; its scene file goes to DIR; a row of stability.csv on standard output
//   stability_run slice BODY DIR          all short runs with that kind of body, in the plane too; exit code 1 where one of them
//                                         fails, or where they take more than three minutes of the processor
// A run passes when, at its end, no element is inverted in any corner, the volume is within 2 % and all is finite; when at no time the energy was
// above its start and the work done on the body by more than 1 %, or momentum changed by what is not booked; and, where it
// matters, when it does not creep, lies in nothing and keeps its angular momentum.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "io/import_worker.h"
#include "io/scene_file.h"
#include "physics/element_body.h"
#include "physics/element_stiffness.h"
#include "retarget/error.h"
#include "retarget/simulation.h"
#include "tests/physics/deepest_place.h"
#include "tests/stability/stability_case.h"

namespace hydrostat::stability {
namespace {

constexpr double kVolume = 0.02;          // at the end [-]
constexpr double kEnergySlack = 0.01;     // of what there was to be had [-]
constexpr double kEnergyFloor = 1e-4;     // [m g L], where there was nothing
constexpr double kMomentum = 1e-9;        // [m g]
constexpr double kAngularExplicit = 1e-9, kAngularImplicit = 1e-4;  // lost in flight [-] per second
constexpr double kPenetration = 0.02;     // at the end [D]
constexpr double kSettled = 0.25;         // of the run [-]: creep is measured behind it
constexpr double kMostSeconds = 180;      // of the processor, a slice: four times what each takes, for machines are not alike

struct Outcome {
  std::string verdict;  // "pass", "refused", or what is wrong
  double guarded = 0;   // share of the steps
  double least_jacobian = 0, volume_error = 0, energy_excess = 0, momentum_residual = 0, angular_loss = 0, creep_m_s = 0;
  double penetration = 0, ms_per_sim_s = 0;
  int nodes = 0, elements = 0;
};

template <int Dim>
physics::PointsOf<Dim> nodes_at(const retarget::Motion& motion, Eigen::Index frame) {
  return motion.at(frame).template topRows<Dim>();
}

/// What there was to be had [m g L]: moving, strained, high up, or done on the body.
template <int Dim>
double energy_at_hand(const retarget::ScenarioOf<Dim>& scenario, const retarget::Simulation& run) {
  const retarget::SimulationCourse& course = run.course;
  const double unit = scenario.scene.body.mass.sum() * 9.81 * scenario.length;
  const double fall = course.gravity_j[0] - course.gravity_j.minCoeff();
  return (course.kinetic_j[0] + course.elastic_j[0] + fall + std::max(0.0, course.work_j.maxCoeff())) / unit;
}

/// How fast the middle creeps from when it has settled to the end.
double creep(const retarget::SimulationCourse& course) {
  const Eigen::Index last = course.com.cols() - 1;
  const auto settled = static_cast<Eigen::Index>(kSettled * static_cast<double>(last));
  return (course.com.col(last) - course.com.col(settled)).norm() / (course.time_s[last] - course.time_s[settled]);
}

template <int Dim>
double lost_angular_momentum(const retarget::ScenarioOf<Dim>& scenario, const retarget::Simulation& run) {
  const physics::BodyOf<Dim>& body = scenario.scene.body;
  const auto about_centre = [&](const physics::PointsOf<Dim>& x, const physics::PointsOf<Dim>& v) {
    return physics::angular_momentum<Dim>(body, x, v, physics::centre_of_mass<Dim>(body, x));
  };
  const Eigen::Index last = run.trace.time_s.size() - 1;
  const Eigen::Map<const Eigen::Matrix3Xd> x(run.trace.position.col(last).data(), 3, body.node_count());
  const Eigen::Map<const Eigen::Matrix3Xd> v(run.trace.velocity.col(last).data(), 3, body.node_count());
  const physics::SpinOf<Dim> before = about_centre(scenario.start.x, scenario.start.v);
  const physics::SpinOf<Dim> after = about_centre(x.template topRows<Dim>(), v.template topRows<Dim>());
  return (after - before).norm() / before.norm() / run.report.duration_s;
}

/// Of tets, and of hexahedra in each of their corners.
template <int Dim>
double least_jacobian(const physics::BodyOf<Dim>& body, const physics::PointsOf<Dim>& x) {
  if (body.elements.empty()) return physics::jacobians<Dim>(body, x).minCoeff();
  double least = 1e300;
  for (const physics::BodyElements<Dim>& elements : body.elements) {
    least = std::min(least, physics::least_jacobians<Dim>(elements.block, physics::mesh_of(body, elements), x).minCoeff());
  }
  return least;
}

/// All over the surface [D], at the end.
template <int Dim>
double penetration(const retarget::ScenarioOf<Dim>& scenario, const retarget::Simulation& run, const physics::PointsOf<Dim>& x) {
  physics::StateOf<Dim> end = scenario.start;
  end.x = x;
  end.obstacle_travel.resize(Dim, static_cast<Eigen::Index>(scenario.scene.obstacles.size()));
  for (std::size_t n = 0; n < run.obstacle_travels.size(); ++n) {
    end.obstacle_travel.col(static_cast<Eigen::Index>(n)) = nodes_at<Dim>(run.obstacle_travels[n], run.motion.count() - 1);
  }
  return physics::deepest_place<Dim>(scenario.scene, end) / scenario.size;
}

template <int Dim>
Outcome judge(const Case& one, const retarget::ScenarioOf<Dim>& scenario, const io::SceneFile& scene) {
  retarget::SimulationOptions options;
  options.method = scene.method;
  options.dt_s = scene.dt_s;
  options.duration_s = scene.duration_s;
  options.trace = one.is_in_flight;
  const retarget::Simulation run = retarget::simulate(scenario, options);
  const retarget::SimulationReport& report = run.report;
  const physics::BodyOf<Dim>& body = scenario.scene.body;
  Outcome out;
  out.nodes = body.node_count();
  out.elements = body.elements.empty() ? body.tet_count() : body.elements.front().block.element_count();
  const physics::PointsOf<Dim> end = nodes_at<Dim>(run.motion, run.motion.count() - 1);
  out.guarded = report.guard_steps * scene.dt_s / std::max(scene.dt_s, report.duration_s);
  out.least_jacobian = least_jacobian<Dim>(body, end);
  out.volume_error = report.volume_error_end;
  out.energy_excess = report.energy_excess_mgl;
  out.momentum_residual = report.momentum_residual_mg;
  out.creep_m_s = creep(run.course);
  out.penetration = penetration<Dim>(scenario, run, end);
  out.ms_per_sim_s = report.ms_per_sim_s;
  if (one.is_in_flight) out.angular_loss = lost_angular_momentum(scenario, run);

  const auto wrong = [&](const std::string& what) { out.verdict += (out.verdict.empty() ? "" : " + ") + what; };
  if (report.diverged) wrong("diverged");
  if (!end.allFinite()) wrong("no number");
  if (!(out.least_jacobian > 0)) wrong("inverted");
  if (!(out.volume_error <= kVolume)) wrong("volume");
  if (!(out.energy_excess <= kEnergySlack * energy_at_hand(scenario, run) + kEnergyFloor)) wrong("energy");
  if (!(out.momentum_residual <= kMomentum)) wrong("momentum");
  if (!(out.penetration <= kPenetration)) wrong("penetration");
  if (one.least_creep_m_s > 0 && !(out.creep_m_s <= one.least_creep_m_s)) wrong("creep");
  if (one.is_in_flight && one.method != "euler" &&  // which tells what it loses, and is not held to it
      !(out.angular_loss <= (one.method == "explicit" ? kAngularExplicit : kAngularImplicit))) {
    wrong("angular momentum");
  }
  if (one.is_refused) wrong("not refused");
  if (one.is_told && scene.warnings.empty()) wrong("not told");
  if (out.verdict.empty()) out.verdict = "pass";
  return out;
}

Outcome run(const Case& one, const std::filesystem::path& directory) {
  std::filesystem::create_directories(directory);
  std::string name = one.key();
  std::replace_if(name.begin(), name.end(), [](char c) { return c == ' ' || c == ',' || c == ':' || c == '/' || c == '%' || c == '\''; }, '_');
  const std::filesystem::path file = directory / (name + ".toml");
  std::ofstream(file) << one.scene;
  if (!one.mesh.empty()) std::ofstream(directory / one.mesh_name()) << one.mesh;
  try {
    const io::SceneFile scene = io::read_scene_file(file);
    return std::visit([&](const auto& scenario) { return judge(one, scenario, scene); }, scene.scenario);
  } catch (const Error& error) {
    Outcome refused;
    const bool is_sentence = error.file.find(name) != std::string::npos && error.where.find("line ") == 0 && !error.mend.empty();
    refused.verdict = !one.is_refused ? "refused though sound" : is_sentence ? "refused" : "refused without a place";
    std::cerr << error.what() << "\n";
    return refused;
  }
}

void print(const Case& one, const Outcome& out) {
  std::printf("%s,%s,%d,%d,%.3f,%.3g,%.3g,%.3g,%.3g,%.3g,%.3g,%.3g,%.3g\n", one.key().c_str(), out.verdict.c_str(), out.nodes,
              out.elements, out.guarded, out.least_jacobian, out.volume_error, out.energy_excess, out.momentum_residual,
              out.angular_loss, out.creep_m_s, out.penetration, out.ms_per_sim_s);
  std::fflush(stdout);
}

bool is_passed(const Outcome& out) { return out.verdict == "pass" || out.verdict == "refused"; }

/// Of a body in the plane: that in space which has the same springs or law and cut.
std::string kind_of(const std::string& body) {
  return body == "flat springs" ? "springs" : body == "triangles" ? "tets" : body == "quads" ? "hexes" : body;
}

int run_slice(const std::string& kind, const std::filesystem::path& directory) {
  bool is_well = true;
  int runs = 0;
  for (const Case& one : all_cases()) {
    if (!one.is_in_slice || kind_of(one.body) != kind) continue;
    const Outcome out = run(one, directory);
    print(one, out);
    is_well = is_well && is_passed(out);
    ++runs;
  }
  const double seconds = static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
  std::printf("%d runs took %.1f s of the processor\n", runs, seconds);
  if (!(seconds <= kMostSeconds)) {
    std::fprintf(stderr, "stability_run: slice '%s': it took more than %.0f s of the processor. Leave out a case.\n", kind.c_str(), kMostSeconds);
  }
  return runs > 0 && is_well && seconds <= kMostSeconds ? 0 : 1;
}

int main(const std::vector<std::string>& arguments) {
  const std::string verb = arguments.empty() ? "" : arguments[0];
  if (verb == "list") {
    for (const Case& one : all_cases()) {
      if (arguments.size() < 2 || one.is_in_slice) std::cout << one.key() << "\n";
    }
    return 0;
  }
  if (verb == "run" && arguments.size() == 3) {
    for (const Case& one : all_cases()) {
      if (one.key() != arguments[1]) continue;
      print(one, run(one, arguments[2]));
      return 0;
    }
    std::cerr << "stability_run: KEY: there is no '" << arguments[1] << "'. 'stability_run list' tells them.\n";
    return 2;
  }
  if (verb == "slice" && arguments.size() == 3) return run_slice(arguments[1], arguments[2]);
  std::cerr << "usage: stability_run list [slice] | run KEY DIR | slice BODY DIR\n";
  return 2;
}

}  // namespace
}  // namespace hydrostat::stability

int main(int argc, char** argv) {
  if (const std::optional<int> worker = hydrostat::io::run_import_worker(argc, argv)) return *worker;
  return hydrostat::stability::main({argv + 1, argv + argc});
}
