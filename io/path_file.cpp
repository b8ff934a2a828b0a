#include "io/path_file.h"

#include <cmath>
#include <stdexcept>

#include "io/record_archive.h"
#include "retarget/error.h"

namespace hydrostat::io {
namespace {

constexpr const char* kTitle = "hydrostat.path";
constexpr const char* kVersion = "1";

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

void name_fields(RecordArchive& archive, retarget::Polished& polished) {
  name_path(archive, polished.path, polished.report);
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
  Record record;
  RecordArchive archive = RecordArchive::saving_to(record);
  retarget::Polished copy = polished;  // the archive takes what it may also load
  name_fields(archive, copy);
  return record;
}

template <>
retarget::Polished result_of(const Record& record) {
  retarget::Polished polished;
  RecordArchive archive = RecordArchive::loading_from(record);
  name_fields(archive, polished);
  return polished;
}

std::string path_bytes(const PerformedTarget& target) {
  Record record;
  RecordArchive archive = RecordArchive::saving_to(record);
  retarget::NominalPath path = target.performer.path;
  retarget::PolishReport report = *target.report.polish;
  name_path(archive, path, report);
  return packed(record, kTitle, kVersion);
}

void parse_path(const std::string& bytes, const std::string& file, PerformedTarget& target) {
  const char* const mend = "Make the creature again with 'hydrostat convert'.";
  const Error damaged(file, "", "is damaged or of another version", mend);
  const std::optional<Record> record = unpacked(bytes, kTitle, kVersion);
  if (!record) throw damaged;
  retarget::NominalPath path;
  retarget::PolishReport report;
  try {
    RecordArchive archive = RecordArchive::loading_from(*record);
    name_path(archive, path, report);
  } catch (const std::out_of_range&) {
    throw damaged;
  }
  const retarget::Motion& motion = target.performer.prepared.target;
  if (!is_sound(path.place, motion) || !is_sound(path.velocity, motion)) throw Error(file, "", "does not belong to target.bin", mend);
  target.performer.path = std::move(path);
  target.report.polish = report;
}

}  // namespace hydrostat::io
