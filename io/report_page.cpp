#include "io/report_page.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>

#include "io/images.h"
#include "io/page_json.h"
#include "io/report.h"

namespace hydrostat::io {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kNodeRate = 60;  // [Hz]
constexpr std::size_t kMostImageBytes = std::size_t{16} << 20;
constexpr double kSkinRate = 30;  // [Hz]: vertices are many, and the view interpolates

/// Every frame's positions as 16-bit steps from that frame's own least corner, so that travel costs no precision. All frames
/// share the step [m].
Json quantised(const retarget::Motion& motion, Eigen::Index stride) {
  std::vector<float> corners;
  double extent = 0;
  for (Eigen::Index f = 0; f < motion.count(); f += stride) {
    const Eigen::Vector3d least = motion.at(f).rowwise().minCoeff(), most = motion.at(f).rowwise().maxCoeff();
    for (double part : least) corners.push_back(static_cast<float>(part));
    extent = std::max(extent, (most - least).maxCoeff());
  }
  const double step = extent > 0 ? extent / 65535 : 1;
  std::vector<std::uint16_t> steps;
  std::size_t corner = 0;
  for (Eigen::Index f = 0; f < motion.count(); f += stride, corner += 3) {
    const Eigen::Vector3d least = Eigen::Map<const Eigen::Vector3f>(&corners[corner]).cast<double>();
    for (double steps_away : ((motion.at(f).colwise() - least) / step).reshaped()) {
      steps.push_back(
          static_cast<std::uint16_t>(std::clamp(std::lround(steps_away), 0L, 65535L)));  // the float corner is rounded
    }
  }
  return {{"frames", corners.size() / 3}, {"step", step}, {"corners", packed(corners)}, {"steps", packed(steps)}};
}

Json morphs_json(const retarget::MovingMorphs& morphs) {
  Json json{{"targets", Json::array()},
            {"weights", packed_as<float>(morphs.weights)},
            {"frames", morphs.weights.cols()},
            {"rate_hz", morphs.rate_hz},
            {"loop", morphs.loop}};
  for (const retarget::MorphTarget& target : morphs.targets) {
    json["targets"].push_back({{"name", target.name},
                               {"vertices", packed_as<std::uint32_t>(target.vertices)},
                               {"offsets", packed_as<float>(target.offsets)}});
  }
  return json;
}

Json motion_json(const PageMotion& shown) {
  const retarget::Motion& motion = shown.motion;
  const double most = shown.of_skin ? kSkinRate : kNodeRate;
  const auto stride = std::max<Eigen::Index>(1, static_cast<Eigen::Index>(std::ceil(motion.rate_hz / most - 1e-6)));
  Json json = quantised(motion, stride);
  json["role"] = role_name(shown.role);
  json["of_skin"] = shown.of_skin;
  json["rate_hz"] = motion.rate_hz / static_cast<double>(stride);
  json["loop"] = motion.loop;
  json["duration_s"] = motion.duration_s();
  json["travel"] = {motion.travel.x(), motion.travel.y(), motion.travel.z()};
  json["yaw"] = motion.yaw;
  if (!shown.morphs.targets.empty()) json["morphs"] = morphs_json(shown.morphs);
  return json;
}

Json contact_json(const PageContactRow& row) {
  std::string states;
  for (retarget::ContactState state : row.states) {
    states += state == retarget::ContactState::kStick ? 'S' : state == retarget::ContactState::kSlide ? 'L' : '.';
  }
  return {
      {"patch", row.patch}, {"role", role_name(row.role)}, {"rate_hz", row.rate_hz}, {"loop", row.loop}, {"states", states}};
}

Json obstacle_json(const PageObstacle& obstacle) {
  return {{"vertices", packed_as<float>(obstacle.vertices)},
          {"triangles", packed_as<std::uint32_t>(obstacle.triangles)},
          {"is_endless", obstacle.is_endless},
          {"rate_hz", obstacle.travel.rate_hz},
          {"travel", packed_as<float>(obstacle.travel.frames)}};
}

Json map_json(const TextureMap& map) {
  return {{"image", map.image},       {"uv_set", map.uv_set},
          {"wrap", {map.wrap_u, map.wrap_v}}, {"filters", {map.magnify_filter, map.minify_filter}},
          {"strength", map.strength}, {"offset", {map.offset.x(), map.offset.y()}},
          {"scale", {map.scale.x(), map.scale.y()}}, {"turn", map.turn}};
}

Json material_json(const Material& material) {
  return {{"base_colour", std::vector<double>(material.base_colour.begin(), material.base_colour.end())},
          {"roughness", material.roughness},
          {"emissive", std::vector<double>(material.emissive.begin(), material.emissive.end())},
          {"alpha_mode", static_cast<int>(material.alpha_mode)},
          {"alpha_cutoff", material.alpha_cutoff},
          {"double_sided", material.double_sided},
          {"unlit", material.unlit},
          {"base_colour_map", map_json(material.base_colour_map)},
          {"normal_map", map_json(material.normal_map)},
          {"emissive_map", map_json(material.emissive_map)}};
}

/// Images as addresses that hold them; an empty one for those that no map of the page takes, or that are too large for it.
Json images_json(const Appearance& appearance) {
  std::vector<bool> shown(appearance.images.size(), false);
  for (const Material& material : appearance.materials) {
    for (const TextureMap* map : {&material.base_colour_map, &material.normal_map, &material.emissive_map}) {
      if (map->image >= 0) shown[static_cast<std::size_t>(map->image)] = true;
    }
  }
  Json images = Json::array();
  std::size_t total = 0;
  for (std::size_t i = 0; i < shown.size(); ++i) {
    const std::string& bytes = appearance.images[i].bytes;
    const bool fits = shown[i] && total + bytes.size() <= kMostImageBytes;
    total += fits ? bytes.size() : 0;
    images.push_back(fits ? "data:" + image_type(bytes) + ";base64," +
                                base64({reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()})
                          : "");
  }
  return images;
}

Json looks_json(const Appearance& appearance) {
  Json json{{"parts", Json::array()}, {"materials", Json::array()}, {"images", images_json(appearance)}};
  for (const Appearance::Part& part : appearance.parts) {
    Json told{{"material", part.material},
              {"vertices", packed_as<std::uint32_t>(part.vertices)},
              {"triangles", packed_as<std::uint32_t>(part.triangles)},
              {"normals", packed_as<float>(part.normals)},
              {"colours", packed_as<float>(part.colours)},
              {"uvs", Json::array()}};
    for (const Eigen::Matrix2Xd& uvs : part.uvs) told["uvs"].push_back(packed_as<float>(uvs));
    json["parts"].push_back(std::move(told));
  }
  for (const Material& material : appearance.materials) json["materials"].push_back(material_json(material));
  return json;
}

Json page_json(const PageInput& input) {
  Json json;
  json["schema"] = "hydrostat.page/1";
  json["report"] = Json::parse(report_json(input.report));
  json["ground_height"] = input.ground_height;
  json["has_ground"] = input.has_ground;
  json["ground_normal"] = {input.ground_normal.x(), input.ground_normal.y(), input.ground_normal.z()};
  json["obstacles"] = Json::array();
  for (const PageObstacle& obstacle : input.obstacles) json["obstacles"].push_back(obstacle_json(obstacle));
  json["skin"] = {{"triangles", packed_as<std::uint32_t>(input.skin.triangles)},
                  {"nodes", packed_as<std::uint32_t>(input.embedding.nodes)},
                  {"weights", packed_as<float>(input.embedding.weights)}};
  if (input.appearance != nullptr && !input.appearance->parts.empty()) json["looks"] = looks_json(*input.appearance);
  if (input.morphs != nullptr && !input.morphs->targets.empty()) json["morphs"] = morphs_json(*input.morphs);
  json["body"] = {{"nodes", packed_as<float>(input.body.nodes)}, {"edges", packed_as<std::uint32_t>(input.body.edges)}};
  json["motions"] = Json::array();
  for (const PageMotion& motion : input.motions) {
    assert(motion.motion.count() > 0);
    assert(motion.motion.frames.rows() == 3 * (motion.of_skin ? input.skin.vertices : input.body.nodes).cols());
    json["motions"].push_back(motion_json(motion));
  }
  json["charts"] = Json::array();
  for (const PageChart& chart : input.charts) json["charts"].push_back(chart_json(chart));
  json["contacts"] = Json::array();
  for (const PageContactRow& row : input.contacts) json["contacts"].push_back(contact_json(row));
  json["accuracy_svg"] = input.accuracy_svg;
  return json;
}

}  // namespace

void write_report_page(const std::filesystem::path& path, const PageInput& input) {
  write_viewer_page(path, page_json(input));
}

}  // namespace hydrostat::io
