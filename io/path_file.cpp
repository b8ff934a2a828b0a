#include "io/path_file.h"

#include <cmath>

#include "io/packed_result.h"

namespace hydrostat::io {
namespace {

constexpr const char* kPathTitle = "hydrostat.path";
constexpr const char* kPathVersion = "1";

void name_motion(RecordArchive& archive, const std::string& name, retarget::Motion& motion) {
  archive.exchange(name + "/rate_hz", motion.rate_hz);
  archive.exchange(name + "/frames", motion.frames);
  archive.exchange(name + "/loop", motion.loop);
  archive.exchange(name + "/yaw", motion.yaw);
}

void name_spectrum(RecordArchive& archive, const std::string& name, signal::Spectrum& spectrum) {
  archive.exchange(name + "/cosine", spectrum.cosine);
  archive.exchange(name + "/sine", spectrum.sine);
  archive.exchange(name + "/cubic", spectrum.cubic);
}

void name_path(RecordArchive& archive, retarget::NominalPath& path, retarget::PolishReport& report) {
  name_motion(archive, "place", path.place);
  name_motion(archive, "velocity", path.velocity);
  archive.fields("rounds", report.rounds, "correction_before", report.correction_rms_before, "correction_after",
                 report.correction_rms_after, "open_loop_before", report.open_loop_s_before, "open_loop_after", report.open_loop_s_after);
}

struct ToldPath {
  retarget::NominalPath path;
  retarget::PolishReport report;
};
void name_told_path(RecordArchive& archive, ToldPath& told) { name_path(archive, told.path, told.report); }

void name_trials(RecordArchive& archive, const std::string& name, retarget::TrialsOutcome& trials) {
  archive.exchange(name + "/bodies", trials.bodies);
  archive.exchange(name + "/lost", trials.lost);
  archive.exchange(name + "/shape", trials.shape_rms_length);
}

void name_fields(RecordArchive& archive, retarget::Polished& polished) {
  name_path(archive, polished.path, polished.report);
  name_trials(archive, "solved_on_trials", polished.solved_on_trials);
  name_trials(archive, "polished_on_trials", polished.polished_on_trials);
  archive.exchange("is_frail", polished.is_frail);
  name_spectrum(archive, "activation", polished.signals.activation);
  name_spectrum(archive, "force", polished.signals.force);
}

bool is_sound(const retarget::Motion& offset, const retarget::Motion& target) {
  return offset.frames.rows() == target.frames.rows() && offset.count() > 0 && offset.loop == target.loop && offset.rate_hz > 0 &&
         offset.frames.allFinite() && std::isfinite(offset.yaw);
}

}  // namespace

template <>
Record record_of(const retarget::Polished& polished) {
  return record_by(name_fields, polished);
}

template <>
retarget::Polished result_of(const Record& record) {
  return value_by<retarget::Polished>(name_fields, record);
}

std::string path_bytes(const PerformedTarget& target) {
  return packed(record_by(name_told_path, ToldPath{target.performer.path, *target.report.polish}), kPathTitle, kPathVersion);
}

void parse_path(const std::string& bytes, const std::string& file, PerformedTarget& target) {
  ToldPath told = read_packed(bytes, file, kPathTitle, kPathVersion,
                              [](const Record& record) { return value_by<ToldPath>(name_told_path, record); });
  const retarget::Motion& motion = target.performer.prepared.target;
  if (!is_sound(told.path.place, motion) || !is_sound(told.path.velocity, motion)) throw not_of("target.bin", file);
  target.performer.path = std::move(told.path);
  target.report.polish = told.report;
}

}  // namespace hydrostat::io
