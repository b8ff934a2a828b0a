#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <thread>

#include "cli/number_option.h"
#include "cli/outcome.h"
#include "cli/stages.h"
#include "cli/subcommands.h"
#include "io/body_file.h"
#include "io/creature_record.h"
#include "io/fingerprint.h"
#include "io/gltf_out.h"
#include "io/import.h"
#include "io/signals_file.h"
#include "io/stage_records.h"
#include "retarget/error.h"
#include "retarget/run_warnings.h"

namespace hydrostat::cli {

namespace fs = std::filesystem;

namespace {

struct ConvertOptions {
  std::string clip_file, out, clip, root_motion = "auto", limit = "auto", method = "auto";
  double height = 0;
  int nodes = 0;
  double friction = retarget::CreatureOptions().friction;
  unsigned seed = 0;
  int threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  bool json = false, quiet = false;
};

constexpr double kLeastLimit = 0.01, kMostLimit = 0.9;

const std::map<std::string, retarget::RootMotion> kRootMotions{{"auto", retarget::RootMotion::kAuto},
                                                               {"keep", retarget::RootMotion::kKeep},
                                                               {"from-feet", retarget::RootMotion::kFromFeet},
                                                               {"none", retarget::RootMotion::kNone}};
const std::map<std::string, physics::Method> kMethods{{"auto", retarget::CreatureOptions().method},
                                                      {"explicit", physics::Method::kExplicit},
                                                      {"euler", physics::Method::kEuler}};

/// The key of a stage: all that the stage before depends on, and what this one adds.
template <typename... Values>
std::string key_after(const std::string& before, const Values&... values) {
  io::Fingerprint fingerprint;
  fingerprint.add("before", before);
  (fingerprint.add("value", values), ...);
  return fingerprint.hex();
}

/// What the body depends on: this program and what was read, wherever its bytes lie (a glTF file may have them beside it).
std::string key_of(const io::ImportedCharacter& imported) {
  return key_after(io::file_sha256("/proc/self/exe"), io::packed(io::record_of(imported), "import", ""));
}

retarget::CreatureOptions creature_options(const ConvertOptions& options) {
  retarget::CreatureOptions result;
  result.height_m = options.height;
  result.nodes = options.nodes;
  result.root_motion = kRootMotions.at(options.root_motion);
  result.friction = options.friction;
  result.method = kMethods.at(options.method);
  result.threads = options.threads;
  return result;
}

io::ImportedCharacter import(const ConvertOptions& options) {
  io::ImportedCharacter imported;
  const double rate_hz = retarget::CreatureOptions().rate_hz;
  imported.character = io::import_character(options.clip_file, options.clip, {rate_hz}, &imported.warnings);
  return imported;
}

retarget::SignalSet solved_signals(const retarget::InverseDynamics& inverse, const retarget::Creature& creature,
                                   const retarget::Muscles& muscles, const retarget::Motion& target, const std::string& file) {
  const physics::Body& body = creature.scene.body;
  const retarget::SolvedSignals solved{target.loop ? signal::Kind::loop : signal::Kind::one_shot,
                                       target.duration_s(),
                                       inverse.report.limit,
                                       inverse.activation.transpose(),
                                       inverse.penalty_force.transpose(),
                                       muscles.edge_bone,
                                       body.edges,
                                       body.rest_length,
                                       body.edge_stiffness};
  const std::string broken = retarget::broken_rule({}, solved.kind, static_cast<int>(solved.activation.rows()));
  if (!broken.empty()) {
    throw Error(file, "clip '" + creature.character.clip.name + "'", broken, "Give a longer clip.");
  }
  return retarget::analyse_signals(solved, {});
}

/// Layers of the creature that is about to be replaced; a sentence for each that does not fit any more.
std::vector<std::string> keep_earlier_layers(const fs::path& creature, retarget::SignalSet& signals) {
  const fs::path file = creature / "signals.json";
  if (!io::is_creature(creature) || !fs::exists(file)) return {};
  return retarget::keep_layers(io::read_signals(file), signals);
}

retarget::Performer make_performer(const retarget::Creature& creature, const retarget::ImportedMotion& motion,
                                   const retarget::PreparedTarget& prepared, const retarget::Muscles& muscles) {
  retarget::Performer performer;
  performer.skin.vertices = creature.character.skin.vertices;
  performer.skin.triangles = creature.character.skin.triangles;
  performer.embedding = creature.skin;
  performer.mesh = creature.mesh;
  performer.contacts = creature.contacts;
  performer.scene = creature.scene;
  performer.muscles = muscles;
  performer.prepared = prepared;
  performer.clip_points = motion.skin_points;
  performer.clip_skin = motion.skin;
  performer.length = creature.length;
  performer.size = creature.size;
  return performer;
}

retarget::SourceReport source_report(const ConvertOptions& options, const retarget::Creature& creature,
                                     const retarget::ImportedMotion& motion) {
  const retarget::Clip& clip = creature.character.clip;
  retarget::SourceReport report;
  report.file = options.clip_file;
  report.sha256 = io::file_sha256(options.clip_file);
  report.clip = clip.name;
  report.root_motion = motion.root_motion;
  report.duration_s = clip.duration_s;
  report.rate_hz = clip.key_rate_hz;
  report.scale = creature.scale;
  return report;
}

retarget::BodyReport body_report(const retarget::Creature& creature) {
  retarget::BodyReport report;
  report.nodes = creature.mesh.node_count();
  report.elements = static_cast<int>(creature.mesh.tets.cols());
  report.constraints = static_cast<int>(creature.mesh.edges.cols());
  report.vertices = static_cast<int>(creature.character.skin.vertices.cols());
  report.pieces = retarget::count_pieces(creature.mesh.tets);
  report.bridged_cells = creature.mesh.bridged_cells;
  report.copied_cells = creature.mesh.copied_cells;
  report.mass_kg = creature.scene.body.mass.sum();
  report.length_m = creature.length;
  report.size_m = creature.size;
  report.youngs_modulus_pa = creature.youngs_modulus;
  return report;
}

io::CreatureRecord creature_record(const ConvertOptions& options, const retarget::RunReport& report) {
  io::CreatureRecord record;
  record.source_file = fs::absolute(options.clip_file).string();
  record.source_sha256 = report.source.sha256;
  record.clip = report.source.clip;
  record.settings = {{"height", options.height},         {"nodes", std::int64_t{options.nodes}},
                     {"root-motion", options.root_motion}, {"limit", report.inverse.limit},
                     {"limit-chosen-by", options.limit == "auto" ? std::string("auto") : std::string("user")},
                     {"method", report.accuracy.method},   {"friction", options.friction},
                     {"seed", std::int64_t{options.seed}}};
  for (const retarget::EffectReport& effect : report.effects) record.effects.push_back({effect.name, effect.state, effect.reason});
  return record;
}

void add(std::vector<std::string>& warnings, const std::vector<std::string>& more) {
  warnings.insert(warnings.end(), more.begin(), more.end());
}

Eigen::VectorXi dominant_bones_of_nodes(const Eigen::MatrixXd& bone_weights) {
  Eigen::VectorXi bones(bone_weights.cols());
  for (Eigen::Index i = 0; i < bones.size(); ++i) bone_weights.col(i).maxCoeff(&bones[i]);
  return bones;
}

int convert(const ConvertOptions& options) {
  const bool limit_is_automatic = options.limit == "auto";
  const double wished_limit =
      limit_is_automatic ? 0 : parse_number(options.limit, kLeastLimit, kMostLimit, "hydrostat convert", "--limit");
  const retarget::CreatureOptions settings = creature_options(options);
  Progress progress(std::cerr, progress_style(options.quiet));
  Stages stages(progress);
  io::PerformedTarget target;
  retarget::RunReport& report = target.report;

  const io::ImportedCharacter imported = stages.run("import", [&] { return import(options); });
  io::CreatureWriter writer(options.out, io::CreatureWriter::Start::afresh);
  stages.use_cache(writer.cache_directory());

  const std::string body_key = key_after(key_of(imported), options.height, options.nodes);
  retarget::Creature creature =
      stages.run("body", body_key, [&] { return retarget::make_creature(imported.character, settings); });
  creature.scene.ground.friction = options.friction;  // of the ground, not of the body: what is cached may have another
  const std::string motion_key = key_after(body_key, options.root_motion);
  const auto motion = stages.run("coupling", motion_key, [&] { return retarget::import_motion(creature, settings); });

  const std::string prepare_key = key_after(motion_key, options.friction);
  const auto prepared = stages.run("preparation", prepare_key, [&] {
    return retarget::prepare(motion.nodes, creature.scene, retarget::bones_of(creature.contacts), creature.character.skeleton.names,
                             creature.mesh.bone_weights, creature.length, creature.size, {});
  });

  retarget::InverseOptions inverse_options;
  inverse_options.limit =
      limit_is_automatic ? retarget::automatic_limit(creature.scene.body, prepared.target) : wished_limit;
  inverse_options.threads = options.threads;
  const std::string inverse_key = key_after(prepare_key, inverse_options.limit);
  const auto inverse = stages.run("inverse_dynamics", inverse_key, [&] {
    return retarget::solve_inverse_dynamics(prepared, creature.scene, creature.length, inverse_options);
  });

  const retarget::Muscles muscles =
      retarget::make_muscles(creature.scene.body, creature.character.skeleton, creature.mesh.bone_weights);
  std::vector<std::string> layers_told;
  const retarget::SignalSet signals = stages.run("signals", [&] {
    retarget::SignalSet set = solved_signals(inverse, creature, muscles, prepared.target, options.clip_file);
    layers_told = keep_earlier_layers(options.out, set);
    return set;
  });
  target.performer = make_performer(creature, motion, prepared, muscles);

  retarget::PerformOptions perform_options;
  perform_options.replay.method = settings.method;
  perform_options.replay.duration_s = retarget::usual_duration(prepared.target);
  perform_options.seed = options.seed;
  perform_options.threads = options.threads;
  const std::string signals_text = io::signals_text(signals);
  const std::string replay_key = key_after(inverse_key, signals_text, physics::name_of(settings.method), std::int64_t{options.seed});
  const auto performances =
      stages.run("replay", replay_key, [&] { return retarget::perform(target.performer, signals, perform_options); });

  report.source = source_report(options, creature, motion);
  report.body = body_report(creature);
  report.coupling = motion.coupling;
  report.preparation = prepared.report;
  report.inverse = inverse.report;
  report.signals = signals_report(signals);
  report.signals.error_rms_l0 = retarget::activation_error_rms(signals, inverse.activation.transpose());
  add(report.warnings, imported.warnings);
  add(report.warnings, creature.warnings);
  add(report.warnings, motion.warnings);
  add(report.warnings, prepared.warnings);
  add(report.warnings, retarget::target_warnings(prepared, creature.scene.body, inverse_options.limit, limit_is_automatic));
  add(report.warnings, retarget::inverse_warnings(inverse.report));
  const std::string target_file = io::target_bytes(target);
  add(report.warnings, layers_told);
  stages.run("measurement", [&] {
    measure(target.performer, signals, perform_options, report);
    return 0;
  });
  report_replays(performances, report);

  stages.run("files", [&] {
    writer.write("creature.toml", io::to_toml(creature_record(options, report)));
    writer.write("body.json", io::body_text(target.performer, creature.character.skeleton.names,
                                            dominant_bones_of_nodes(creature.mesh.bone_weights)));
    writer.write("target.bin", target_file);
    writer.write("signals.json", signals_text);
    io::write_skinned_glb(writer.directory() / "reference.glb",
                          {target.performer.skin.vertices, target.performer.skin.triangles, target.performer.embedding},
                          target.performer.mesh, target.performer.scene.body.mass, prepared.target, {});
    return 0;
  });
  report.timing_s = stages.timing_s;
  write_outcome(writer, target.performer, signals, performances, report);
  writer.commit();
  const retarget::Replay& run = performances.main();
  const std::string motion_file = (fs::path(options.out) / "failed.glb").string();
  return options.json ? tell_report(run, options.out, motion_file, report) : tell_run(run, options.out, motion_file);
}

}  // namespace

void add_convert(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ConvertOptions>();
  CLI::App* convert_command = app.add_subcommand("convert", "Make a creature of a clip: a soft body that performs it by itself");
  convert_command->add_option("CLIP", options->clip_file, "FBX, glTF, ... with a skeleton, a skin and a clip")->required();
  convert_command->add_option("-o,--out", options->out, "Directory of the creature")->required();
  convert_command->add_option("--clip", options->clip, "Clip by name or index [the first that lasts]");
  convert_command->add_option("--height", options->height, "Height of the bind pose [m]; otherwise the file's")
      ->check(number_within(0.01, 1000));
  convert_command->add_option("--nodes", options->nodes, "Wished number of control nodes; otherwise what fits the body")
      ->check(number_within(20, 5000));
  convert_command->add_option("--root-motion", options->root_motion, "Where the travel comes from: auto, keep, from-feet or none")
      ->check(CLI::IsMember(kRootMotions))
      ->capture_default_str();
  convert_command->add_option("--limit", options->limit, "Largest |activation - 1|, 0.01 to 0.9, or auto")->capture_default_str();
  convert_command->add_option("--method", options->method, "Time integration: auto, explicit or euler")
      ->check(CLI::IsMember(kMethods))
      ->capture_default_str();
  convert_command->add_option("--friction", options->friction, "Coulomb's coefficient of the ground")
      ->check(number_within(0.05, 5))
      ->capture_default_str();
  convert_command->add_option("--seed", options->seed, "Other than 0: the body that is let go differs from the plan by up to 2 % in "
                                                       "mass, friction and stiffness, drawn from this number")
      ->capture_default_str();
  convert_command->add_option("--threads", options->threads, "At most so many; the outcome does not hang on it")
      ->check(number_within(1, 256));
  convert_command->add_flag("--json", options->json, "Print the report as JSON");
  convert_command->add_flag("--quiet", options->quiet, "No progress");
  convert_command->callback([options, &exit_code] { exit_code = convert(*options); });
}

}  // namespace hydrostat::cli
