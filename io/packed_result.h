#pragma once

#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "io/record_archive.h"
#include "retarget/error.h"

namespace hydrostat::io {

/// A value as a record: name(archive, value) names its fields.
template <typename Value, typename Name>
Record record_by(const Name& name, Value value) {  // a copy: the archive takes what it may also load
  Record record;
  RecordArchive archive = RecordArchive::saving_to(record);
  name(archive, value);
  return record;
}

/// The value of a record. Throws std::out_of_range where a field is missing.
template <typename Value, typename Name>
Value value_by(const Name& name, const Record& record) {
  Value value;
  RecordArchive archive = RecordArchive::loading_from(record);
  name(archive, value);
  return value;
}

constexpr const char* kMakeAgain = "Make the creature again with 'hydrostat convert'.";

/// read(record) of what is packed in the bytes of a creature's file. Throws Error for bytes that are damaged or of another version.
template <typename Read>
auto read_packed(const std::string& bytes, const std::string& file, const char* title, const char* version, const Read& read) {
  const Error damaged(file, "", "is damaged or of another version", kMakeAgain);
  const std::optional<Record> record = unpacked(bytes, title, version);
  if (!record) throw damaged;
  try {
    return read(*record);
  } catch (const std::out_of_range&) {
    throw damaged;
  }
}

/// Of a file that lies beside files of another creature.
inline Error not_of(const std::string& owner, const std::string& file) { return {file, "", "does not belong to " + owner, kMakeAgain}; }

}  // namespace hydrostat::io
