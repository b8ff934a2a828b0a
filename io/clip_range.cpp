#include "io/clip_range.h"

#include <algorithm>
#include <cstdio>
#include <limits>

#include "retarget/error.h"

namespace hydrostat::io {
namespace {

constexpr double kLongestClip = 3600;  // [s]

std::string list_clips(const Scene& scene) {
  std::string list;
  for (std::size_t c = 0; c < scene.clips.size(); ++c) {
    list += (c == 0 ? "" : ", ") + std::to_string(c) + " '" + scene.clips[c].name + "'";
  }
  return list;
}

std::string name_behind_armature(const std::string& name) { return name.substr(name.find('|') + 1); }

std::size_t find_clip(const Scene& scene, const std::string& wanted, const std::string& path) {
  const auto first_by = [&](auto&& matches) {
    return static_cast<std::size_t>(std::find_if(scene.clips.begin(), scene.clips.end(), matches) - scene.clips.begin());
  };
  const std::size_t count = scene.clips.size();
  if (wanted.empty()) {
    const std::size_t found = first_by([](const SceneClip& clip) { return range_of(clip).length_s() >= kShortestClip; });
    if (found < count) return found;
    throw Error(path, "clips", "all its clips have zero length", "Export an animated clip, baked to keys");
  }
  std::size_t found = first_by([&](const SceneClip& clip) { return clip.name == wanted; });
  if (found == count) found = first_by([&](const SceneClip& clip) { return name_behind_armature(clip.name) == wanted; });
  for (std::size_t c = 0; found == count && c < count; ++c) {
    if (std::to_string(c) == wanted) return c;
  }
  if (found < count) return found;
  throw Error(path, "clip '" + wanted + "'", "there is no such clip", "Choose one of: " + list_clips(scene));
}

}  // namespace

ClipRange range_of(const SceneClip& clip) {
  double first = std::numeric_limits<double>::infinity(), last = -first, rate = 0;
  const auto take_in = [&](const Track& track) {
    if (track.times.size() < 2) return;
    first = std::min(first, track.times.front());
    last = std::max(last, track.times.back());
    rate = std::max(rate, static_cast<double>(track.times.size() - 1) / (track.times.back() - track.times.front()));
  };
  for (const Channel& channel : clip.channels) {
    for (const Track* track : {&channel.translation, &channel.rotation, &channel.scale}) take_in(*track);
  }
  for (const MorphChannel& channel : clip.morphs) take_in(channel.weight);
  first = std::max(first, 0.0);
  if (clip.duration_s > 0) last = std::min(last, clip.duration_s);
  if (!(last > first)) return {};
  return {first, last, rate};
}

ClipRange cut(const ClipRange& range, double from_s, std::optional<double> to_s, const std::string& path, const std::string& place) {
  const double end_s = to_s.value_or(range.length_s());
  const double beyond = end_s - range.length_s();
  if (beyond > kShortestClip || end_s - from_s < kShortestClip) {
    const auto text = [](double time_s) {
      char digits[32];
      std::snprintf(digits, sizeof digits, "%.4g", time_s);
      return std::string(digits);
    };
    throw Error(path, place, "it cannot be cut from " + text(from_s) + " to " + text(end_s) + " s",
                "Give --from and --to within its " + text(range.length_s()) + " s, counted from its first key");
  }
  return {range.start_s + from_s, end_s < range.length_s() ? range.start_s + end_s : range.end_s, range.key_rate_hz};
}

std::size_t choose_clip(const Scene& scene, const std::string& wanted, const std::string& path) {
  if (scene.clips.empty()) throw Error(path, "clips", "it has no clip", "Export it with its animation, baked to keys");
  const std::size_t chosen = find_clip(scene, wanted, path);
  const std::string place =
      "clip '" + (scene.clips[chosen].name.empty() ? std::to_string(chosen) : scene.clips[chosen].name) + "'";
  const double length_s = range_of(scene.clips[chosen]).length_s();
  if (length_s < kShortestClip)
    throw Error(path, place, "it has zero length", "Choose one that moves, of: " + list_clips(scene));
  if (length_s > kLongestClip) throw Error(path, place, "it is longer than an hour", "Cut it and export it anew");
  return chosen;
}

}  // namespace hydrostat::io
