#pragma once

#include <optional>
#include <string>

#include "io/scene.h"

namespace hydrostat::io {

constexpr double kShortestClip = 1e-3;  // [s]; below it a clip is a pose

/// The stretch of a clip that is played: first to last key of the channels that have more than one (FBX: within LocalStart
/// and LocalStop), and the rate of the densest channel. No such channel: all zero.
struct ClipRange {
  double start_s = 0, end_s = 0, key_rate_hz = 0;
  double length_s() const { return end_s - start_s; }
};
ClipRange range_of(const SceneClip& clip);

/// What of a range is played when it is cut at times [s] counted from its start; none: to its end. Throws Error with `path` and
/// `place` where a cut lies outside or less than a thousandth of a second is left.
ClipRange cut(const ClipRange& range, double from_s, std::optional<double> to_s, const std::string& path, const std::string& place);

/// Index of the clip that is meant by a name, an index as text or nothing (the first of non-zero length). Throws Error with
/// `path` for an unknown clip, one of zero length, one longer than an hour, and where there is none.
std::size_t choose_clip(const Scene& scene, const std::string& wanted, const std::string& path);

}  // namespace hydrostat::io
