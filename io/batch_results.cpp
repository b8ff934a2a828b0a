#include "io/batch_results.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "io/write_file.h"
#include "retarget/error.h"

namespace hydrostat::io {

namespace fs = std::filesystem;

namespace {

constexpr const char* kBatchSchema = "hydrostat.batch/1";

std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (char letter : text) result += letter == '"' ? "\"\"" : std::string(1, letter);
  return result + '"';
}

BatchResult result_of(const nlohmann::ordered_json& entry) {
  BatchResult result;
  entry.at("name").get_to(result.name);
  entry.at("clip").get_to(result.clip);
  entry.at("out").get_to(result.out);
  entry.at("state").get_to(result.state);
  entry.at("exit_code").get_to(result.exit_code);
  entry.at("seconds").get_to(result.seconds);
  entry.at("message").get_to(result.message);
  entry.at("settings").get_to(result.settings);
  entry.at("report_sha256").get_to(result.report_sha256);
  entry.at("figures").get_to(result.figures);
  if (entry.contains("warnings")) entry.at("warnings").get_to(result.warnings);
  return result;
}

/// Null when there is none, or one that cannot be read.
nlohmann::json report_of(const fs::path& creature) {
  if (!fs::is_regular_file(creature / "report.json")) return {};
  const nlohmann::json report = nlohmann::json::parse(read_file(creature / "report.json"), nullptr, /*allow_exceptions=*/false);
  return report.is_object() ? report : nlohmann::json();
}

}  // namespace

const std::vector<std::string>& batch_figures() {
  static const std::vector<std::string> names{"cycles",
                                              "shape_rms_length",
                                              "clip_shape_rms_length",
                                              "drift_per_cycle_length",
                                              "heading_deg_per_cycle",
                                              "travel_per_cycle_length",
                                              "clip_travel_per_cycle_length",
                                              "slip_per_stance_length"};
  return names;
}

std::map<std::string, double> read_batch_figures(const fs::path& creature) {
  std::map<std::string, double> figures;
  const nlohmann::json report = report_of(creature);
  for (const std::string& name : batch_figures()) {
    const nlohmann::json::json_pointer place("/replay/closed_loop/" + name);
    if (report.contains(place) && report[place].is_number()) figures[name] = report[place];
  }
  return figures;
}

std::vector<std::string> read_batch_warnings(const fs::path& creature) {
  std::vector<std::string> warnings;
  const nlohmann::json report = report_of(creature);
  if (!report.contains("warnings")) return warnings;
  for (const nlohmann::json& warning : report["warnings"]) {
    if (warning.is_string()) warnings.push_back(warning);
  }
  return warnings;
}

std::string batch_results_csv(const std::vector<BatchResult>& results) {
  std::ostringstream out;
  out << "name,clip,out,state,exit_code,seconds";
  for (const std::string& figure : batch_figures()) out << "," << figure;
  out << ",warnings,message\r\n";
  for (const BatchResult& result : results) {
    out << quoted(result.name) << "," << quoted(result.clip) << "," << quoted(result.out) << "," << quoted(result.state)
        << "," << result.exit_code << "," << result.seconds;
    for (const std::string& figure : batch_figures()) {
      out << ",";
      if (result.figures.contains(figure)) out << result.figures.at(figure);
    }
    out << "," << result.warnings.size() << "," << quoted(result.message) << "\r\n";
  }
  return out.str();
}

std::string batch_results_json(const std::vector<BatchResult>& results) {
  nlohmann::ordered_json entries = nlohmann::ordered_json::array();
  for (const BatchResult& result : results) {
    entries.push_back({{"name", result.name},
                       {"clip", result.clip},
                       {"out", result.out},
                       {"state", result.state},
                       {"exit_code", result.exit_code},
                       {"seconds", result.seconds},
                       {"message", result.message},
                       {"settings", result.settings},
                       {"report_sha256", result.report_sha256},
                       {"figures", result.figures},
                       {"warnings", result.warnings}});
  }
  const auto failed = std::count_if(results.begin(), results.end(), [](const BatchResult& r) { return r.exit_code != 0; });
  const nlohmann::ordered_json root{{"schema", kBatchSchema}, {"jobs", results.size()}, {"failed", failed}, {"results", entries}};
  // A log may hold bytes that are no UTF-8; they become U+FFFD.
  return root.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

std::vector<BatchResult> read_batch_results(const fs::path& file) {
  std::vector<BatchResult> results;
  if (!fs::exists(file)) return results;
  try {
    const nlohmann::ordered_json root = nlohmann::ordered_json::parse(read_file(file));
    if (root.at("schema") != kBatchSchema) throw Error(file.string(), "schema", "is not " + std::string(kBatchSchema), "");
    for (const nlohmann::ordered_json& entry : root.at("results")) results.push_back(result_of(entry));
  } catch (const std::exception&) {
    throw Error(file.string(), "", "is not a results file of hydrostat batch", "Remove it, or run without --resume.");
  }
  return results;
}

}  // namespace hydrostat::io
