#include "cli/conversion_report.h"

#include <filesystem>

#include "io/fingerprint.h"
#include "io/load_creature.h"

namespace hydrostat::cli {

namespace fs = std::filesystem;

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
                                   const std::optional<ChosenStep>& chosen, const retarget::Feedback& feedback, const retarget::CreatureOptions& settings) {
  io::CreatureRecord record;
  record.source_file = fs::absolute(options.clip_file).string();
  record.source_sha256 = report.source.sha256;
  record.clip = report.source.clip;
  record.clip_rise_m = performer.clip_rise;
  record.settings = {{"height", options.height},
                     {"nodes", std::int64_t{settings.nodes}},
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
                     {"firmness", performer.prepared.firmness},
                     {"rest_lengths", std::string(settings.fitted_rest_lengths ? "fitted" : "usual")},
                     {"load", std::string(settings.spread_load ? "spread" : "usual")},
                     {"seed", std::int64_t{options.seed}}};
  for (std::size_t k = 0; k < options.import.meshes.size(); ++k) {  // TOML knows a key once
    record.settings.emplace_back(k == 0 ? "mesh" : "mesh-" + std::to_string(k + 1), options.import.meshes[k]);
  }
  if (!options.import.root.empty()) record.settings.emplace_back("root", options.import.root);
  if (!options.import.up.empty()) record.settings.emplace_back("up", options.import.up);
  if (options.import.metres_per_unit > 0) record.settings.emplace_back("unit", options.import.metres_per_unit);
  if (options.import.from_s > 0) record.settings.emplace_back("from", options.import.from_s);
  if (options.import.to_s) record.settings.emplace_back("to", *options.import.to_s);
  if (!options.scene.empty()) record.settings.emplace_back("scene", fs::absolute(options.scene).string());
  if (chosen) record.settings.emplace_back("step_s", chosen->setting.dt_s);
  io::put_feedback(feedback, record);
  io::put_exports(exports_of(options), record);
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

}  // namespace hydrostat::cli
