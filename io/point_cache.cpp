#include "io/point_cache.h"

#include <bit>
#include <cassert>
#include <cstdint>
#include <string>

#include "io/write_file.h"

namespace hydrostat::io {
namespace {

template <std::endian Order>
void put(std::string& bytes, std::uint32_t word) {
  for (int k = 0; k < 4; ++k) bytes += static_cast<char>(word >> (Order == std::endian::little ? 8 * k : 24 - 8 * k) & 0xff);
}

template <std::endian Order>
void put(std::string& bytes, float number) {
  put<Order>(bytes, std::bit_cast<std::uint32_t>(number));
}

/// What stands before the frames, and these, frame by frame.
template <std::endian Order>
void write(const std::filesystem::path& file, const std::string& head, const PointCourse& course) {
  std::string piece = head;
  Eigen::Index next = 0;
  const auto next_piece = [&]() -> std::string_view {
    if (next++ == 0) return piece;
    piece.clear();
    if (next > course.frames + 1) return piece;
    const Eigen::Matrix3Xd points = course.at(next - 2);
    assert(points.cols() == course.points);
    for (const double number : points.reshaped()) put<Order>(piece, static_cast<float>(number));
    return piece;
  };
  write_file(file, next_piece);
}

}  // namespace

void write_pc2(const std::filesystem::path& file, const PointCourse& course) {
  constexpr std::endian kLittle = std::endian::little;
  std::string head("POINTCACHE2\0", 12);
  put<kLittle>(head, std::uint32_t{1});  // version
  put<kLittle>(head, static_cast<std::uint32_t>(course.points));
  put<kLittle>(head, 0.0f);  // first frame
  put<kLittle>(head, 1.0f);  // frames a sample
  put<kLittle>(head, static_cast<std::uint32_t>(course.frames));
  write<kLittle>(file, head, course);
}

void write_mdd(const std::filesystem::path& file, const PointCourse& course) {
  constexpr std::endian kBig = std::endian::big;
  std::string head;
  put<kBig>(head, static_cast<std::uint32_t>(course.frames));
  put<kBig>(head, static_cast<std::uint32_t>(course.points));
  for (Eigen::Index f = 0; f < course.frames; ++f)
    put<kBig>(head, static_cast<float>(static_cast<double>(f) / course.rate_hz));
  write<kBig>(file, head, course);
}

}  // namespace hydrostat::io
