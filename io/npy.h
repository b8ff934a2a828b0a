#pragma once

#include <filesystem>
#include <span>
#include <vector>

namespace hydrostat::io {

/// A NumPy array: `values` in C order (last index fastest), as many as the product of `shape`.
template <typename Number>
struct NpyArray {
  std::vector<std::size_t> shape;
  std::vector<Number> values;
};

/// Writes a NumPy file, format 1.0, little-endian, C order: double as '<f8', int as '<i4'. `values` must be as many as the
/// product of `shape`. Throws Error when the file cannot be written.
/// Source: NumPy documentation, numpy.lib.format, "Format Version 1.0".
void write_npy(const std::filesystem::path& path, const std::vector<std::size_t>& shape, std::span<const double> values);
void write_npy(const std::filesystem::path& path, const std::vector<std::size_t>& shape, std::span<const int> values);

/// Reads what write_npy wrote (NumPy writes the same for such arrays). Throws Error for a file that is not one, is cut
/// short, has another type of number, or lies in Fortran order.
NpyArray<double> read_npy_double(const std::filesystem::path& path);
NpyArray<int> read_npy_int(const std::filesystem::path& path);

}  // namespace hydrostat::io
