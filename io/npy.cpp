#include "io/npy.h"

#include <bit>
#include <cassert>
#include <cstring>
#include <functional>
#include <numeric>
#include <string>

#include "io/write_file.h"
#include "retarget/error.h"

namespace hydrostat::io {
namespace {

static_assert(std::endian::native == std::endian::little, "NumPy files are written as memory holds them");

constexpr std::string_view kNpyMagic{"\x93NUMPY\x01\x00", 8};
constexpr std::size_t kPreamble = 10;  // magic, version and the two bytes of the header's length
constexpr std::size_t kAlignment = 64;

template <typename Number>
constexpr const char* kType = "";
template <>
constexpr const char* kType<double> = "<f8";
template <>
constexpr const char* kType<int> = "<i4";

std::size_t product(const std::vector<std::size_t>& shape) {
  return std::accumulate(shape.begin(), shape.end(), std::size_t{1}, std::multiplies<>());
}

template <typename Number>
void write(const std::filesystem::path& path, const std::vector<std::size_t>& shape, std::span<const Number> values) {
  assert(product(shape) == values.size());
  std::string header = std::string("{'descr': '") + kType<Number> + "', 'fortran_order': False, 'shape': (";
  for (std::size_t extent : shape) header += std::to_string(extent) + ",";
  header += "), }";
  header.append(kAlignment - 1 - (kPreamble + header.size()) % kAlignment, ' ');
  header += '\n';
  std::string bytes(kNpyMagic);
  bytes += static_cast<char>(header.size() & 0xff);
  bytes += static_cast<char>(header.size() >> 8);
  bytes += header;
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
  write_file(path, bytes);
}

/// The part of the header's dictionary that follows `key`.
std::string_view entry(std::string_view header, std::string_view key) {
  const std::size_t at = header.find(key);
  return at == std::string_view::npos ? std::string_view{} : header.substr(at + key.size());
}

std::vector<std::size_t> read_shape(std::string_view text) {
  std::vector<std::size_t> shape;
  bool in_number = false;
  for (char c : text.substr(0, text.find(')'))) {
    const bool is_digit = c >= '0' && c <= '9';
    if (is_digit && !in_number) shape.push_back(0);
    if (is_digit) shape.back() = 10 * shape.back() + static_cast<std::size_t>(c - '0');
    in_number = is_digit;
  }
  return shape;
}

template <typename Number>
NpyArray<Number> read(const std::filesystem::path& path) {
  const auto refuse = [&](const std::string& what) {
    return Error(path.string(), "header", what, "Give a file that hydrostat's --trace wrote");
  };
  const std::string bytes = read_file(path);
  if (bytes.size() < kPreamble || bytes.compare(0, kNpyMagic.size(), kNpyMagic) != 0)
    throw refuse("not a NumPy file of format 1.0");
  const std::size_t header_size = static_cast<unsigned char>(bytes[8]) + 256u * static_cast<unsigned char>(bytes[9]);
  if (bytes.size() < kPreamble + header_size) throw refuse("the file ends inside its header");
  const std::string_view header = std::string_view(bytes).substr(kPreamble, header_size);
  if (!entry(header, "'descr': '").starts_with(kType<Number>))
    throw refuse("the numbers are not of type " + std::string(kType<Number>));
  if (!entry(header, "'fortran_order': ").starts_with("False")) throw refuse("the array is not in C order");

  NpyArray<Number> array{read_shape(entry(header, "'shape': (")), {}};
  const std::size_t body = bytes.size() - kPreamble - header_size;
  if (body != product(array.shape) * sizeof(Number))
    throw refuse("the file does not hold as many numbers as its shape says");
  array.values.resize(body / sizeof(Number));
  if (body > 0) std::memcpy(array.values.data(), bytes.data() + kPreamble + header_size, body);
  return array;
}

}  // namespace

void write_npy(const std::filesystem::path& path, const std::vector<std::size_t>& shape, std::span<const double> values) {
  write<double>(path, shape, values);
}
void write_npy(const std::filesystem::path& path, const std::vector<std::size_t>& shape, std::span<const int> values) {
  write<int>(path, shape, values);
}
NpyArray<double> read_npy_double(const std::filesystem::path& path) { return read<double>(path); }
NpyArray<int> read_npy_int(const std::filesystem::path& path) { return read<int>(path); }

}  // namespace hydrostat::io
