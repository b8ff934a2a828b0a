#pragma once

#include <Eigen/Core>
#include <bit>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

/// Point caches as other programs read them, byte by byte.
namespace hydrostat::io::point_cache_file {

struct PointCache {
  std::vector<float> times_s;  // of MDD alone
  std::vector<Eigen::Matrix3Xf> frames;
};

inline std::uint32_t word_at(const std::string& bytes, std::size_t at, bool is_little) {
  std::uint32_t word = 0;
  for (std::size_t k = 0; k < 4; ++k)
    word |= std::uint32_t{static_cast<unsigned char>(bytes.at(at + k))} << (is_little ? 8 * k : 24 - 8 * k);
  return word;
}

inline PointCache frames_from(const std::string& bytes, std::size_t at, std::size_t frames, std::size_t points,
                              bool is_little) {
  PointCache cache;
  if (bytes.size() != at + 12 * frames * points) throw std::runtime_error("the file is not as long as it says");
  for (std::size_t f = 0; f < frames; ++f) {
    Eigen::Matrix3Xf frame(3, static_cast<Eigen::Index>(points));
    for (float& number : frame.reshaped()) {
      number = std::bit_cast<float>(word_at(bytes, at, is_little));
      at += 4;
    }
    cache.frames.push_back(frame);
  }
  return cache;
}

inline PointCache parse_pc2(const std::string& bytes) {
  if (bytes.compare(0, 12, std::string("POINTCACHE2\0", 12)) != 0) throw std::runtime_error("no PC2");
  const auto word = [&](std::size_t at) { return word_at(bytes, at, true); };
  if (word(12) != 1 || std::bit_cast<float>(word(20)) != 0 || std::bit_cast<float>(word(24)) != 1)
    throw std::runtime_error("not version 1, from frame 0 on, a sample a frame");
  return frames_from(bytes, 32, word(28), word(16), true);
}

inline PointCache parse_mdd(const std::string& bytes) {
  const auto word = [&](std::size_t at) { return word_at(bytes, at, false); };
  const std::size_t frames = word(0);
  PointCache cache = frames_from(bytes, 8 + 4 * frames, frames, word(4), false);
  for (std::size_t f = 0; f < frames; ++f) cache.times_s.push_back(std::bit_cast<float>(word(8 + 4 * f)));
  return cache;
}

}  // namespace hydrostat::io::point_cache_file
