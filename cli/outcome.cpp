#include "cli/outcome.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>

#include "cli/asked_accuracy.h"
#include "cli/command_line.h"
#include "io/creature_scene.h"
#include "io/gltf_out.h"
#include "io/performance_page.h"
#include "io/report.h"
#include "io/write_file.h"
#include "retarget/body_material.h"
#include "retarget/effects.h"
#include "retarget/run_warnings.h"
#include "retarget/wobble_plan.h"

namespace hydrostat::cli {

namespace {

constexpr double kAtLimit = 0.05;     // share of the constraints from which the limit is to blame
constexpr double kBeforeFall = 0.3;   // [s]

/// Of the constraints, the most at any time from shortly before the fall on.
double share_at_limit(const retarget::Replay& replay) {
  double most = 0;
  for (Eigen::Index k = 0; k < replay.course.time_s.size(); ++k) {
    if (replay.course.time_s[k] >= replay.report.fall_time_s - kBeforeFall) most = std::max(most, replay.course.saturated[k]);
  }
  return most;
}

}  // namespace

bool is_down(const retarget::Replay& replay) {
  return replay.report.fell || replay.termination == physics::Termination::kDiverged;
}

std::string change_of_conversion(const retarget::Replay& replay) {
  if (replay.termination == physics::Termination::kDiverged) return "--method euler or more --nodes";
  const double share = share_at_limit(replay);
  if (share < kAtLimit) return "more --nodes or a calmer clip";
  return "a higher --limit (" + std::to_string(std::lround(100 * share)) + " % of all constraints were at the present one), more --nodes or a calmer clip";
}

void report_replays(const retarget::Performances& performances, retarget::RunReport& report) {
  if (performances.naive) report.naive = performances.naive->report;
  if (performances.open_loop) report.open_loop = performances.open_loop->report;
  if (performances.closed_loop) report.closed_loop = performances.closed_loop->report;
  report.outcome_ok = !is_down(performances.main()) && report.accuracy.is_met();
}

namespace {

/// The picture of the curve; where nothing was chosen now, that of the choice before, which holds for the creature's own mesh.
std::string curve_picture(const io::CreatureWriter& writer, const retarget::RunReport& report, const io::AccuracyCurve* curve) {
  if (curve != nullptr) return io::accuracy_svg(*curve);
  const std::filesystem::path kept = writer.directory() / "accuracy.svg";
  return !report.level && std::filesystem::is_regular_file(kept) ? io::read_file(kept) : "";
}

}  // namespace

void write_outcome(io::CreatureWriter& writer, const retarget::Performer& performer, const io::Appearance& appearance,
                   const retarget::SignalSet& signals, const retarget::Performances& performances, const retarget::RunReport& report,
                   const io::AccuracyCurve* curve, const io::Exports& exports) {
  const retarget::Replay& run = performances.main();
  const bool down = !report.outcome_ok;
  const retarget::MovingMorphs wobble = retarget::wobble_morphs(performer, run.motion);
  const retarget::MovingMorphs worn = retarget::worn_with(performer.morphs, wobble);
  const io::EmbeddedSkin skin{performer.skin.vertices, performer.skin.triangles, performer.embedding, &appearance, &worn};
  const retarget::Motion motion = retarget::in_world(performer.world, run.motion, 0);
  const std::filesystem::path file = writer.directory() / (down ? "failed.glb" : "replay.glb");
  io::write_skinned_glb(file, skin, performer.mesh, performer.scene.body.mass, motion, {});
  writer.remove(down ? "replay.glb" : "failed.glb");
  for (const std::string& name : io::export_names("replay")) writer.remove(name);
  if (!down) io::write_exports(file, skin, performer.mesh, performer.scene.body.mass, motion, exports);
  writer.write("report.json", io::report_json(report));
  io::write_performance_page(writer.directory() / "report.html", performer, appearance, signals, performances, report,
                             curve_picture(writer, report, curve), wobble);
  if (curve != nullptr) write_curve(writer, *curve);
}

void note_warnings(Progress& progress, const std::vector<std::string>& warnings, const std::string& told_elsewhere) {
  for (const std::string& warning : warnings) {
    if (told_elsewhere.empty() || !warning.starts_with(told_elsewhere)) progress.note("warning: " + warning);
  }
}

retarget::SignalsReport signals_report(const retarget::SignalSet& signals) {
  retarget::SignalsReport report;
  report.kind = signals.kind() == signal::Kind::loop ? "loop" : "one_shot";
  report.period_s = signals.period_s;
  report.count = signals.count();
  report.harmonics = signals.activation.harmonics();
  return report;
}

void measure(const retarget::Performer& performer, const retarget::SignalSet& signals, const retarget::PerformOptions& options,
             retarget::RunReport& report) {
  const Eigen::Vector3d origin = io::scene_origin(performer);
  report.source.scene_origin_m = {origin.x(), origin.y(), origin.z()};
  report.effects = retarget::effects_of(performer, options.replay);
  report.accuracy.method = physics::name_of(options.replay.method);
  const auto& elements = performer.scene.body.elements;
  report.accuracy.element = !elements.empty() && elements.front().block.is_box() ? "hex" : "tet";
  report.accuracy.material =
      name_of(elements.empty() ? retarget::BodyMaterial::kSprings : retarget::material_of(elements.front().block.law));
  report.accuracy.dt_s = physics::make_stepper(options.replay.method, performer.scene)->substep(options.replay.step_s);
  if (report.accuracy.max_error_length == 0)  // otherwise it is known from the choice
    report.accuracy.estimated_error_length = retarget::substep_error(performer, signals, options.replay);
  if (options.seed == 0) return;
  const retarget::Variation variation = retarget::variation_of(options.seed);
  char text[200];
  std::snprintf(text, sizeof text, "--seed %u: the body that was let go has %.4f times the plan's mass, %.4f its friction, %.4f its stiffness",
                options.seed, variation.mass, variation.friction, variation.stiffness);
  report.warnings.emplace_back(text);
}

namespace {

/// How long the creature stays up, and how near to target and clip.
std::string summary(const retarget::ReplayReport& report, const std::string& where) {
  char text[300], drift[60] = "", assist[60] = "";
  if (!std::isnan(report.drift_per_cycle_length)) std::snprintf(drift, sizeof drift, ", drift %.2f %% L a cycle", 100 * report.drift_per_cycle_length);
  if (retarget::is_assisted(report)) std::snprintf(assist, sizeof assist, "; assisted from outside by up to %.2g mg", report.external_assist_mg);
  std::snprintf(text, sizeof text,
                ": up for %.2f s (%.3g cycles); shape %.2f %% L from the target, %.2f %% L from the clip; travel %.3f L a cycle "
                "(clip %.3f)%s%s; %.2fx real time",
                report.duration_s, report.cycles, 100 * report.shape_rms_length, 100 * report.clip_shape_rms_length,
                report.travel_per_cycle_length, report.clip_travel_per_cycle_length, drift, assist, report.real_time_factor);
  return where + text;
}

std::string failure(const retarget::Replay& run, const std::string& where, const std::string& motion_file, const std::string& way_up) {
  const bool diverged = run.termination == physics::Termination::kDiverged;
  return one_line({where, "replay", diverged ? run.report.fall_cause : "the creature fell: " + run.report.fall_cause,
                   motion_file + " shows it" + (way_up.empty() ? "" : "; " + way_up)});
}

}  // namespace

int tell_run(const retarget::Replay& run, const std::string& where, const std::string& motion_file, const std::string& way_up) {
  if (is_down(run)) {
    std::cerr << failure(run, where, motion_file, way_up) << std::endl;
    return kShortOfTarget;
  }
  std::cout << summary(run.report, where) << "\n";
  return kDone;
}

int tell_report(const retarget::Replay& run, const std::string& where, const std::string& motion_file,
                const retarget::RunReport& report, const std::string& way_up) {
  std::cout << io::report_json(report);
  if (is_down(run)) std::cerr << failure(run, where, motion_file, way_up) << std::endl;
  return is_down(run) ? kShortOfTarget : kDone;
}

}  // namespace hydrostat::cli
