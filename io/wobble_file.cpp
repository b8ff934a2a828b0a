#include "io/wobble_file.h"

#include <stdexcept>

#include "io/record_archive.h"
#include "retarget/error.h"

namespace hydrostat::io {
namespace {

constexpr const char* kTitle = "hydrostat.wobble";
constexpr const char* kVersion = "1";

void name_fields(RecordArchive& archive, retarget::Wobble& wobble) {
  archive.fields("shapes", wobble.shapes, "frequency_hz", wobble.frequency_hz, "drive", wobble.drive, "mean_load", wobble.mean_load,
                 "most", wobble.most, "start", wobble.start, "reason", wobble.reason);
}

bool is_sound(const retarget::Wobble& wobble, const retarget::Performer& performer) {
  const Eigen::Index count = wobble.count();
  return wobble.shapes.rows() == performer.skin.vertices.size() && wobble.drive.rows() == performer.mesh.nodes.size() &&
         wobble.shapes.cols() == count && wobble.drive.cols() == count && wobble.mean_load.size() == count &&
         wobble.most.size() == count && wobble.start.rows() == count && wobble.shapes.allFinite() && wobble.drive.allFinite() &&
         wobble.mean_load.allFinite() && wobble.start.allFinite() && wobble.frequency_hz.allFinite() && wobble.most.allFinite() &&
         (wobble.frequency_hz.array() > 0).all() && (wobble.most.array() > 0).all();
}

}  // namespace

template <>
Record record_of(const retarget::Wobble& wobble) {
  Record record;
  RecordArchive archive = RecordArchive::saving_to(record);
  retarget::Wobble copy = wobble;  // the archive takes what it may also load
  name_fields(archive, copy);
  return record;
}

template <>
retarget::Wobble result_of(const Record& record) {
  retarget::Wobble wobble;
  RecordArchive archive = RecordArchive::loading_from(record);
  name_fields(archive, wobble);
  return wobble;
}

std::string wobble_bytes(const retarget::Wobble& wobble) { return packed(record_of(wobble), kTitle, kVersion); }

retarget::Wobble parse_wobble(const std::string& bytes, const std::string& file, const retarget::Performer& performer) {
  const char* const mend = "Make the creature again with 'hydrostat convert'.";
  const Error damaged(file, "", "is damaged or of another version", mend);
  const std::optional<Record> record = unpacked(bytes, kTitle, kVersion);
  if (!record) throw damaged;
  retarget::Wobble wobble;
  try {
    wobble = result_of<retarget::Wobble>(*record);
  } catch (const std::out_of_range&) {
    throw damaged;
  }
  if (!is_sound(wobble, performer)) throw Error(file, "", "does not belong to body.json", mend);
  return wobble;
}

}  // namespace hydrostat::io
