#pragma once

#include <filesystem>

#include "retarget/trace.h"

namespace hydrostat::io {

/// Writes the trace as a folder of NumPy files, one row per step: time (S), mass (N), position, velocity, contact_force,
/// effect_force, correction_impulse (S, N, 3), contact_moment, effect_moment (S, 3), activation (S, E), edges (E, 2),
/// rest_length (E), elements (T, 4; T, 3 in 2D). The folder is filled beside `folder` and renamed when whole; a trace that stood there
/// is replaced. Throws Error when the place cannot be written, or when something that is no trace (a folder without
/// time.npy) stands there.
void write_trace(const std::filesystem::path& folder, const retarget::Trace& trace);

/// Throws what write_trace would, before there is anything to write; leaves nothing behind.
void refuse_trace(const std::filesystem::path& folder);

}  // namespace hydrostat::io
