#pragma once

#include "io/stage_cache.h"
#include "retarget/performance.h"

namespace hydrostat::io {

template <typename Result>
Record record_of(const Result& result);
template <typename Result>
Result result_of(const Record& record);
/// A Wobble as a record and back, to the bit, as io/stage_records.h has it for the other stages.
template <>
Record record_of(const retarget::Wobble& wobble);
template <>
retarget::Wobble result_of(const Record& record);

/// wobble.bin: how a creature's flesh swings, "hydrostat.wobble/1".
std::string wobble_bytes(const retarget::Wobble& wobble);
/// Throws Error for bytes that are damaged, of another version or about another body than `performer` has.
retarget::Wobble parse_wobble(const std::string& bytes, const std::string& file, const retarget::Performer& performer);

}  // namespace hydrostat::io
