// The peer benchmark: our methods and Bullet's deformable body on the same mesh, masses and material, one thread, CPU time.
// Usage: peer_bench [-o DIR] [--tets 192,1152,5184] [options of Google Benchmark, which may leave rows out]. Writes
// DIR/peers.csv (default DIR: out/peers), prints the table in markdown and a line for each goal; exit code 1 if one is
// missed. tests/bench/run.sh builds and runs it.
#include <benchmark/benchmark.h>
#include <dlfcn.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <limits>
#include <map>
#include <memory>
#include <stdexcept>

#include "tests/bench/bullet_peer.h"
#include "tests/bench/peer_scenes.h"

namespace hydrostat::bench {
namespace {

using physics::Method;

constexpr physics::ElementMaterial kMaterial{1000, 5e5, 0.4};
constexpr int kReferenceRate = 19200;  // [1/s] steps of explicit
constexpr double kSameScheme = 0.05;   // [-] of an error: beyond it Bullet's material is not ours
constexpr int kCrossCheckRate = 960;   // [1/s] steps of implicit, beside the reference

/// Runs of a row, the best of which counts: the shorter it is, the more of it others on the machine can spoil.
int repetitions(int tets) { return std::clamp(2000 / tets, 2, 10); }

/// Bullet's build with float or double.
class BulletModule {
 public:
  explicit BulletModule(const char* path) : handle_(dlopen(path, RTLD_NOW | RTLD_LOCAL)) {
    if (handle_ == nullptr) throw std::runtime_error(dlerror());
    find("bullet_make", make);
    find("bullet_step", step);
    find("bullet_read", read);
    find("bullet_destroy", destroy);
  }

  decltype(&bullet_make) make;
  decltype(&bullet_step) step;
  decltype(&bullet_read) read;
  decltype(&bullet_destroy) destroy;

 private:
  template <class Function>
  void find(const char* name, Function& function) {
    void* const symbol = dlsym(handle_, name);
    if (symbol == nullptr) throw std::runtime_error(dlerror());
    std::memcpy(&function, &symbol, sizeof function);
  }
  void* handle_;
};

const BulletModule& bullet(bool is_double) {
  static const BulletModule with_float(BULLET_PEER_FLOAT), with_double(BULLET_PEER_DOUBLE);
  return is_double ? with_double : with_float;
}

Motion run_bullet(const BulletModule& module, const PeerScene& peer, bool is_implicit, int steps_per_second) {
  const physics::Body& body = peer.scene.body;
  const physics::Lame lame = physics::lame_of(peer.material.youngs_modulus, peer.material.poissons_ratio);
  std::vector<char> held(static_cast<std::size_t>(body.node_count()), 0);
  for (const int node : body.held) held[static_cast<std::size_t>(node)] = 1;
  const BulletScene scene{
      body.node_count(),      body.tet_count(),   peer.start.x.data(), peer.start.v.data(), body.rest.data(),
      body.mass.data(),       held.data(),        body.tets.data(),    lame.lambda,         lame.mu,
      peer.scene.gravity.y(), is_implicit ? 1 : 0};
  const std::unique_ptr<void, decltype(module.destroy)> world(module.make(&scene), module.destroy);
  Motion motion{{peer.start}};
  physics::State state = peer.start;
  for (int frame = 0; frame < kDuration * kFramesPerSecond; ++frame) {
    for (int k = 0; k < steps_per_second / kFramesPerSecond; ++k) module.step(world.get(), 1.0 / steps_per_second);
    module.read(world.get(), state.x.data(), state.v.data());
    motion.frames.push_back(state);
    if (!state.x.allFinite()) {
      motion.is_whole = false;
      break;
    }
  }
  return motion;
}

struct Row {
  std::string scene, solver;
  int tets = 0, steps_per_second = 0;
  std::function<Motion()> run;
  Verdict verdict;
  double ms_per_second = std::numeric_limits<double>::infinity();  // [ms] of CPU for a simulated second, the best
};

std::string name_of(const Row& row) {
  return row.scene + "/" + std::to_string(row.tets) + "/" + row.solver + "/" + std::to_string(row.steps_per_second);
}

/// A scene with what its rows are held against.
struct Case {
  PeerScene peer;
  Motion reference;
  double cross_check = 0;  // [m] between the reference and implicit at a high rate
};

Motion run_ours(Method method, const PeerScene& peer, int steps_per_second) {
  return run(*physics::make_stepper(method, peer.scene), peer, steps_per_second);
}

Case make_case(PeerScene peer) {
  Case made{std::move(peer), {}, 0};
  made.reference = run_ours(Method::kExplicit, made.peer, kReferenceRate);
  made.cross_check = judge(made.peer, run_ours(Method::kImplicit, made.peer, kCrossCheckRate), made.reference).error;
  std::fprintf(stderr, "%s, %d tets: reference against implicit at %d steps/s: %.1e m\n", made.peer.name.c_str(),
               made.peer.scene.body.tet_count(), kCrossCheckRate, made.cross_check);
  return made;
}

/// Every solver at its settings. Bullet's explicit scheme wants more steps on finer meshes to be stable.
void add_rows(const Case& made, std::vector<Row>& rows) {
  const PeerScene& peer = made.peer;
  const int tets = peer.scene.body.tet_count();
  const auto add = [&](const std::string& solver, int steps_per_second, const std::function<Motion()>& run) {
    rows.push_back({peer.name, solver, tets, steps_per_second, run, {}});
  };
  const auto ours = [&](Method method, int rate) {
    add(physics::name_of(method), rate, [&peer, method, rate] { return run_ours(method, peer, rate); });
  };
  const auto theirs = [&](bool is_double, bool is_implicit, int rate) {
    const std::string name =
        std::string("Bullet ") + (is_implicit ? "implicit" : "explicit") + (is_double ? ", double" : "");
    add(name, rate,
        [&peer, is_double, is_implicit, rate] { return run_bullet(bullet(is_double), peer, is_implicit, rate); });
  };
  ours(Method::kExplicit, 60);
  for (const int rate : {60, 120, 240}) ours(Method::kImplicit, rate);
  ours(Method::kEuler, 60);
  ours(Method::kXpbd, 60);
  for (const int rate : {60, 240}) theirs(false, true, rate);
  theirs(true, false, tets < 1000 ? 960 : tets < 5000 ? 1920 : 2880);
}

void register_rows(const std::vector<Case>& cases, std::vector<Row>& rows) {
  for (Row& row : rows) {
    const auto made = std::find_if(cases.begin(), cases.end(), [&](const Case& each) {
      return each.peer.name == row.scene && each.peer.scene.body.tet_count() == row.tets;
    });
    benchmark::RegisterBenchmark(name_of(row).c_str(),
                                 [&row, &made = *made](benchmark::State& state) {
                                   Motion motion;
                                   for (auto _ : state) motion = row.run();
                                   row.verdict = judge(made.peer, motion, made.reference);
                                 })
        ->Iterations(1)
        ->Repetitions(repetitions(row.tets))
        ->Unit(benchmark::kMillisecond);
  }
}

/// Keeps the best time of each row.
class BestOf final : public benchmark::ConsoleReporter {
 public:
  explicit BestOf(std::vector<Row>& rows) : ConsoleReporter(OO_None), rows_(rows) {}
  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      if (run.run_type != Run::RT_Iteration || run.error_occurred) continue;
      for (Row& row : rows_) {
        if (name_of(row) == run.run_name.function_name)
          row.ms_per_second = std::min(row.ms_per_second, run.GetAdjustedCPUTime() / kDuration);
      }
    }
  }

 private:
  std::vector<Row>& rows_;
};

const Row* find(const std::vector<Row>& rows, const std::string& scene, int tets, const std::string& solver, int rate) {
  for (const Row& row : rows) {
    if (row.scene == scene && row.tets == tets && row.solver == solver && row.steps_per_second == rate) return &row;
  }
  return nullptr;
}

double times_of_bullet(const std::vector<Row>& rows, const Row& row) {
  const Row* const peer = find(rows, row.scene, row.tets, "Bullet implicit", 60);
  return peer == nullptr ? std::nan("") : row.ms_per_second / peer->ms_per_second;
}

void write_csv(const std::vector<Row>& rows, const std::vector<Case>& cases, std::ostream& out) {
  out << "scene,tets,solver,steps_per_s,cpu_ms_per_s,times_of_bullet_60,rms_error_m,least_jacobian,volume_error,angular_"
         "loss,sound\n";
  for (const Row& row : rows) {
    out << row.scene << ',' << row.tets << ",\"" << row.solver << "\"," << row.steps_per_second << ',' << row.ms_per_second
        << ',' << times_of_bullet(rows, row) << ',' << row.verdict.error << ',' << row.verdict.least_jacobian << ','
        << row.verdict.volume_error << ',' << row.verdict.angular_loss << ',' << row.verdict.is_sound << '\n';
  }
  for (const Case& each : cases) {
    out << each.peer.name << ',' << each.peer.scene.body.tet_count() << ",\"reference against implicit\"," << kCrossCheckRate
        << ",,," << each.cross_check << ",,,,\n";
  }
}

void print_markdown(const std::vector<Row>& rows) {
  std::printf(
      "| scene | tets | solver | steps/s | CPU ms per s | of Bullet's at 60 | RMS error [m] | least J | volume off | "
      "angular momentum lost |\n");
  std::printf("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
  for (const Row& row : rows) {
    char lost[20] = "";
    if (row.scene == "tumbling") std::snprintf(lost, sizeof lost, "%.1e", row.verdict.angular_loss);
    std::printf("| %s | %d | %s | %d | %.3g | %.3f | %.1e | %.2f%s | %.2g %% | %s |\n", row.scene.c_str(), row.tets,
                row.solver.c_str(), row.steps_per_second, row.ms_per_second, times_of_bullet(rows, row), row.verdict.error,
                row.verdict.least_jacobian, row.verdict.is_sound ? "" : ", broken", 100 * row.verdict.volume_error, lost);
  }
}

/// Prints whether each goal is met; false if one is missed.
bool tell_goals(const std::vector<Row>& rows) {
  bool all = true;
  const auto tell = [&](bool is_met, const char* text, int tets, double is, double goal) {
    all = all && is_met;
    std::printf("%s: %d tets: %s: %.3g (goal: at most %.3g)\n", is_met ? "met" : "MISSED", tets, text, is, goal);
  };
  const auto at_most = [&](const char* text, int tets, double is, double goal) { tell(is <= goal, text, tets, is, goal); };
  for (const Row& row : rows) {
    const int tets = row.tets;
    if (row.scene == "tumbling" && row.solver == "explicit") {
      at_most("tumbling: angular momentum lost by explicit", tets, row.verdict.angular_loss, 1e-9);
    } else if (row.scene == "tumbling" && row.solver == "implicit") {
      const std::string text =
          "tumbling: angular momentum lost by implicit at " + std::to_string(row.steps_per_second) + " Hz";
      at_most(text.c_str(), tets, row.verdict.angular_loss, 1e-4);
    } else if (row.scene == "cantilever" && row.solver == "explicit") {
      at_most("cantilever: RMS error of explicit [m]", tets, row.verdict.error, 1e-4);
      const Row* const peer = find(rows, "cantilever", tets, "Bullet implicit", 60);
      if (peer == nullptr) continue;
      at_most("cantilever: time of explicit over Bullet's at 60 Hz", tets, times_of_bullet(rows, row),
              tets < 5000 ? 1.0 / 8 : 1.0 / 7);
      at_most("cantilever: error of explicit over Bullet's at 60 Hz", tets, row.verdict.error / peer->verdict.error, 0.01);
      const Row* const same = find(rows, "cantilever", tets, "euler", 60);
      if (same == nullptr) continue;
      at_most("cantilever: how far Bullet's error is from that of euler, the same scheme of the same material [-]", tets,
              std::abs(peer->verdict.error / same->verdict.error - 1), kSameScheme);
    }
  }
  return all;
}

int run_all(int argc, char** argv) {
  std::filesystem::path out = "out/peers";
  std::string tets = "192,1152,5184";
  std::string interleaved = "--benchmark_enable_random_interleaving=true";  // so that all rows share a loaded minute
  std::vector<char*> arguments(argv, argv + argc);
  arguments.insert(arguments.begin() + 1, interleaved.data());
  argc = static_cast<int>(arguments.size());
  argv = arguments.data();
  benchmark::Initialize(&argc, argv);
  for (int k = 1; k + 1 < argc; k += 2) {
    if (std::string(argv[k]) == "-o") out = argv[k + 1];
    if (std::string(argv[k]) == "--tets") tets = argv[k + 1];
  }
  std::vector<Case> cases;
  for (const auto& [along, across] : kSizes) {
    if (("," + tets + ",").find("," + std::to_string(6 * along * across * across) + ",") == std::string::npos) continue;
    cases.push_back(make_case(cantilever(along, across, kMaterial)));
    cases.push_back(make_case(tumbling(along, across, kMaterial)));
  }
  std::vector<Row> rows;
  for (const Case& made : cases) add_rows(made, rows);
  register_rows(cases, rows);
  BestOf reporter(rows);
  benchmark::RunSpecifiedBenchmarks(&reporter);
  std::erase_if(rows, [](const Row& row) { return !std::isfinite(row.ms_per_second); });  // left out
  std::filesystem::create_directories(out);
  std::ofstream file(out / "peers.csv");
  write_csv(rows, cases, file);
  print_markdown(rows);
  std::printf("\n");
  return tell_goals(rows) ? 0 : 1;
}

}  // namespace
}  // namespace hydrostat::bench

int main(int argc, char** argv) try { return hydrostat::bench::run_all(argc, argv); } catch (const std::exception& error) {
  std::cerr << "peer_bench: " << error.what() << "\n";
  return 1;
}
