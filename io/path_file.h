#pragma once

#include "io/stage_records.h"
#include "retarget/polish.h"

namespace hydrostat::io {

/// What polish found, as a record and back, to the bit, as io/stage_records.h has it for the other stages. Of the signals the
/// coefficients alone are kept: the rest of them is as it was before.
template <>
Record record_of(const retarget::Polished& polished);
template <>
retarget::Polished result_of(const Record& record);

/// path.bin: where a creature is by its polished signals alone, and what polish made of them, "hydrostat.path/1".
std::string path_bytes(const PerformedTarget& target);
/// Puts both into `target`. Throws Error for bytes that are damaged, of another version or about another body than it has.
void parse_path(const std::string& bytes, const std::string& file, PerformedTarget& target);

}  // namespace hydrostat::io
