#include "io/report.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "io/write_file.h"

namespace hydrostat::io {
namespace {

using Json = nlohmann::ordered_json;

/// Writes one group of figures and remembers which of them were no numbers.
class Group {
 public:
  Group(std::string name, std::vector<std::string>& warnings) : name_(std::move(name)), warnings_(warnings) {}

  void add(const char* key, double value) {
    if (std::isfinite(value)) {
      json_[key] = value;
    } else {
      json_[key] = nullptr;
      warnings_.push_back("report: " + name_ + "." + key + " is not a finite number; it is written as null.");
    }
  }
  /// A figure that not every run tells: what is no number is null, and nothing to warn of.
  void add_if_told(const char* key, double value) {
    if (std::isnan(value)) {
      add_nothing(key);
    } else {
      add(key, value);
    }
  }
  void add(const char* key, int value) { json_[key] = value; }
  void add(const char* key, bool value) { json_[key] = value; }
  void add(const char* key, const std::string& value) { json_[key] = value; }
  void add(const char* key, Json value) { json_[key] = std::move(value); }
  void add_nothing(const char* key) { json_[key] = nullptr; }

  Json take() { return std::move(json_); }

 private:
  std::string name_;
  std::vector<std::string>& warnings_;
  Json json_ = Json::object();
};

void fill(Group& group, const retarget::SourceReport& source) {
  group.add("file", source.file);
  group.add("sha256", source.sha256);
  group.add("clip", source.clip);
  group.add("duration_s", source.duration_s);
  group.add("rate_hz", source.rate_hz);
  group.add("scale", source.scale);
  group.add("root_motion", source.root_motion);
  if (source.scene_origin_m) group.add("scene_origin_m", Json(*source.scene_origin_m));
}

void fill(Group& group, const retarget::BodyReport& body) {
  group.add("nodes", body.nodes);
  group.add("elements", body.elements);
  group.add("constraints", body.constraints);
  group.add("vertices", body.vertices);
  group.add("mass_kg", body.mass_kg);
  group.add("length_m", body.length_m);
  group.add("size_m", body.size_m);
  group.add("youngs_modulus_pa", body.youngs_modulus_pa);
  group.add("pieces", body.pieces);
  group.add("bridged_cells", body.bridged_cells);
  group.add("copied_cells", body.copied_cells);
}

void fill(Group& group, const retarget::CouplingReport& coupling) {
  group.add("error_rms_length", coupling.error_rms_length);
  group.add("error_max_length", coupling.error_max_length);
}

void fill(Group& group, const retarget::PreparationReport& preparation) {
  group.add("smooth_shift_rms_length", preparation.smooth_shift_rms_length);
  group.add("foot_shift_rms_length", preparation.foot_shift_rms_length);
  group.add("volume_shift_rms_length", preparation.volume_shift_rms_length);
  group.add("momentum_shift_rms_length", preparation.momentum_shift_rms_length);
  group.add("total_shift_rms_length", preparation.total_shift_rms_length);
  group.add("missing_wrench_rms_mg", preparation.missing_wrench_rms_mg);
  group.add("missing_wrench_max_mg", preparation.missing_wrench_max_mg);
  group.add("flight_s", preparation.flight_s);
  group.add("min_jacobian", preparation.min_jacobian);
  group.add("volume_error_rms", preparation.volume_error_rms);
}

void fill(Group& group, const retarget::InverseReport& inverse) {
  group.add("miss_rms_length", inverse.miss_rms_length);
  group.add("root_residual_mg", inverse.root_residual_mg);
  group.add("kkt_residual", inverse.kkt_residual);
  group.add("saturated", inverse.saturated);
  group.add("max_strain", inverse.max_strain);
  group.add("p95_strain", inverse.p95_strain);
  group.add("limit", inverse.limit);
}

void fill(Group& group, const retarget::SignalsReport& signals) {
  group.add("kind", signals.kind);
  group.add("period_s", signals.period_s);
  group.add("count", signals.count);
  group.add("harmonics", signals.harmonics);
  group.add("error_rms_l0", signals.error_rms_l0);
}

void fill(Group& group, const retarget::ReplayReport& replay) {
  group.add("cycles", replay.cycles);
  group.add("duration_s", replay.duration_s);
  group.add("fell", replay.fell);
  if (replay.fell) {
    group.add("fall_time_s", replay.fall_time_s);
    group.add("fall_cause", replay.fall_cause);
  } else {
    group.add_nothing("fall_time_s");
    group.add_nothing("fall_cause");
  }
  group.add("shape_rms_length", replay.shape_rms_length);
  group.add("clip_shape_rms_length", replay.clip_shape_rms_length);
  group.add("world_rms_length", replay.world_rms_length);
  group.add_if_told("drift_per_cycle_length", replay.drift_per_cycle_length);
  group.add_if_told("heading_deg_per_cycle", replay.heading_deg_per_cycle);
  group.add("travel_per_cycle_length", replay.travel_per_cycle_length);
  group.add("clip_travel_per_cycle_length", replay.clip_travel_per_cycle_length);
  group.add("slip_per_stance_length", replay.slip_per_stance_length);
  group.add("held_slip_per_stance_length", replay.held_slip_per_stance_length);
  group.add("sole_gap_length", replay.sole_gap_length);
  group.add("penetration_max_size", replay.penetration_max_size);
  group.add("volume_error_max", replay.volume_error_max);
  group.add("momentum_residual_mg", replay.momentum_residual_mg);
  group.add("angular_residual_mgl", replay.angular_residual_mgl);
  group.add("external_assist_mg", replay.external_assist_mg);
  group.add("inverted_elements", replay.inverted_elements);
  group.add("guard_steps", replay.guard_steps);
  group.add("feedback_rms", replay.feedback_rms);
  group.add("correction_rms", replay.correction_rms);
  group.add("correction_buzz_rms", replay.correction_buzz_rms);
  group.add("style_range", replay.style_range);
  group.add("style_range_least", replay.style_range_least);
  group.add("real_time_factor", replay.real_time_factor);
  group.add("apex_rise_length", replay.apex_rise_length);
  group.add("clip_apex_rise_length", replay.clip_apex_rise_length);
}

void fill(Group& group, const retarget::SimulationReport& simulation) {
  group.add("dimension", simulation.dimension);
  group.add("duration_s", simulation.duration_s);
  group.add("diverged", simulation.diverged);
  if (simulation.diverged) {
    group.add("diverged_time_s", simulation.diverged_time_s);
    group.add("diverged_cause", simulation.diverged_cause);
  } else {
    group.add_nothing("diverged_time_s");
    group.add_nothing("diverged_cause");
  }
  group.add("energy_start_mgl", simulation.energy_start_mgl);
  group.add("energy_end_mgl", simulation.energy_end_mgl);
  group.add("work_mgl", simulation.work_mgl);
  group.add("energy_excess_mgl", simulation.energy_excess_mgl);
  group.add("momentum_residual_mg", simulation.momentum_residual_mg);
  group.add("angular_residual_mgl", simulation.angular_residual_mgl);
  group.add("external_assist_mg", simulation.external_assist_mg);
  group.add("volume_error_max", simulation.volume_error_max);
  group.add("volume_error_end", simulation.volume_error_end);
  group.add("penetration_max_size", simulation.penetration_max_size);
  group.add("self_penetration_max_size", simulation.self_penetration_max_size);
  group.add("inverted_elements", simulation.inverted_elements);
  group.add("inverted_elements_end", simulation.inverted_elements_end);
  group.add("guard_steps", simulation.guard_steps);
  group.add("travel_length", simulation.travel_length);
  group.add("speed_max_m_s", simulation.speed_max_m_s);
  group.add("speed_end_m_s", simulation.speed_end_m_s);
  group.add("ms_per_sim_s", simulation.ms_per_sim_s);
  group.add("real_time_factor", simulation.real_time_factor);
  Json fractures = Json::array();
  for (const retarget::BreakReport& one : simulation.fractures) {
    fractures.push_back({{"time_s", one.time_s}, {"seam", one.seam}, {"faces", one.faces}, {"pieces", one.pieces}});
  }
  group.add("fractures", std::move(fractures));
  group.add("pieces_end", simulation.pieces_end);
}

void fill(Group& group, const retarget::EffectReport& effect) {
  group.add("name", effect.name);
  group.add("state", effect.state);
  group.add("reason", effect.reason);
  group.add("ms_per_sim_s", effect.ms_per_sim_s);
}

void fill(Group& group, const retarget::LevelReport& level) {
  group.add("nodes", level.nodes);
  group.add("solved_nodes", level.solved_nodes);
  group.add("work_ms", level.work_ms);
  if (level.budget_ms > 0) group.add("budget_ms", level.budget_ms);
}

void fill(Group& group, const retarget::PolishReport& polish) {
  group.add("rounds", polish.rounds);
  group.add("correction_rms_before", polish.correction_rms_before);
  group.add("correction_rms_after", polish.correction_rms_after);
  group.add("open_loop_s_before", polish.open_loop_s_before);
  group.add("open_loop_s_after", polish.open_loop_s_after);
}

void fill(Group& group, const retarget::AccuracyReport& accuracy) {
  group.add("method", accuracy.method);
  group.add("element", accuracy.element);
  group.add("material", accuracy.material);
  group.add("dt_s", accuracy.dt_s);
  group.add("estimated_error_length", accuracy.estimated_error_length);
  if (accuracy.estimated_span_s > 0) {
    group.add("estimated_span_s", accuracy.estimated_span_s);
  } else {
    group.add_nothing("estimated_span_s");
  }
  if (accuracy.max_error_length > 0) {
    group.add("max_error_length", accuracy.max_error_length);
    group.add("work_saved", accuracy.work_saved);
    group.add("ms_per_sim_s", accuracy.ms_per_sim_s);
    group.add("finest_ms_per_sim_s", accuracy.finest_ms_per_sim_s);
  } else {
    group.add_nothing("max_error_length");
    group.add_nothing("work_saved");
    group.add_nothing("ms_per_sim_s");
    group.add_nothing("finest_ms_per_sim_s");
  }
}

void fill(Group& group, const std::vector<std::pair<std::string, double>>& timing_s) {
  double total = 0;
  for (const auto& [stage, seconds] : timing_s) {
    group.add(stage.c_str(), seconds);
    total += seconds;
  }
  group.add("total", total);
}

template <typename Figures>
Json group_json(const std::string& name, const Figures& figures, std::vector<std::string>& warnings) {
  Group group(name, warnings);
  fill(group, figures);
  return group.take();
}

Json replay_json(const std::string& name, const std::optional<retarget::ReplayReport>& replay,
                 std::vector<std::string>& warnings) {
  return replay ? group_json("replay." + name, *replay, warnings) : Json(nullptr);
}

}  // namespace

std::string report_json(const retarget::RunReport& report) {
  std::vector<std::string> warnings = report.warnings;
  Json json;
  json["schema"] = "hydrostat.report/1";
  json["outcome_ok"] = report.outcome_ok;
  json["source"] = group_json("source", report.source, warnings);
  json["body"] = group_json("body", report.body, warnings);
  if (report.simulation) {
    json["simulation"] = group_json("simulation", *report.simulation, warnings);
  } else {
    json["coupling"] = group_json("coupling", report.coupling, warnings);
    json["preparation"] = group_json("preparation", report.preparation, warnings);
    json["inverse"] = group_json("inverse", report.inverse, warnings);
    json["signals"] = group_json("signals", report.signals, warnings);
    json["replay"]["naive"] = replay_json("naive", report.naive, warnings);
    json["replay"]["open_loop"] = replay_json("open_loop", report.open_loop, warnings);
    json["replay"]["closed_loop"] = replay_json("closed_loop", report.closed_loop, warnings);
  }
  json["effects"] = Json::array();
  for (const retarget::EffectReport& effect : report.effects) {
    json["effects"].push_back(group_json("effects." + effect.name, effect, warnings));
  }
  json["accuracy"] = group_json("accuracy", report.accuracy, warnings);
  if (report.polish) json["polish"] = group_json("polish", *report.polish, warnings);
  if (report.level) json["level"] = group_json("level", *report.level, warnings);
  json["timing_s"] = group_json("timing_s", report.timing_s, warnings);
  json["warnings"] = warnings;
  // A name from a foreign file may hold bytes that are no UTF-8; they are shown as U+FFFD.
  return json.dump(2, ' ', /*ensure_ascii=*/false, Json::error_handler_t::replace) + "\n";
}

void write_report(const std::filesystem::path& path, const retarget::RunReport& report) {
  write_file(path, report_json(report));
}

}  // namespace hydrostat::io
