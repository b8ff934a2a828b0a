#include "io/page_data.h"

#include <cmath>
#include <cstdint>
#include <cstring>

#include "io/creature_directory.h"
#include "io/page_json.h"
#include "io/write_file.h"
#include "retarget/error.h"

namespace hydrostat::io {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kMendPage = "Make it again with 'hydrostat replay' ('simulate' for a scene).";

/// Numbers as packed_as() wrote them, `rows` of each column; at least one column.
template <typename Number, typename Derived>
bool unpack(const Json& text, Eigen::PlainObjectBase<Derived>& values, Eigen::Index rows) {
  const std::optional<std::string> bytes = from_base64(text.get_ref<const std::string&>());
  const auto column = static_cast<std::size_t>(rows) * sizeof(Number);
  if (!bytes || column == 0 || bytes->empty() || bytes->size() % column != 0) return false;
  std::vector<Number> numbers(bytes->size() / sizeof(Number));
  std::memcpy(numbers.data(), bytes->data(), bytes->size());
  using Scalar = typename Derived::Scalar;
  values.resize(rows, static_cast<Eigen::Index>(numbers.size()) / rows);
  for (std::size_t i = 0; i < numbers.size(); ++i) values.data()[i] = static_cast<Scalar>(numbers[i]);
  return true;
}

bool all_within(const Eigen::Ref<const Eigen::MatrixXi>& indices, Eigen::Index count) {
  return indices.minCoeff() >= 0 && indices.maxCoeff() < count;
}

/// Positions of `nodes` points, kept as steps from every frame's own corner.
bool read_motion(const Json& told, Eigen::Index nodes, retarget::Motion& motion) {
  Eigen::MatrixXd corners, steps;
  const double step = told.at("step").get<double>();
  motion.rate_hz = told.at("rate_hz").get<double>();
  if (!(motion.rate_hz > 0) || !(step > 0) || told.at("loop").get<bool>() || told.at("of_skin").get<bool>()) return false;
  if (!unpack<float>(told.at("corners"), corners, 3) || !unpack<std::uint16_t>(told.at("steps"), steps, 3 * nodes))
    return false;
  if (corners.cols() != steps.cols() || !corners.allFinite()) return false;
  motion.frames = step * steps + corners.replicate(nodes, 1);
  return motion.frames.allFinite();
}

/// The closed loop's motion, else the open loop's; none: their number.
std::size_t main_run(const Json& motions) {
  for (const char* role : {"replay", "open_loop"}) {
    for (std::size_t k = 0; k < motions.size(); ++k) {
      if (motions[k].at("role") == role) return k;
    }
  }
  return motions.size();
}

/// Whether the page is whole. Throws what the parser throws where a key is missing or of another type.
bool read_parts(PageData& page) {
  const Json& json = page.json;
  if (json.at("schema") != "hydrostat.page/1" || !json.at("report").is_object()) return false;
  Eigen::MatrixXd rest;
  const Json& skin = json.at("skin");
  if (!unpack<float>(json.at("body").at("nodes"), rest, 3) ||
      !unpack<std::uint32_t>(skin.at("nodes"), page.embedding.nodes, 4) ||
      !unpack<float>(skin.at("weights"), page.embedding.weights, 4) ||
      !unpack<std::uint32_t>(skin.at("triangles"), page.triangles, 3)) {
    return false;
  }
  const Eigen::Index vertices = page.embedding.nodes.cols();
  page.embedding.tets = Eigen::VectorXi::Constant(vertices, -1);  // a page does not tell them
  if (page.embedding.weights.cols() != vertices || !page.embedding.weights.allFinite()) return false;
  if (!all_within(page.embedding.nodes, rest.cols()) || !all_within(page.triangles, vertices)) return false;
  page.replay = main_run(json.at("motions"));
  return page.replay < json.at("motions").size() && read_motion(json["motions"][page.replay], rest.cols(), page.nodes);
}

}  // namespace

std::filesystem::path report_page_of(const std::filesystem::path& subject) {
  if (subject.extension() == ".html" && std::filesystem::is_regular_file(subject)) return subject;
  if (!is_creature(subject)) {
    throw Error(subject.string(), "", "is no creature and no report page",
                "Make one with 'hydrostat convert' or 'hydrostat simulate'.");
  }
  const std::filesystem::path page = subject / "report.html";
  if (!std::filesystem::is_regular_file(page)) throw Error(page.string(), "", "is missing", kMendPage);
  return page;
}

PageData read_page(const std::filesystem::path& file) {
  const std::string opening = "<script type=\"application/json\" id=\"data\">";
  const std::string text = read_file(file);
  const std::size_t begin = text.find(opening), end = begin == std::string::npos ? begin : text.find("</script>", begin);
  if (end == std::string::npos) throw Error(file.string(), "", "is no report page", kMendPage);
  PageData page;
  page.file = file;
  bool is_whole = false;
  try {
    page.json = Json::parse(text.begin() + static_cast<std::ptrdiff_t>(begin + opening.size()),
                            text.begin() + static_cast<std::ptrdiff_t>(end));
    is_whole = read_parts(page);
  } catch (const Json::exception&) {
    is_whole = false;
  }
  if (!is_whole) throw Error(file.string(), "", "is damaged or of another version", kMendPage);
  return page;
}

}  // namespace hydrostat::io
