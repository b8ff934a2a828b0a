#include "io/comparison.h"

#include <algorithm>
#include <cmath>

#include "io/page_json.h"
#include "retarget/error.h"

namespace hydrostat::io {
namespace {

using Json = nlohmann::ordered_json;

/// What is compared of the reports: groups and names of report.json. "replay" is the main run, or a scene's simulation.
constexpr std::pair<const char*, const char*> kFigures[] = {{"body", "nodes"},
                                                            {"body", "elements"},
                                                            {"level", "solved_nodes"},
                                                            {"level", "work_ms"},
                                                            {"accuracy", "method"},
                                                            {"accuracy", "element"},
                                                            {"accuracy", "material"},
                                                            {"accuracy", "dt_s"},
                                                            {"signals", "harmonics"},
                                                            {"signals", "error_rms_l0"},
                                                            {"accuracy", "max_error_length"},
                                                            {"accuracy", "estimated_error_length"},
                                                            {"accuracy", "work_saved"},
                                                            {"timing_s", "total"},
                                                            {"replay", "real_time_factor"},
                                                            {"replay", "ms_per_sim_s"},
                                                            {"replay", "duration_s"},
                                                            {"replay", "cycles"},
                                                            {"replay", "fell"},
                                                            {"replay", "fall_time_s"},
                                                            {"replay", "fall_cause"},
                                                            {"replay", "diverged"},
                                                            {"replay", "diverged_cause"},
                                                            {"replay", "clip_shape_rms_length"},
                                                            {"replay", "shape_rms_length"},
                                                            {"replay", "world_rms_length"},
                                                            {"replay", "drift_per_cycle_length"},
                                                            {"replay", "heading_deg_per_cycle"},
                                                            {"replay", "travel_per_cycle_length"},
                                                            {"replay", "clip_travel_per_cycle_length"},
                                                            {"replay", "travel_length"},
                                                            {"replay", "slip_per_stance_length"},
                                                            {"replay", "sole_gap_length"},
                                                            {"replay", "penetration_max_size"},
                                                            {"replay", "volume_error_max"},
                                                            {"replay", "momentum_residual_mg"},
                                                            {"replay", "correction_rms"},
                                                            {"replay", "style_range"},
                                                            {"replay", "guard_steps"}};

/// A member of an object, or null where there is none.
const Json& member(const Json& object, const char* key) {
  static const Json kNothing;
  const auto found = object.is_object() ? object.find(key) : object.end();
  return object.is_object() && found != object.end() ? *found : kNothing;
}

Figure figure_of(const Json& value) {
  if (value.is_boolean()) return value.get<bool>();
  if (value.is_number()) return value.get<double>();
  if (value.is_string() && !value.get_ref<const std::string&>().empty()) return value.get<std::string>();
  return {};
}

/// The report's group of figures that tell of the main run.
const Json& run_figures(const Json& report) {
  if (report.contains("simulation")) return report.at("simulation");
  const Json& replay = member(report, "replay");
  const Json& closed_loop = member(replay, "closed_loop");
  return closed_loop.is_object() ? closed_loop : member(replay, "open_loop");
}

void read_figures(ComparedRun& run) {
  const Json& report = run.page.json.at("report");
  for (const auto& [group, key] : kFigures) {
    const Json& figures = group == std::string_view("replay") ? run_figures(report) : member(report, group);
    run.figures.emplace_back(std::string(group) + "." + key, figure_of(member(figures, key)));
  }
}

/// Takes out what no run has.
void drop_empty_figures(std::vector<ComparedRun>& runs) {
  for (std::size_t k = runs.front().figures.size(); k-- > 0;) {
    const auto is_empty = [k](const ComparedRun& run) {
      return std::holds_alternative<std::monostate>(run.figures[k].second);
    };
    if (!std::all_of(runs.begin(), runs.end(), is_empty)) continue;
    for (ComparedRun& run : runs) run.figures.erase(run.figures.begin() + static_cast<std::ptrdiff_t>(k));
  }
}

/// "out/trot" is 'trot' unless another run is so, too.
std::vector<std::string> names_of(const std::vector<std::string>& subjects) {
  std::vector<std::string> names;
  for (const std::string& subject : subjects) {
    std::filesystem::path path = std::filesystem::path(subject).lexically_normal();
    if (!path.has_filename()) path = path.parent_path();
    if (path.filename() == "report.html" && path.has_parent_path()) path = path.parent_path();
    names.push_back(path.filename().string());
  }
  for (std::size_t k = 0; k < subjects.size(); ++k) {
    if (std::count(names.begin(), names.end(), names[k]) == 1) continue;
    const std::string shared = names[k];
    for (std::size_t other = k; other < subjects.size(); ++other) {
      if (names[other] == shared) names[other] = subjects[other];
    }
  }
  return names;
}

std::string clip_of(const ComparedRun& run) {
  const Json& clip = member(member(run.page.json.at("report"), "source"), "clip");
  return clip.is_string() ? clip.get<std::string>() : "";
}

/// Why the skins of two runs cannot be held against each other; empty where they can.
std::string obstacle_between(const ComparedRun& first, const ComparedRun& other) {
  const auto quoted = [](const std::string& text) { return "'" + text + "'"; };
  if (clip_of(first) != clip_of(other))
    return "it plays another clip, " + quoted(clip_of(other)) + " and not " + quoted(clip_of(first));
  const Eigen::Index own = first.page.embedding.count(), others = other.page.embedding.count();
  if (own != others) return "its skin has " + std::to_string(others) + " vertices and not " + std::to_string(own);
  const Eigen::Matrix3Xi &a = first.page.triangles, &b = other.page.triangles;
  return a.cols() == b.cols() && a == b ? "" : "its skin has other triangles";
}

RunDistance distance_between(const ComparedRun& first, const ComparedRun& other) {
  RunDistance distance{obstacle_between(first, other), {}};
  if (distance.obstacle.empty()) {
    distance.course =
        retarget::skin_distance({first.page.nodes, first.page.embedding}, {other.page.nodes, other.page.embedding});
  }
  return distance;
}

Json figures_json(const ComparedRun& run) {
  Json json = Json::object();
  for (const auto& [name, figure] : run.figures) {
    std::visit(
        [&json, &name = name]<typename Value>(const Value& value) {
          if constexpr (std::is_same_v<Value, std::monostate>) {
            json[name] = nullptr;
          } else {
            json[name] = value;
          }
        },
        figure);
  }
  return json;
}

Json run_json(const ComparedRun& run) {
  const Json& report = run.page.json.at("report");
  Json source = Json::object();
  for (const char* key : {"file", "sha256", "clip"}) source[key] = member(member(report, "source"), key);
  return {{"name", run.name}, {"page", run.page.file.string()}, {"source", source}, {"figures", figures_json(run)}};
}

Json list(const Eigen::VectorXd& values, double factor = 1) {
  Json json = Json::array();
  for (const double value : values) json.push_back(factor * value);
  return json;
}

Json distance_json(const Comparison& comparison, std::size_t k) {
  const RunDistance& distance = comparison.distances[k];
  Json json{{"name", comparison.runs[k + 1].name}, {"comparable", distance.obstacle.empty()}};
  if (!distance.obstacle.empty()) {
    json["reason"] = distance.obstacle;
    return json;
  }
  const retarget::SkinDistance& course = distance.course;
  const DistanceSummary whole = summary_of(course.distance_m, course.time_s),
                        shape = summary_of(course.shape_m, course.time_s);
  json["duration_s"] = course.time_s[course.time_s.size() - 1];
  json["rms_length"] = whole.rms_m / comparison.length_m;
  json["most_length"] = whole.most_m / comparison.length_m;
  json["most_time_s"] = whole.most_time_s;
  json["shape_rms_length"] = shape.rms_m / comparison.length_m;
  json["time_s"] = list(course.time_s);
  json["distance_length"] = list(course.distance_m, 1 / comparison.length_m);
  json["shape_length"] = list(course.shape_m, 1 / comparison.length_m);
  return json;
}

Json as_json(const Comparison& comparison) {
  Json json{{"schema", "hydrostat.comparison/1"},
            {"length_m", comparison.length_m},
            {"runs", Json::array()},
            {"distances", Json::array()}};
  for (const ComparedRun& run : comparison.runs) json["runs"].push_back(run_json(run));
  for (std::size_t k = 0; k < comparison.distances.size(); ++k) json["distances"].push_back(distance_json(comparison, k));
  return json;
}

/// Distance and what of it is shape, a curve for each run that can be compared, in its run's colour.
Json distance_charts(const Comparison& comparison) {
  const std::string& first = comparison.runs.front().name;
  const std::pair<std::string, Eigen::VectorXd retarget::SkinDistance::*> kinds[] = {
      {"Distance of the skin from that of " + first, &retarget::SkinDistance::distance_m},
      {"The same without place and turn: shape alone", &retarget::SkinDistance::shape_m}};
  Json charts = Json::array();
  for (const auto& [title, values] : kinds) {
    PageChart chart{title, "time [s]", "RMS over the skin [% L]", true, {}};
    std::vector<std::size_t> ranks;
    for (std::size_t k = 0; k < comparison.distances.size(); ++k) {
      const RunDistance& distance = comparison.distances[k];
      if (!distance.obstacle.empty()) continue;
      chart.curves.push_back({comparison.runs[k + 1].name, PageRole::kOther, distance.course.time_s,
                              100 / comparison.length_m * distance.course.*values});
      ranks.push_back(k + 1);
    }
    if (ranks.empty()) return charts;
    charts.push_back(chart_json(chart));
    for (std::size_t c = 0; c < ranks.size(); ++c) charts.back()["curves"][c]["rank"] = ranks[c];
  }
  return charts;
}

/// The main run's curve in a diagram of its report; null where there is none.
Json curve_in(const ComparedRun& run, const Json& title) {
  const Json& role = run.page.json.at("motions").at(run.page.replay).at("role");
  for (const Json& chart : run.page.json.at("charts")) {
    if (chart.at("title") != title) continue;
    for (const Json& curve : chart.at("curves")) {
      if (curve.at("role") == role) return curve;
    }
  }
  return nullptr;
}

/// The diagrams that all reports have of their main run, with a curve for each run.
Json shared_charts(const std::vector<ComparedRun>& runs) {
  Json charts = Json::array();
  for (Json chart : runs.front().page.json.at("charts")) {
    Json curves = Json::array();
    for (const ComparedRun& run : runs) {
      Json curve = curve_in(run, chart.at("title"));
      if (curve.is_null()) break;
      curve["name"] = run.name;
      curve["role"] = "other";
      curves.push_back(std::move(curve));
    }
    if (curves.size() < runs.size()) continue;
    chart["curves"] = std::move(curves);
    charts.push_back(std::move(chart));
  }
  return charts;
}

/// Images that the page would fetch from elsewhere are left out: it needs no network.
void keep_own_images(Json& looks) {
  for (Json& image : looks.at("images")) {
    if (!image.is_string() || !image.get_ref<const std::string&>().starts_with("data:image/")) image = "";
  }
}

/// What the page's view wants to know of a run's body.
Json performer_json(const PageData& page) {
  Json json;
  for (const char* key : {"skin", "looks", "morphs", "body"}) {
    if (page.json.contains(key)) json[key] = page.json[key];
  }
  if (json.contains("looks")) keep_own_images(json["looks"]);
  return json;
}

Json page_json(const Comparison& comparison) {
  const Json& first = comparison.runs.front().page.json;
  Json json = performer_json(comparison.runs.front().page);
  for (const char* key : {"report", "ground_height", "has_ground", "ground_normal", "obstacles"}) json[key] = first.at(key);
  json["comparison"] = as_json(comparison);
  json["others"] = Json::array();
  json["motions"] = Json::array();
  for (std::size_t k = 0; k < comparison.runs.size(); ++k) {
    const ComparedRun& run = comparison.runs[k];
    if (k > 0) json["others"].push_back(performer_json(run.page));
    Json motion = run.page.json.at("motions").at(run.page.replay);
    motion["role"] = "replay";
    motion["performer"] = k;
    motion["name"] = run.name;
    json["motions"].push_back(std::move(motion));
  }
  json["charts"] = distance_charts(comparison);
  for (Json& chart : shared_charts(comparison.runs)) json["charts"].push_back(std::move(chart));
  json["contacts"] = Json::array();
  return json;
}

}  // namespace

Comparison compare_runs(const std::vector<std::string>& subjects) {
  Comparison comparison;
  const std::vector<std::string> names = names_of(subjects);
  for (std::size_t k = 0; k < subjects.size(); ++k) {
    comparison.runs.push_back({names[k], read_page(report_page_of(subjects[k])), {}});
    read_figures(comparison.runs.back());
  }
  drop_empty_figures(comparison.runs);
  const Figure length = figure_of(member(member(comparison.runs.front().page.json.at("report"), "body"), "length_m"));
  if (const double* metres = std::get_if<double>(&length); metres != nullptr && *metres > 0) comparison.length_m = *metres;
  for (std::size_t k = 1; k < comparison.runs.size(); ++k) {
    comparison.distances.push_back(distance_between(comparison.runs.front(), comparison.runs[k]));
  }
  return comparison;
}

DistanceSummary summary_of(const Eigen::VectorXd& distance, const Eigen::VectorXd& time_s) {
  DistanceSummary summary;
  if (distance.size() == 0) return summary;
  Eigen::Index at = 0;
  summary.rms_m = std::sqrt(distance.squaredNorm() / static_cast<double>(distance.size()));
  summary.most_m = distance.maxCoeff(&at);
  summary.most_time_s = time_s[at];
  return summary;
}

std::string comparison_json(const Comparison& comparison) {
  return as_json(comparison).dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

void write_comparison_page(const std::filesystem::path& path, const Comparison& comparison) {
  Json page;
  try {
    page = page_json(comparison);
  } catch (const Json::exception&) {
    throw Error(comparison.runs.front().page.file.string(), "", "or a page beside it is damaged or of another version",
                "Make them again with 'hydrostat replay' ('simulate' for a scene).");
  }
  write_viewer_page(path, page);
}

}  // namespace hydrostat::io
