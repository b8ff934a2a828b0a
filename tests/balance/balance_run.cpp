// One free run of the balance bench: a creature, a variant of the corrector, a seed, a push; one row of balance.csv on standard output.
// tests/balance/run.sh calls it for all of them. Usage: balance_run DIR VARIANT SEED PUSH CYCLES [FRAMES.json|- [SCENE.toml]]
// SEED draws mass, friction and stiffness within 10 % of the plan and a shove of up to 0.1 m/s at the start; 0 is the plan itself.
// PUSH is "none" or DIRECTION:PHASE:SPEED, the direction in eighths of a turn, the phase in quarters of the third cycle, or of what is played
// once, the speed in m/s.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <map>
#include <random>
#include <sstream>

#include "io/creature_scene.h"
#include "io/load_creature.h"
#include "retarget/error.h"
#include "retarget/level.h"
#include "retarget/performance.h"

namespace hydrostat {
namespace {

constexpr double kVariation = 0.1;      // of mass, friction and stiffness
constexpr double kFirstShove = 0.1;     // [m/s] at most
constexpr double kPushCycle = 2;        // of a loop, in which the push comes; what is played once has but one
constexpr int kEighths = 8, kQuarters = 4;

/// The ground's slope [deg], rising towards -x turned by `side` [deg] about -y; the corrector's model stands on it, too.
struct Slope {
  double degrees = 0, side = 0;

  void tilt(Eigen::Vector3d& gravity) const {
    const double tilt = degrees * M_PI / 180, angle = side * M_PI / 180;
    const Eigen::Vector3d down(std::sin(tilt) * std::cos(angle), -std::cos(tilt), std::sin(tilt) * std::sin(angle));
    if (degrees != 0) gravity = gravity.norm() * down;
  }
};

/// What the usual feedback is weighed against: deviations of nodes alone; the whole body alone, by its momentum, cones and feet; both
/// without placing feet where the body is to be caught; and a cost to go. "unsteered", which set_variant knows, has nothing from cycle to cycle.
const std::map<std::string, std::string> kNamed{{"deviations", "root=1e-6:cone=0:foot=0:step=0:long_step=1e9"},
                                                {"whole_body", "nodes=0"},
                                                {"unplaced", "step=0:long_step=1e9"},
                                                {"regulator", "regulator=0.01"}};

/// A variant of the feedback: "usual", as convert has it, or that with changes: one of kNamed; "effort=1:settle=0.15";
/// "regulator=0.001:cost=1e-4"; of the ground: "slope=5:side=90"; or of the control mesh: "lod=52", as replay has it, with other feedback
/// where it falls or loses its way. The creature's own feedback is factors on all that.
void set_variant(const std::string& variant, retarget::ReplayOptions& replay, Slope& slope, double& nodes) {
  retarget::CorrectorOptions& options = replay.corrector;
  const std::map<std::string, double*> knobs{{"effort", &options.effort},       {"settle", &options.settle_s},
                                             {"nodes", &options.node_weight},   {"root", &options.root_weight},
                                             {"horizon", &options.horizon_s}, {"cone", &options.cone_weight},
                                             {"foot", &options.foot_weight},  {"foot_settle", &options.foot_settle_s},
                                             {"step", &options.step},         {"ahead", &options.step_ahead},
                                             {"long_step", &options.long_step},
                                             {"clearance", &options.clearance},
                                             {"calm", &options.calm},         {"calm_error", &options.calm_error},
                                             {"regulator", &options.regulator.reach},
                                             {"place", &options.regulator.place},
                                             {"speed", &options.regulator.speed},
                                             {"cost", &options.regulator.effort},
                                             {"learn", &options.regulator.learn},
                                             {"keep", &options.regulator.keep},
                                             {"last", &options.regulator.last},
                                             {"slope", &slope.degrees},       {"side", &slope.side},
                                             {"lod", &nodes},
                                             {"noise", &replay.observation.noise_m},
                                             {"delay", &replay.observation.delay_s}};
  std::istringstream parts(variant);
  for (std::string part; std::getline(parts, part, ':');) {
    if (part == "usual" || part == "polished") continue;  // the latter is another creature
    if (part == "unsteered") {
      replay.keep_way = false;
      continue;
    }
    if (const auto named = kNamed.find(part); named != kNamed.end()) {
      set_variant(named->second, replay, slope, nodes);
      continue;
    }
    const std::size_t equals = part.find('=');
    if (part.substr(0, equals) == "modes" && equals != std::string::npos) {
      options.regulator.modes = std::stoi(part.substr(equals + 1));
      continue;
    }
    if (part.substr(0, equals) == "every" && equals != std::string::npos) {
      options.response_every = std::stoi(part.substr(equals + 1));
      continue;
    }
    const auto knob = knobs.find(part.substr(0, equals));
    if (equals == std::string::npos || knob == knobs.end()) {
      throw Error("balance_run", "VARIANT", "'" + part + "' changes nothing that is known", "Write it like effort=1:settle=0.15.");
    }
    *knob->second = std::stod(part.substr(equals + 1));
  }
}

retarget::Push shove(double time_s, double angle, double speed) {
  retarget::Push push;
  push.time_s = time_s;
  push.delta_v = speed * Eigen::Vector3d(std::cos(angle), 0, std::sin(angle));
  return push;
}

/// From "DIRECTION:PHASE:SPEED".
retarget::Push parse_push(const std::string& text, const retarget::Motion& target) {
  int direction = 0, phase = 0;
  double speed = 0;
  if (std::sscanf(text.c_str(), "%d:%d:%lf", &direction, &phase, &speed) != 3) {
    throw Error("balance_run", "PUSH", "'" + text + "' is not DIRECTION:PHASE:SPEED", "Write it like 2:1:0.5, or 'none'.");
  }
  const double cycles = (target.loop ? kPushCycle : 0) + static_cast<double>(phase) / kQuarters;
  return shove(cycles * target.duration_s(), 2 * M_PI * direction / kEighths, speed);
}

/// Every third frame of the nodes, for the page's looping pictures.
void write_frames(const std::string& file, const retarget::Performer& performer, const retarget::Motion& motion) {
  std::ofstream out(file);
  out.precision(4);
  out << "{\"rate_hz\":" << motion.rate_hz / 3 << ",\"edges\":[";
  const auto& edges = performer.scene.body.edges;
  for (Eigen::Index e = 0; e < edges.cols(); ++e) out << (e ? "," : "") << edges(0, e) << "," << edges(1, e);
  out << "],\"frames\":[";
  for (Eigen::Index f = 0; f < motion.count(); f += 3) {
    out << (f ? ",[" : "[");
    for (Eigen::Index r = 0; r < motion.frames.rows(); ++r) out << (r ? "," : "") << motion.frames(r, f) / performer.length;
    out << "]";
  }
  out << "]}\n";
}

/// On another control mesh, as replay --lod has it.
void take_level(const std::string& directory, double nodes, io::LoadedCreature& creature) {
  retarget::CreatureOptions options = io::level_options(creature);
  options.nodes = static_cast<int>(nodes);
  retarget::Level level = retarget::at_level(creature.target.performer, creature.signals, io::load_rig(directory, creature), options);
  creature.target.performer = std::move(level.performer);
  creature.signals = std::move(level.signals);
}

int run(int argc, char** argv) {
  if (argc < 6) {
    std::cerr << "usage: balance_run DIR VARIANT SEED PUSH CYCLES [FRAMES.json|- [SCENE.toml]]\n";
    return 2;
  }
  const std::string directory = argv[1], variant = argv[2], push = argv[4];
  const auto seed = static_cast<unsigned>(std::atoi(argv[3]));
  io::LoadedCreature creature = io::load_creature(directory);
  retarget::Performer& performer = creature.target.performer;
  const retarget::Motion& target = performer.prepared.target;
  retarget::PerformOptions options;
  Slope slope;
  double nodes = 0;  // of the level of detail; 0: the creature itself
  options.feedback = io::feedback_of(creature.record);
  set_variant(variant, options.replay, slope, nodes);
  if (nodes > 0) take_level(directory, nodes, creature);
  if (argc > 7) io::put_in_scene(argv[7], performer);
  slope.tilt(performer.scene.gravity);
  options.replay.duration_s = target.loop ? std::atof(argv[5]) * target.duration_s() : retarget::usual_duration(target);
  options.baselines = false;
  options.threads = 1;
  options.seed = seed;
  options.replay.observation.seed = seed;
  options.variation = kVariation;
  std::seed_seq of_shoves{seed, 1U};  // not the body's own numbers: or all heavy ones would be shoved the same way
  std::mt19937 random(of_shoves);
  const double angle = 2 * M_PI * static_cast<double>(random()) / 4294967296.0;
  if (seed != 0) options.replay.pushes.push_back(shove(0, angle, kFirstShove * static_cast<double>(random()) / 4294967296.0));
  if (push != "none") options.replay.pushes.push_back(parse_push(push, target));
  const retarget::Act act(performer, creature.signals);
  const retarget::Replay replay = *(nodes > 0 ? perform_steadily(act, options) : perform(act, options)).closed_loop;
  const retarget::ReplayReport& r = replay.report;
  const double travel = r.clip_travel_per_cycle_length > 0.01 ? r.travel_per_cycle_length / r.clip_travel_per_cycle_length : 1;
  std::string cause = r.fall_cause;
  std::replace(cause.begin(), cause.end(), ',', ';');
  std::printf("%s,%d,%.4g,%.3f,%.3g,%.3g,%.3g,%.3g,%.3g,%.3g,%.3g,%.3g,", r.fell ? "fell" : "up", target.loop ? 1 : 0, r.cycles,
              r.fell ? r.fall_time_s : r.duration_s, r.shape_rms_length, r.clip_shape_rms_length, r.drift_per_cycle_length,
              r.heading_deg_per_cycle, travel, r.slip_per_stance_length, r.penetration_max_size, r.real_time_factor);
  std::printf("%.3g,%.3g,%.3g,%.3g,%d,%.3g,%.3g,%.3g,%.3g,%s\n", r.held_slip_per_stance_length, r.momentum_residual_mg,
              r.angular_residual_mgl, r.external_assist_mg, r.guard_steps, r.feedback_rms, r.correction_buzz_rms, r.style_range,
              r.style_range_least, cause.c_str());
  if (argc > 6 && argv[6] != std::string("-")) write_frames(argv[6], performer, replay.motion);
  return 0;
}

}  // namespace
}  // namespace hydrostat

int main(int argc, char** argv) {
  try {
    return hydrostat::run(argc, argv);
  } catch (const hydrostat::Error& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
}
