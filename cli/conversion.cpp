#include "cli/conversion.h"

#include <cstdio>
#include <filesystem>
#include <iostream>
#include <optional>

#include "cli/choice_record.h"
#include "cli/conversion_report.h"
#include "cli/make_performer.h"
#include "cli/outcome.h"
#include "cli/stage_key.h"
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
#include "retarget/flight.h"
#include "retarget/leaps.h"
#include "retarget/prepare_standing.h"
#include "retarget/rest_lengths.h"
#include "retarget/run_warnings.h"
#include "retarget/wobble_plan.h"

namespace hydrostat::cli {

namespace fs = std::filesystem;

namespace {

constexpr double kWorthFitting = 0.1;  // of the springs: fewer are not what fells a body

/// What the body depends on: this program and what was read, wherever its bytes lie (a glTF file may have them beside it).
std::string key_of(const io::ImportedCharacter& imported) {
  return key_after(io::file_sha256("/proc/self/exe"), io::packed(io::record_of(imported), "import", ""));
}

std::optional<io::CreatureRecord> record_in(const fs::path& creature) {
  try {
    return io::read_creature_record(creature);
  } catch (const Error&) {  // it is about to be replaced
    return std::nullopt;
  }
}

/// Whether what the creature was made of is the clip that is converted now, even if its file has changed since.
bool is_same_clip(const io::CreatureRecord& before, const retarget::SourceReport& source) {
  const auto place = [](const fs::path& file) { return fs::absolute(file).lexically_normal(); };
  return before.clip == source.clip && (before.source_sha256 == source.sha256 || place(before.source_file) == place(source.file));
}

/// Layers of the creature that is about to be replaced, where they are of the same clip; a sentence for each that does not fit any more,
/// and where the clip's file has changed or is another.
std::vector<std::string> keep_earlier_layers(const fs::path& creature, const retarget::SourceReport& source, retarget::SignalSet& signals) {
  const fs::path file = creature / "signals.json";
  if (!io::is_creature(creature) || !fs::exists(file)) return {};
  const retarget::SignalSet earlier = io::read_signals(file);
  if (earlier.layers.empty()) return {};
  const std::optional<io::CreatureRecord> before = record_in(creature);
  const std::string left_out = "layers: the signals' edits (" + std::to_string(earlier.layers.size()) + ") were left out, for ";
  if (!before) return {left_out + "creature.toml does not tell of which clip they are"};
  if (!is_same_clip(*before, source)) return {left_out + "they are of the clip '" + before->clip + "' of " + before->source_file};
  std::vector<std::string> told = retarget::keep_layers(earlier, signals);
  if (before->source_sha256 != source.sha256) {
    told.push_back("layers: " + source.file + " has changed since the signals were edited; 'hydrostat signals DIR layers' lists the edits, 'reset' drops them");
  }
  return told;
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
  if (options_.accuracy.is_asked()) {
    choose(imported, wished_limit);
  } else if (options_.scene.empty()) {
    stay_up(imported, wished_limit);
  }
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

void Conversion::stay_up(const io::ImportedCharacter& imported, double wished_limit) {
  perform_within_error();
  if (performances_.lapse != retarget::Lapse::kNothing) fit_rest_lengths(imported, wished_limit);
  if (is_down(performances_.main())) spread_load(imported, wished_limit);
}

void Conversion::try_by(const std::string& stage, const retarget::CreatureOptions& settings, const io::ImportedCharacter& imported,
                        double wished_limit, const std::function<std::string(const Conversion&)>& why_better) {
  stages_.run(stage, [&] {
    Progress silent(std::cerr, ProgressStyle::silent);
    Stages stages = stages_beside(stage, silent);
    const std::unique_ptr<Conversion> other = solved_by(settings, imported, wished_limit, stages);
    if (!other) return 0;
    other->perform();
    const std::string why = why_better(*other);
    if (why.empty()) return 0;
    take_over(*other);
    add_warnings({why});
    return 0;
  });
}

double Conversion::straying() const {
  return retarget::straying(target_.performer, perform_options().replay, performances_.main());
}

void Conversion::fit_rest_lengths(const io::ImportedCharacter& imported, double wished_limit) {
  const double share = retarget::share_overstrained(target_.performer.prepared.target, creature_.scene.body);
  if (share < kWorthFitting) return;
  retarget::CreatureOptions settings = settings_;
  settings.fitted_rest_lengths = true;
  try_by("rest_lengths", settings, imported, wished_limit, [&](const Conversion& fitted) -> std::string {
    if (!(fitted.straying() < retarget::kBetter * straying())) return "";
    char text[300];
    std::snprintf(text, sizeof text,
                  "the creature %s with the rest lengths of its bind pose, for the clip takes %.0f %% of its constraints more than %.0f %% from them: "
                  "these get the middle of their lengths in the clip, and it strays less than half as far",
                  retarget::in_words(performances_.lapse, performances_.main().report).c_str(), 100 * share, 100 * retarget::kMostSpringStrain);
    return text;
  });
}

void Conversion::spread_load(const io::ImportedCharacter& imported, double wished_limit) {
  retarget::CreatureOptions settings = settings_;
  settings.spread_load = true;
  try_by("spread_load", settings, imported, wished_limit, [&](const Conversion& spread) -> std::string {
    if (is_down(spread.performances_.main())) return "";
    char text[300];
    std::snprintf(text, sizeof text,
                  "the creature falls by the usual preparation, which moves the clip by %.1f %% L: it is moved by %.1f %% L, which spreads its load over "
                  "more of what bears it, and stays up",
                  100 * target_.report.preparation.total_shift_rms_length, 100 * spread.target_.report.preparation.total_shift_rms_length);
    return text;
  });
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
  key_ = key_after(key_, options_.friction, settings_.firmness, std::int64_t{settings_.spread_load});
  retarget::PreparedTarget prepared = stages_.run("preparation", key_, [&] { return prepared_target(creature_, motion_, settings_); });
  retarget::fit_body(prepared, creature_.scene.body);
  if (settings_.fitted_rest_lengths) retarget::fit_rest_lengths(prepared.target, creature_.scene.body);
  creature_.youngs_modulus *= prepared.stiffness;
  retarget::InverseOptions inverse_options;
  inverse_options.limit = wished_limit;
  inverse_options.threads = options_.threads;
  key_ = key_after(key_, wished_limit, std::int64_t{settings_.fitted_rest_lengths});
  inverse_ = stages_.run("inverse_dynamics", key_, [&] {
    const auto& solve = wished_limit > 0 ? retarget::solve_inverse_dynamics : retarget::solve_within_automatic_limit;
    return solve(prepared, scene, creature_.length, inverse_options);
  });
  add_warnings(prepared.warnings);
  warn_of_flights(prepared);
  add_warnings(retarget::target_warnings(prepared, scene.body, inverse_.report.limit, wished_limit == 0));
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
  add_warnings(keep_earlier_layers(options_.out, report.source, signals_));
  signals_text_ = io::signals_text(signals_);
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
  const retarget::PreparedTarget& plan = performer().prepared;
  const bool leaps_on = plan.target.loop && retarget::has_flight(plan);
  if (wants_polish(options_, leaps_on) && !is_down(performances_.main())) polish();
  add_warnings(retarget::feedback_warnings(performances_));
  add_warnings(retarget::motion_warnings(performances_.main().report));
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
  result.feedback = performances_.feedback;
  result.is_thorough = true;
  result.seed = options_.seed;
  result.threads = options_.threads;
  return result;
}

void Conversion::perform(const std::string& stage, const retarget::Feedback& feedback) {
  retarget::PerformOptions options = perform_options();
  options.feedback = feedback;
  key_ = key_after(key_, "bodies on trial", signals_text_, physics::name_of(options.replay.method), std::int64_t{options_.seed});
  if (chosen_) key_ = key_after(key_, options.replay.step_s);
  performances_ = stages_.run(stage, key_, [&] { return retarget::perform_steadily(performer(), signals_, options); });
}

void Conversion::follow(const retarget::NominalPath& path) {
  target_.performer.path = path;
  if (in_scene_) in_scene_->path = path;
}

void Conversion::polish() {
  retarget::PerformOptions plan = perform_options();
  plan.seed = 0;
  key_ = key_after(key_, "polish with trials, then drawn ones");
  const retarget::Polished polished =
      stages_.run("polish", key_, [&] { return retarget::polish(target_.performer, signals_, plan); });  // outside a scene
  add_warnings(retarget::polish_warnings(polished));
  if (!polished.is_better()) return;
  const retarget::SignalSet solved = signals_;
  const retarget::Performances before = performances_;
  signals_.activation = polished.signals.activation;
  signals_.force = polished.signals.force;
  follow(polished.path);
  signals_text_ = io::signals_text(signals_);
  perform("polished_replay", before.feedback);
  const auto lapses = retarget::polished_replay_warnings(before, performances_, !in_scene_ && options_.seed == 0);
  add_warnings(lapses);
  if (!lapses.empty()) {
    signals_ = solved;
    performances_ = before;
    follow({});
    signals_text_ = io::signals_text(signals_);
    return;
  }
  if (performances_.wished_lapse == retarget::Lapse::kNothing) {
    performances_.wished_lapse = before.wished_lapse;
    performances_.trials_lost = before.trials_lost;
  }
  target_.report.polish = polish_report(polished.report.rounds, before, performances_);
}

void Conversion::write() {
  const retarget::Performer& performer = target_.performer;  // on its flat ground
  stages_.run("files", [&] {
    writer_.write("creature.toml", io::to_toml(creature_record(options_, performer, target_.report, chosen_, performances_.feedback, settings_)));
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
  write_outcome(writer_, this->performer(), appearance_, signals_, performances_, target_.report, chosen_ ? &chosen_->curve : nullptr,
                exports_of(options_));
}

}  // namespace hydrostat::cli
