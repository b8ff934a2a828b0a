#include "cli/conversion.h"

#include <cmath>
#include <filesystem>
#include <iostream>

#include "cli/choice_record.h"
#include "cli/make_performer.h"
#include "cli/outcome.h"
#include "cli/wobble_option.h"
#include "io/body_file.h"
#include "io/creature_record.h"
#include "io/creature_scene.h"
#include "io/fingerprint.h"
#include "io/gltf_out.h"
#include "io/signals_file.h"
#include "io/path_file.h"
#include "io/stage_records.h"
#include "io/wobble_file.h"
#include "retarget/com_path.h"
#include "retarget/error.h"
#include "retarget/flight.h"
#include "retarget/performed_scenario.h"
#include "retarget/prepare_standing.h"
#include "retarget/run_warnings.h"
#include "retarget/wobble_plan.h"

namespace hydrostat::cli {

namespace fs = std::filesystem;

namespace {

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

/// Layers of the creature that is about to be replaced; a sentence for each that does not fit any more.
std::vector<std::string> keep_earlier_layers(const fs::path& creature, retarget::SignalSet& signals) {
  const fs::path file = creature / "signals.json";
  if (!io::is_creature(creature) || !fs::exists(file)) return {};
  return retarget::keep_layers(io::read_signals(file), signals);
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
  const physics::Body& body = creature.scene.body;
  report.elements = body.elements.empty() ? body.tet_count() : body.elements.front().block.element_count();
  report.constraints = body.edge_count();
  report.vertices = static_cast<int>(creature.character.skin.vertices.cols());
  report.pieces = retarget::count_pieces(creature.mesh.tets);
  report.bridged_cells = creature.mesh.bridged_cells;
  report.copied_cells = creature.mesh.copied_cells;
  report.mass_kg = creature.scene.body.mass.sum();
  report.length_m = creature.length;
  report.size_m = creature.size;
  report.youngs_modulus_pa =
      body.elements.empty() ? creature.youngs_modulus : body.elements.front().materials.front().youngs_modulus;
  return report;
}

io::CreatureRecord creature_record(const ConvertOptions& options, const retarget::Performer& performer, const retarget::RunReport& report,
                                   const std::optional<ChosenStep>& chosen, double effort, int nodes) {
  io::CreatureRecord record;
  record.source_file = fs::absolute(options.clip_file).string();
  record.source_sha256 = report.source.sha256;
  record.clip = report.source.clip;
  record.clip_rise_m = performer.clip_rise;
  record.settings = {{"height", options.height},
                     {"nodes", std::int64_t{nodes}},
                     {"root-motion", options.root_motion},
                     {"limit", report.inverse.limit},
                     {"limit-chosen-by", options.limit == "auto" ? std::string("auto") : std::string("user")},
                     {"element", report.accuracy.element},
                     {"material", report.accuracy.material},
                     {"calibrated", options.calibrated},
                     {"method", report.accuracy.method},
                     {"friction", options.friction},
                     {"wobble", options.wobble},
                     {"polish", options.polish},
                     {"seed", std::int64_t{options.seed}}};
  for (const std::string& mesh : options.import.meshes) record.settings.emplace_back("mesh", mesh);
  if (!options.import.root.empty()) record.settings.emplace_back("root", options.import.root);
  if (!options.import.up.empty()) record.settings.emplace_back("up", options.import.up);
  if (options.import.metres_per_unit > 0) record.settings.emplace_back("unit", options.import.metres_per_unit);
  if (options.import.from_s > 0) record.settings.emplace_back("from", options.import.from_s);
  if (options.import.to_s) record.settings.emplace_back("to", *options.import.to_s);
  if (!options.scene.empty()) record.settings.emplace_back("scene", fs::absolute(options.scene).string());
  if (chosen) record.settings.emplace_back("step_s", chosen->setting.dt_s);
  if (effort != 1) record.settings.emplace_back("corrector_effort", effort);
  for (const retarget::EffectReport& effect : report.effects) record.effects.push_back({effect.name, effect.state, effect.reason});
  return record;
}

retarget::PolishReport polish_report(int rounds, const retarget::Performances& before, const retarget::Performances& after) {
  const auto stays_up = [](const retarget::Performances& runs) {
    const retarget::ReplayReport& open = runs.open_loop->report;
    return open.fell ? open.fall_time_s : open.duration_s;
  };
  return {rounds, before.main().report.correction_rms, after.main().report.correction_rms, stays_up(before), stays_up(after)};
}

Eigen::VectorXi dominant_bones_of_nodes(const Eigen::MatrixXd& bone_weights) {
  Eigen::VectorXi bones(bone_weights.cols());
  for (Eigen::Index i = 0; i < bones.size(); ++i) bone_weights.col(i).maxCoeff(&bones[i]);
  return bones;
}

}  // namespace

void Conversion::run(const io::ImportedCharacter& imported, double wished_limit) {
  if (!options_.scene.empty()) scene_text_ = io::creature_scene_text(options_.scene);
  add_warnings(imported.warnings);
  appearance_ = imported.appearance;
  solve(imported, wished_limit);
  if (options_.accuracy.is_asked()) choose(imported, wished_limit);
  put_in_scene();
  let_go();
  write();
}

void Conversion::solve(const io::ImportedCharacter& imported, double wished_limit) {
  make_body(imported);
  find_activations(wished_limit);
  solve_signals();
  solved_key_ = key_;
}

void Conversion::add_warnings(const std::vector<std::string>& more) {
  std::vector<std::string>& warnings = target_.report.warnings;
  warnings.insert(warnings.end(), more.begin(), more.end());
}

void Conversion::make_body(const io::ImportedCharacter& imported) {
  key_ = key_after(key_of(imported), options_.height, settings_.nodes, options_.element, name_of(settings_.material),
                   std::int64_t{settings_.calibrated});
  creature_ = stages_.run("body", key_, [&] { return retarget::make_creature(imported.character, settings_); });
  creature_.scene.ground.friction = options_.friction;  // of the ground, not of the body: what is cached may have another
  key_ = key_after(key_, options_.root_motion);
  motion_ = stages_.run("coupling", key_, [&] { return retarget::import_motion(creature_, settings_); });
  add_warnings(creature_.warnings);
  add_warnings(motion_.warnings);
}

void Conversion::find_activations(double wished_limit) {
  const physics::Scene& scene = creature_.scene;
  key_ = key_after(key_, options_.friction);
  retarget::PreparedTarget prepared = stages_.run("preparation", key_, [&] { return prepared_target(creature_, motion_); });
  retarget::lighten(prepared, creature_.scene.body);
  retarget::InverseOptions inverse_options;
  inverse_options.limit = wished_limit > 0 ? wished_limit : retarget::automatic_limit(scene.body, prepared.target);
  inverse_options.threads = options_.threads;
  key_ = key_after(key_, inverse_options.limit);
  inverse_ = stages_.run("inverse_dynamics", key_, [&] {
    return retarget::solve_inverse_dynamics(prepared, scene, creature_.length, inverse_options);
  });
  add_warnings(prepared.warnings);
  warn_of_flights(prepared);
  add_warnings(retarget::target_warnings(prepared, scene.body, inverse_options.limit, wished_limit == 0));
  add_warnings(retarget::inverse_warnings(inverse_.report));
  target_.performer = make_performer(creature_, motion_, std::move(prepared));
  plan_wobble();
}

void Conversion::plan_wobble() {
  retarget::Performer& performer = target_.performer;
  const retarget::Wish wish = wobble_wish(options_.wobble);
  const auto plan = [&] { return retarget::plan_wobble(performer, rig(), wish); };
  performer.wobble = wish == retarget::Wish::kOff ? plan() : stages_.run("wobble", key_after(key_, options_.wobble), plan);
}

retarget::Rig Conversion::rig() const {
  return {creature_.character.skeleton, creature_.character.skin, creature_.mesh.bone_weights};
}

void Conversion::warn_of_flights(const retarget::PreparedTarget& prepared) {
  const Eigen::Matrix3Xd path = retarget::com_path(motion_.nodes, creature_.scene.body.mass);
  const auto& vertices = creature_.character.skin.vertices;
  add_warnings(retarget::flight_warnings(
      retarget::flights(prepared.contacts, motion_.nodes, path, creature_.scene.gravity.norm()), motion_.nodes.rate_hz,
      vertices.row(1).maxCoeff() - vertices.row(1).minCoeff(), creature_.length));
}

void Conversion::solve_signals() {
  signals_ = stages_.run("signals", [&] {
    return solved_signals(inverse_, target_.performer, options_.clip_file, creature_.character.clip.name);
  });
  retarget::RunReport& report = target_.report;
  report.source = source_report(options_, creature_, motion_);
  report.body = body_report(creature_);
  report.coupling = motion_.coupling;
  report.preparation = target_.performer.prepared.report;
  report.inverse = inverse_.report;
  report.signals = signals_report(signals_);
  report.signals.error_rms_l0 = retarget::activation_error_rms(signals_, inverse_.activation.transpose());
  target_file_ = io::target_bytes(target_);  // before what a replay will tell anew
  add_warnings(keep_earlier_layers(options_.out, signals_));
  signals_text_ = io::signals_text(signals_);
}

void Conversion::choose(const io::ImportedCharacter& imported, double wished_limit) {
  whole_signals_ = signals_;
  choice_key_ = key_after(key_, signals_text_, options_.method, options_.accuracy.grade, options_.accuracy.max_error,
                          std::int64_t{options_.nodes}, std::int64_t{options_.seed}, scene_text_);
  if (const std::optional<io::Record> record = stages_.cache().load("accuracy", choice_key_)) {
    choice_key_.clear();
    chosen_ = choice_of(*record);
    repeat_choice(imported, wished_limit);
    return;
  }
  stages_.run("accuracy", [&] {
    choose_steps();
    return 0;
  });
  perform_within_error();
  if (settings_.nodes > 0 || !chosen_->report.is_met() || is_down(performances_.main())) return;
  stages_.run("resolution", [&] {
    choose_nodes(imported, wished_limit);
    return 0;
  });
}

void Conversion::repeat_choice(const io::ImportedCharacter& imported, double wished_limit) {
  add_warnings(chosen_->warnings);
  cut_signals();
  if (chosen_->wished_nodes == 0) return;
  Progress silent(std::cerr, ProgressStyle::silent);
  Stages stages = coarser_stages(silent);
  const std::unique_ptr<Conversion> coarser = on_coarser_mesh(imported, wished_limit, chosen_->wished_nodes, stages);
  coarser->perform();
  take_over(*coarser);
}

Stages Conversion::coarser_stages(Progress& progress) const {
  Stages stages(progress);
  stages.use_cache(writer_.cache_directory() / "coarser");
  return stages;
}

void Conversion::choose_steps() {
  const std::optional<physics::Method> only = options_.method == "auto" ? std::nullopt : std::optional(settings_.method);
  chosen_ = choose_step(options_.accuracy, "hydrostat convert", target_.performer, signals_, only);
  cut_harmonics(*chosen_, target_.performer, signals_);
  tell_signals();
}

void Conversion::cut_signals() {
  signals_ = chosen_->harmonics > 0 ? retarget::with_harmonics(whole_signals_, chosen_->harmonics) : whole_signals_;
  tell_signals();
}

void Conversion::choose_nodes(const io::ImportedCharacter& imported, double wished_limit) {
  constexpr int kFewest = 20;  // as --nodes has it
  const int own = creature_.mesh.node_count();
  int last = 0;
  Progress silent(std::cerr, ProgressStyle::silent);
  Stages stages = coarser_stages(silent);
  for (const double part : {0.25, 0.35, 0.5, 0.7}) {
    const int wished = static_cast<int>(std::lround(part * own));
    if (wished < kFewest) continue;
    const std::unique_ptr<Conversion> coarser = on_coarser_mesh(imported, wished_limit, wished, stages);
    if (!coarser || coarser->creature_.mesh.node_count() == last) continue;
    last = coarser->creature_.mesh.node_count();
    if (last >= own) return;
    if (take_mesh(*coarser, wished, chosen_->setting, chosen_->harmonics)) return;
    // The error that a cheap method and few harmonics use up may be what this mesh needs.
    const retarget::StepSetting accurate{physics::Method::kExplicit, kControlSeconds};
    const bool is_other = chosen_->setting.method != accurate.method || chosen_->harmonics > 0;
    if (options_.method == "auto" && is_other && take_mesh(*coarser, wished, accurate, 0)) return;
  }
}

bool Conversion::take_mesh(Conversion& coarser, int wished, const retarget::StepSetting& setting, int harmonics) {
  ChosenStep chosen = *chosen_;
  chosen.setting = setting;
  chosen.harmonics = harmonics;
  chosen.wished_nodes = wished;
  coarser.chosen_ = chosen;
  coarser.cut_signals();
  const bool is_cheaper = take_coarser(chosen, target_.performer, coarser.target_.performer, coarser.signals_);
  chosen_->curve.rows.push_back(chosen.curve.rows.back());
  if (!is_cheaper) return false;
  coarser.key_ = coarser.solved_key_;
  coarser.perform();
  if (is_down(coarser.performances_.main()) || strays(*chosen_, coarser.performances_.main())) return false;
  chosen_ = std::move(chosen);
  take_over(coarser);
  return true;
}

std::unique_ptr<Conversion> Conversion::on_coarser_mesh(const io::ImportedCharacter& imported, double wished_limit, int wished,
                                                        Stages& stages) {
  retarget::CreatureOptions settings = settings_;
  settings.nodes = wished;
  auto coarser = std::make_unique<Conversion>(options_, settings, stages, writer_);
  try {
    coarser->add_warnings(imported.warnings);
    coarser->solve(imported, wished_limit);
  } catch (const Error&) {
    return nullptr;
  }
  coarser->chosen_ = chosen_;
  coarser->whole_signals_ = coarser->signals_;
  coarser->cut_signals();
  return coarser;
}

void Conversion::take_over(Conversion& coarser) {
  settings_ = coarser.settings_;
  key_ = coarser.key_;
  solved_key_ = coarser.solved_key_;
  creature_ = std::move(coarser.creature_);
  motion_ = std::move(coarser.motion_);
  inverse_ = std::move(coarser.inverse_);
  target_ = std::move(coarser.target_);
  signals_ = std::move(coarser.signals_);
  whole_signals_ = std::move(coarser.whole_signals_);
  performances_ = std::move(coarser.performances_);
  target_file_ = std::move(coarser.target_file_);
  signals_text_ = std::move(coarser.signals_text_);
  is_performed_ = true;
}

void Conversion::tell_signals() {
  target_.report.signals = signals_report(signals_);
  target_.report.signals.error_rms_l0 = retarget::activation_error_rms(signals_, inverse_.activation.transpose());
  signals_text_ = io::signals_text(signals_);
  target_file_ = io::target_bytes(target_);
}

void Conversion::put_in_scene() {
  if (options_.scene.empty()) return;
  in_scene_ = target_.performer;
  add_warnings(io::put_in_scene(options_.scene, *in_scene_));
  solved_key_ = key_after(solved_key_, scene_text_);
  is_performed_ = false;
}

void Conversion::perform_within_error() {
  key_ = solved_key_;
  perform();
  const auto is_short_of_it = [&] {  // of the error as it was measured: outside a scene
    return is_down(performances_.main()) || (!in_scene_ && strays(*chosen_, performances_.main()));
  };
  const bool is_own_mesh = chosen_ && chosen_->wished_nodes == 0;  // others have been performed before they were taken
  while (is_own_mesh && is_short_of_it() && take_next(*chosen_, target_.performer, whole_signals_)) {
    add_warnings({chosen_->warnings.back()});
    signals_ = whole_signals_;
    tell_signals();
    key_ = solved_key_;
    perform();
  }
  is_performed_ = true;
}

void Conversion::let_go() {
  if (!is_performed_) perform_within_error();
  if (!choice_key_.empty()) stages_.cache().store("accuracy", choice_key_, record_of_choice(*chosen_));
  if (wants_polish(options_) && !is_down(performances_.main())) polish();
  add_warnings(retarget::feedback_warnings(performances_));
  if (chosen_) target_.report.accuracy = told(*chosen_);
  report_replays(performances_, target_.report);
  stages_.run("measurement", [&] {
    measure(performer(), signals_, perform_options(), target_.report);
    return 0;
  });
}

retarget::PerformOptions Conversion::perform_options() const {
  retarget::PerformOptions result;
  result.replay.method = settings_.method;
  if (chosen_) take_steps(result.replay, chosen_->setting);
  result.replay.duration_s = retarget::usual_duration(target_.performer.prepared.target);
  result.replay.corrector.effort *= performances_.effort;
  result.seed = options_.seed;
  result.threads = options_.threads;
  return result;
}

void Conversion::perform(const std::string& stage) {
  const retarget::PerformOptions options = perform_options();
  key_ = key_after(key_, signals_text_, physics::name_of(options.replay.method), std::int64_t{options_.seed});
  if (chosen_) key_ = key_after(key_, options.replay.step_s);
  performances_ = stages_.run(stage, key_, [&] { return retarget::perform_calmly(performer(), signals_, options); });
}

void Conversion::follow(const retarget::NominalPath& path) {
  target_.performer.path = path;
  if (in_scene_) in_scene_->path = path;
}

void Conversion::polish() {
  retarget::PerformOptions plan = perform_options();
  plan.seed = 0;
  key_ = key_after(key_, "polish");
  const retarget::Polished polished =
      stages_.run("polish", key_, [&] { return retarget::polish(target_.performer, signals_, plan); });  // outside a scene
  if (!polished.is_better()) return;
  const retarget::SignalSet solved = signals_;
  const retarget::Performances before = performances_;
  signals_.activation = polished.signals.activation;
  signals_.force = polished.signals.force;
  follow(polished.path);
  signals_text_ = io::signals_text(signals_);
  perform("polished_replay");
  if (is_down(performances_.main())) {
    signals_ = solved;
    performances_ = before;
    follow({});
    signals_text_ = io::signals_text(signals_);
    return;
  }
  performances_.effort *= before.effort;
  target_.report.polish = polish_report(polished.report.rounds, before, performances_);
}

void Conversion::write() {
  const retarget::Performer& performer = target_.performer;  // on its flat ground
  stages_.run("files", [&] {
    writer_.write("creature.toml", io::to_toml(creature_record(options_, performer, target_.report, chosen_, performances_.effort, settings_.nodes)));
    writer_.write("body.json", io::body_text(performer, creature_.character.skeleton.names,
                                             dominant_bones_of_nodes(creature_.mesh.bone_weights)));
    writer_.write("target.bin", target_file_);
    if (!performer.morphs.targets.empty()) writer_.write("morphs.bin", io::morphs_bytes(performer.morphs));
    if (!appearance_.parts.empty()) writer_.write("appearance.bin", io::appearance_bytes(appearance_));
    if (target_.report.polish) writer_.write("path.bin", io::path_bytes(target_));
    if (performer.wobble.is_on()) writer_.write("wobble.bin", io::wobble_bytes(performer.wobble));
    writer_.write("rig.bin", io::rig_bytes(rig()));
    writer_.write("signals.json", signals_text_);
    if (!scene_text_.empty()) writer_.write(io::kCreatureSceneFile, scene_text_);
    io::write_skinned_glb(writer_.directory() / "reference.glb",
                          {performer.skin.vertices, performer.skin.triangles, performer.embedding, &appearance_,
                           &performer.morphs},
                          performer.mesh, performer.scene.body.mass, performer.prepared.target, {});
    return 0;
  });
  target_.report.timing_s = stages_.timing_s;
  write_outcome(writer_, this->performer(), appearance_, signals_, performances_, target_.report, chosen_ ? &chosen_->curve : nullptr);
}

}  // namespace hydrostat::cli
