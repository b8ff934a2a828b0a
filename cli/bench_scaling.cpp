#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <thread>

#include "cli/bench.h"
#include "cli/command_line.h"
#include "cli/number_option.h"
#include "cli/place_option.h"
#include "cli/progress.h"
#include "io/scaling_page.h"
#include "io/scene_file.h"
#include "io/writable.h"
#include "io/write_file.h"

namespace hydrostat::cli {

namespace fs = std::filesystem;

namespace {

// What '-' stands for: the bar of the peer benchmark (tests/bench).
constexpr const char* kBar = R"([body]
shape = "bar"
size_m = [1.0, 0.25, 0.25]

[material]
law = "stable_neo_hookean"
youngs_modulus_pa = 5e5
damping_time_s = 0.0

[[clamp]]
normal = [-1.0, 0.0, 0.0]
offset_m = 0.499
)";
constexpr int kWished[] = {200, 500, 1000, 2000, 5000, 10000, 20000, 50000, 100000};  // elements

struct ScalingCommand {
  std::string scene, out, method;
  int threads = 2;
  double largest = 100000;
  bool json = false, quiet = false;
};

retarget::ScalingRow measure(const io::SceneFile& scene, const retarget::ScalingOptions& options) {
  return std::visit([&](const auto& scenario) { return retarget::measure_scaling(scenario, options); }, scene.scenario);
}

/// The scene in meshes of about the wished numbers of elements; nodes are asked for, so each size tells how many the next
/// one wants.
io::ScalingReport measure_all(const ScalingCommand& command, const fs::path& file) {
  Progress progress(std::cerr, progress_style(command.quiet));
  io::ScalingReport report;
  report.scene = command.scene == "-" ? "a bar of 1 x 0.25 x 0.25 m" : command.scene;
  report.threads = command.threads;
  progress.begin("machine");
  report.machine = retarget::measure_machine();
  double nodes_per_element = 0.4;
  for (const int wished : kWished) {
    if (wished > command.largest) break;
    progress.begin(std::to_string(wished) + " elements");
    const int nodes = std::max(8, static_cast<int>(std::lround(nodes_per_element * wished)));
    io::SceneFile scene = io::read_scene_file(file, std::nullopt, nodes);
    if (const std::optional<physics::Method> method = io::method_named(command.method)) scene.method = *method;
    report.method = physics::name_of(scene.method);
    report.rows.push_back(measure(scene, {.method = scene.method, .dt_s = scene.dt_s, .threads = command.threads}));
    nodes_per_element = static_cast<double>(report.rows.back().nodes) / report.rows.back().elements;
  }
  progress.end();
  return report;
}

std::string summary(const io::ScalingReport& report) {
  char text[200];
  std::string all;
  for (const retarget::ScalingRow& row : report.rows) {
    std::snprintf(text, sizeof text,
                  "%7d elements: %6.1f ns an element and substep, %d threads %.2f times as fast; %.0f bytes an element%s\n",
                  row.elements, row.one_ns, report.threads, row.is_whole ? row.one_ns / row.shared_ns : 0.0, row.bytes,
                  row.is_whole ? "" : "; it diverged");
    all += text;
  }
  if (report.rows.size() < 2) return all;
  const retarget::ScalingRow& last = report.rows.back();
  std::snprintf(text, sizeof text, "time grows with the elements to the power %.3f", retarget::growth_exponent(report.rows));
  all += text;
  std::snprintf(text, sizeof text, "; limits at %d elements: memory %.1f ns, arithmetic %.1f ns, processor time %.1f ns\n",
                last.elements, io::memory_limit_ns(report, last), io::arithmetic_limit_ns(report, last), last.cpu_ns);
  return all + text;
}

int scaling(const ScalingCommand& command) {
  const fs::path out = command.out;
  io::refuse_unwritable(out);
  fs::path file = command.scene;
  if (command.scene == "-") {
    file = out / "scene.toml";
    io::write_file(file, kBar);
  }
  const io::ScalingReport report = measure_all(command, file);
  io::write_file(out / "scaling.csv", io::scaling_csv(report));
  io::write_file(out / "scaling.html", io::scaling_page(report));
  std::cout << (command.json ? io::scaling_json(report) : summary(report));
  for (const retarget::ScalingRow& row : report.rows) {
    if (row.is_whole) continue;
    std::cerr << one_line({command.scene, "bench",
                           "the simulation of " + std::to_string(row.elements) + " elements diverged",
                           "Try --method euler, a smaller dt_s or a softer body"})
              << std::endl;
    return kShortOfTarget;
  }
  return kDone;
}

}  // namespace

void add_bench_scaling(CLI::App& bench, int& exit_code) {
  const auto command = std::make_shared<ScalingCommand>();
  CLI::App* sub = bench.add_subcommand("scaling", "Cost of a scene's body in meshes from 200 elements up");
  sub->add_option("SCENE", command->scene, "TOML file (README, 'Scene files'), or '-': a bar of stable neo-Hookean tets")
      ->required();
  sub->add_option("-o,--out", command->out, "Directory for scaling.csv and scaling.html")->check(refuse_no_place)->required();
  sub->add_option("--method", command->method, "Time integration [the scene's]")->check(CLI::IsMember(io::method_names()));
  sub->add_option("--threads", command->threads, "Of the second measurement; the first is on one")
      ->check(number_within(2, 256));
  sub->add_option("--largest", command->largest, "Elements of the largest mesh, at most")->check(number_within(200, 100000));
  sub->add_flag("--json", command->json, "Print what was found as JSON");
  sub->add_flag("--quiet", command->quiet, "No progress");
  sub->callback([command, &exit_code] { exit_code = scaling(*command); });
}

}  // namespace hydrostat::cli
