#include "cli/choice_record.h"

#include "io/record_archive.h"

namespace hydrostat::io {

// Found by the archive, whose namespace this is.

void name_fields(RecordArchive& archive, retarget::AccuracyRow& row) {
  archive.fields("method", row.method, "element", row.element, "material", row.material, "nodes", row.nodes, "dt", row.dt_s, "iterations", row.iterations,
                 "harmonics", row.harmonics, "error", row.error_rms_m, "error_length", row.error_rel_length, "ms_per_sim_s",
                 row.ms_per_sim_s, "work_ms", row.work_ms, "volume_error", row.volume_error, "momentum_error",
                 row.momentum_error, "angular_error", row.angular_error, "stable", row.stable, "falls", row.falls, "loop_error",
                 row.loop_error_m, "refused", row.is_refused);
}

void name_fields(RecordArchive& archive, AccuracyCurve& curve) {
  archive.fields("subject", curve.subject, "truth", curve.truth, "recommended", curve.recommended, "max_error",
                 curve.max_error, "floor", curve.floor, "counted", curve.is_counted);
  archive.list("rows", "row", curve.rows);
}

void name_fields(RecordArchive& archive, retarget::AccuracyReport& report) {
  archive.fields("method", report.method, "element", report.element, "material", report.material, "dt", report.dt_s,
                 "estimated_error", report.estimated_error_length, "span", report.estimated_span_s, "max_error", report.max_error_length, "work_saved",
                 report.work_saved, "ms_per_sim_s", report.ms_per_sim_s, "finest_ms_per_sim_s", report.finest_ms_per_sim_s);
}

void name_fields(RecordArchive& archive, cli::ChosenStep& chosen) {
  archive.fields("method", chosen.setting.method, "dt", chosen.setting.dt_s, "report", chosen.report, "curve", chosen.curve,
                 "harmonics", chosen.harmonics, "wished_nodes", chosen.wished_nodes, "warnings", chosen.warnings);
}

}  // namespace hydrostat::io

namespace hydrostat::cli {

io::Record record_of_choice(const ChosenStep& chosen) {
  io::Record record;
  io::RecordArchive archive = io::RecordArchive::saving_to(record);
  ChosenStep copy = chosen;  // the fields are named as those that loading writes to
  name_fields(archive, copy);
  return record;
}

ChosenStep choice_of(const io::Record& record) {
  ChosenStep chosen;
  io::RecordArchive archive = io::RecordArchive::loading_from(record);
  name_fields(archive, chosen);
  return chosen;
}

}  // namespace hydrostat::cli
