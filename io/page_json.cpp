#include "io/page_json.h"

#include <algorithm>
#include <array>
#include <cassert>

#include "io/viewer_bundle.h"
#include "io/write_file.h"

namespace hydrostat::io {

using Json = nlohmann::ordered_json;

namespace {

constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/// Text that may stand inside a script element: no '<', so that no name from a clip can end it.
std::string without_tags(const std::string& json) {
  std::string text;
  text.reserve(json.size());
  for (char c : json) {
    if (c == '<') {
      text += "\\u003c";
    } else {
      text += c;
    }
  }
  return text;
}

}  // namespace

std::string base64(std::span<const unsigned char> bytes) {
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t present = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) group = group << 8 | (k < present ? bytes[i + k] : 0u);
    for (std::size_t k = 0; k < 4; ++k) text += k <= present ? kDigits[group >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

std::optional<std::string> from_base64(std::string_view text) {
  if (text.size() % 4 != 0) return std::nullopt;
  std::array<int, 256> value;
  value.fill(-1);
  for (int k = 0; k < 64; ++k) value[static_cast<unsigned char>(kDigits[k])] = k;
  const std::size_t letters = text.find_last_not_of('=') + 1;  // 0 where there is none
  if (text.size() - letters > 2) return std::nullopt;
  std::string bytes;
  bytes.reserve(letters * 3 / 4);
  std::uint32_t bits = 0;
  int count = 0;
  for (const char letter : text.substr(0, letters)) {
    const int digit = value[static_cast<unsigned char>(letter)];
    if (digit < 0) return std::nullopt;
    bits = bits << 6 | static_cast<std::uint32_t>(digit);
    if ((count += 6) >= 8) bytes += static_cast<char>(bits >> (count -= 8) & 0xff);
  }
  return bytes;
}

const char* role_name(PageRole role) {
  switch (role) {
    case PageRole::kClip:
      return "clip";
    case PageRole::kTarget:
      return "target";
    case PageRole::kReplay:
      return "replay";
    case PageRole::kOpenLoop:
      return "open_loop";
    case PageRole::kNaive:
      return "naive";
    case PageRole::kOther:
      break;
  }
  return "other";
}

Json chart_json(const PageChart& chart) {
  Json json{{"title", chart.title}, {"x_label", chart.x_label}, {"y_label", chart.y_label}, {"over_time", chart.over_time}};
  json["curves"] = Json::array();
  for (const PageCurve& curve : chart.curves) {
    assert(curve.x.size() == curve.y.size());
    json["curves"].push_back({{"name", curve.name},
                              {"role", role_name(curve.role)},
                              {"x", packed_as<double>(curve.x)},
                              {"y", packed_as<float>(curve.y)}});
  }
  return json;
}

void write_viewer_page(const std::filesystem::path& path, const Json& data) {
  std::string page =
      "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<link rel=\"icon\" href=\"data:,\">\n<title>hydrostat</title>\n<style>";
  page += viewer_style();
  page += "</style>\n</head>\n<body>\n<script type=\"application/json\" id=\"data\">";
  page += without_tags(data.dump(-1, ' ', false, Json::error_handler_t::replace));
  page += "</script>\n<script>";
  page += viewer_script();
  page += "</script>\n</body>\n</html>\n";
  write_file(path, page);
}

}  // namespace hydrostat::io
