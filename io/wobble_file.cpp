#include "io/wobble_file.h"

#include "io/packed_result.h"

namespace hydrostat::io {
namespace {

constexpr const char* kWobbleTitle = "hydrostat.wobble";
constexpr const char* kWobbleVersion = "1";

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
  return record_by(name_fields, wobble);
}

template <>
retarget::Wobble result_of(const Record& record) {
  return value_by<retarget::Wobble>(name_fields, record);
}

std::string wobble_bytes(const retarget::Wobble& wobble) { return packed(record_of(wobble), kWobbleTitle, kWobbleVersion); }

retarget::Wobble parse_wobble(const std::string& bytes, const std::string& file, const retarget::Performer& performer) {
  retarget::Wobble wobble = read_packed(bytes, file, kWobbleTitle, kWobbleVersion, result_of<retarget::Wobble>);
  if (!is_sound(wobble, performer)) throw not_of("body.json", file);
  return wobble;
}

}  // namespace hydrostat::io
