#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "io/report_page.h"

namespace hydrostat::io {

/// Source: RFC 4648, section 4.
std::string base64(std::span<const unsigned char> bytes);
/// The bytes again; nothing where the text is no whole base64.
std::optional<std::string> from_base64(std::string_view text);

template <typename Number>
std::string packed(const std::vector<Number>& values) {
  return base64({reinterpret_cast<const unsigned char*>(values.data()), values.size() * sizeof(Number)});
}

/// Numbers column by column, as `Number`s of this machine's order of bytes (little-endian), in base64.
template <typename Number, typename Derived>
std::string packed_as(const Eigen::DenseBase<Derived>& values) {
  std::vector<Number> numbers;
  numbers.reserve(static_cast<std::size_t>(values.size()));
  for (Eigen::Index c = 0; c < values.cols(); ++c) {
    for (Eigen::Index r = 0; r < values.rows(); ++r) numbers.push_back(static_cast<Number>(values(r, c)));
  }
  return packed(numbers);
}

const char* role_name(PageRole role);
nlohmann::ordered_json chart_json(const PageChart& chart);

/// Writes a page of the viewer around its data. Throws Error when the file cannot be written.
void write_viewer_page(const std::filesystem::path& path, const nlohmann::ordered_json& data);

}  // namespace hydrostat::io
