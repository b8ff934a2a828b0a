#include "io/report.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "retarget/error.h"

namespace hydrostat::io::report_test {
namespace {

using Json = nlohmann::json;

std::set<std::string> keys(const Json& group) {
  std::set<std::string> result;
  for (const auto& [key, value] : group.items()) result.insert(key);
  return result;
}

retarget::RunReport full_report() {
  retarget::RunReport report;
  report.naive = report.open_loop = report.closed_loop = retarget::ReplayReport{};
  report.effects.push_back({"gravity", "on", "always", 0.1});
  report.timing_s = {{"import", 0.25}, {"body", 0.5}};
  return report;
}

TEST(ReportJson, TellsOfACreatureWhereAScenesPlacesCountFrom) {
  retarget::RunReport report = full_report();
  EXPECT_FALSE(Json::parse(report_json(report)).at("source").contains("scene_origin_m"));
  report.source.scene_origin_m = {0.25, 0, -1};
  EXPECT_EQ(Json::parse(report_json(report)).at("source").at("scene_origin_m"), Json({0.25, 0.0, -1.0}));
}

TEST(ReportJson, HasEveryGroupAndNameOfTheContract) {
  const Json json = Json::parse(report_json(full_report()));
  EXPECT_EQ(json.at("schema"), "hydrostat.report/1");
  const std::vector<std::pair<std::string, std::vector<std::string>>> contract{
      {"/source", {"file", "sha256", "clip", "duration_s", "rate_hz", "scale", "root_motion"}},
      {"/body", {"nodes", "elements", "constraints", "vertices", "mass_kg", "length_m", "size_m", "youngs_modulus_pa"}},
      {"/coupling", {"error_rms_length"}},
      {"/preparation",
       {"smooth_shift_rms_length", "foot_shift_rms_length", "volume_shift_rms_length", "momentum_shift_rms_length",
        "missing_wrench_rms_mg", "missing_wrench_max_mg", "flight_s"}},
      {"/inverse",
       {"miss_rms_length", "root_residual_mg", "kkt_residual", "saturated", "max_strain", "p95_strain", "limit"}},
      {"/signals", {"kind", "period_s", "count", "harmonics", "error_rms_l0"}},
      {"/replay", {"naive", "open_loop", "closed_loop"}},
      {"/replay/closed_loop",
       {"cycles",
        "duration_s",
        "fell",
        "fall_time_s",
        "fall_cause",
        "shape_rms_length",
        "clip_shape_rms_length",
        "world_rms_length",
        "drift_per_cycle_length",
        "heading_deg_per_cycle",
        "travel_per_cycle_length",
        "clip_travel_per_cycle_length",
        "slip_per_stance_length",
        "held_slip_per_stance_length",
        "sole_gap_length",
        "penetration_max_size",
        "volume_error_max",
        "momentum_residual_mg",
        "angular_residual_mgl",
        "external_assist_mg",
        "inverted_elements",
        "guard_steps",
        "feedback_rms",
        "correction_rms",
        "correction_buzz_rms",
        "style_range",
        "style_range_least",
        "real_time_factor"}},
      {"/effects/0", {"name", "state", "reason", "ms_per_sim_s"}},
      {"/accuracy", {"method", "element", "material", "dt_s", "estimated_error_length"}},
      {"/timing_s", {"import", "body", "total"}},
  };
  for (const auto& [place, names] : contract) {
    const std::set<std::string> found = keys(json.at(Json::json_pointer(place)));
    for (const std::string& name : names) EXPECT_TRUE(found.contains(name)) << place << " lacks " << name;
  }
  EXPECT_EQ(keys(json.at("replay").at("naive")), keys(json.at("replay").at("closed_loop")));
  EXPECT_TRUE(json.at("warnings").is_array());
}

TEST(ReportJson, TellsTheFiguresAsTheyAre) {
  retarget::RunReport report = full_report();
  report.body.nodes = 211;
  report.inverse.miss_rms_length = 1.0 / 3;
  report.closed_loop->external_assist_mg = 0;
  report.closed_loop->shape_rms_length = 0.0123;
  report.source.clip = "trot \"fast\"";
  const Json json = Json::parse(report_json(report));
  EXPECT_EQ(json["body"]["nodes"], 211);
  EXPECT_EQ(json["inverse"]["miss_rms_length"].get<double>(), 1.0 / 3);
  EXPECT_EQ(json["replay"]["closed_loop"]["shape_rms_length"].get<double>(), 0.0123);
  EXPECT_EQ(json["source"]["clip"], "trot \"fast\"");
  EXPECT_EQ(json["timing_s"]["total"].get<double>(), 0.75);
}

TEST(ReportJson, TurnsWhatIsNoNumberIntoNullAndWarns) {
  retarget::RunReport report = full_report();
  report.warnings = {"the clip is short"};
  report.open_loop->shape_rms_length = std::numeric_limits<double>::quiet_NaN();
  report.inverse.kkt_residual = std::numeric_limits<double>::infinity();
  const Json json = Json::parse(report_json(report));
  EXPECT_TRUE(json["replay"]["open_loop"]["shape_rms_length"].is_null());
  EXPECT_TRUE(json["inverse"]["kkt_residual"].is_null());
  ASSERT_EQ(json["warnings"].size(), 3u);
  EXPECT_EQ(json["warnings"][0], "the clip is short");
  EXPECT_NE(json["warnings"][1].get<std::string>().find("inverse.kkt_residual"), std::string::npos);
  EXPECT_NE(json["warnings"][2].get<std::string>().find("replay.open_loop.shape_rms_length"), std::string::npos);
}

TEST(ReportJson, DriftAndHeadingThatCannotBeToldAreNullWithoutAWarning) {
  retarget::RunReport report = full_report();
  report.closed_loop->drift_per_cycle_length = report.closed_loop->heading_deg_per_cycle = std::numeric_limits<double>::quiet_NaN();
  const Json json = Json::parse(report_json(report)), run = json["replay"]["closed_loop"];
  EXPECT_TRUE(run.at("drift_per_cycle_length").is_null());
  EXPECT_TRUE(run.at("heading_deg_per_cycle").is_null());
  EXPECT_EQ(json["replay"]["naive"]["drift_per_cycle_length"], 0);
  EXPECT_EQ(json["warnings"].size(), 0U);
}

TEST(ReportJson, AFallHasTimeAndCauseAndNoFallHasNeither) {
  retarget::RunReport report = full_report();
  report.naive->fell = true;
  report.naive->fall_time_s = 1.5;
  report.naive->fall_cause = "tilt of 62 degrees";
  report.open_loop.reset();
  const Json replay = Json::parse(report_json(report))["replay"];
  EXPECT_EQ(replay["naive"]["fall_time_s"], 1.5);
  EXPECT_EQ(replay["naive"]["fall_cause"], "tilt of 62 degrees");
  EXPECT_TRUE(replay["closed_loop"]["fall_time_s"].is_null());
  EXPECT_TRUE(replay["closed_loop"]["fall_cause"].is_null());
  EXPECT_TRUE(replay["open_loop"].is_null());
}

TEST(ReportJson, ForeignBytesStayReadable) {
  retarget::RunReport report;
  report.source.clip = "\xff walk";
  EXPECT_EQ(Json::parse(report_json(report))["source"]["clip"], "\xEF\xBF\xBD walk");
}

TEST(WriteReport, APlaceThatCannotBeWrittenIsNamed) {
  const std::filesystem::path place = "/proc/absent/report.json";
  try {
    write_report(place, full_report());
    FAIL() << "no refusal";
  } catch (const Error& error) {
    EXPECT_EQ(error.file, place.string());
    EXPECT_FALSE(error.mend.empty());
  }
}

}  // namespace
}  // namespace hydrostat::io::report_test
