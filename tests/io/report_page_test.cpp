#include "io/report_page.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>

#include "retarget/error.h"

namespace hydrostat::io::report_page_test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr int kCells = 6, kNodes = 4 * (kCells + 1);
constexpr double kRate = 60, kPeriod = 1;

/// A bar along x whose nodes are its skin's vertices too, on a lattice of 7 x 2 x 2:
///
///   2---6---10---         y
///   |   |   |             |
///   0---4---8---          z--x
struct WobblingBar {
  retarget::ControlMesh body;
  retarget::SkinnedMesh skin;
  retarget::Embedding embedding;
  retarget::RunReport report;

  WobblingBar() {
    body.nodes.resize(3, kNodes);
    for (int n = 0; n < kNodes; ++n) {
      body.nodes.col(n) << 0.16 * (n / 4), 0.2 * (n / 2 % 2), 0.2 * (n % 2);
    }
    skin.vertices = body.nodes;
    embedding.nodes = Eigen::Matrix4Xi::Zero(4, kNodes);
    embedding.weights = Eigen::Matrix4Xd::Zero(4, kNodes);
    embedding.nodes.row(0) = Eigen::RowVectorXi::LinSpaced(kNodes, 0, kNodes - 1);
    embedding.weights.row(0).setOnes();
    std::vector<Eigen::Vector3i> triangles{
        {0, 1, 3}, {0, 3, 2}, {kNodes - 4, kNodes - 1, kNodes - 3}, {kNodes - 4, kNodes - 2, kNodes - 1}};
    std::vector<Eigen::Vector2i> edges;
    const int ring[] = {0, 1, 3, 2, 0};
    for (int c = 0; c <= kCells; ++c) {
      for (int k = 0; k < 4; ++k) {
        const int a = 4 * c + ring[k], b = 4 * c + ring[k + 1];
        edges.emplace_back(std::min(a, b), std::max(a, b));
        if (c == kCells) continue;
        edges.emplace_back(a, a + 4);
        triangles.emplace_back(a, a + 4, b);
        triangles.emplace_back(b, a + 4, b + 4);
      }
    }
    skin.triangles.resize(3, static_cast<Eigen::Index>(triangles.size()));
    body.edges.resize(2, static_cast<Eigen::Index>(edges.size()));
    for (std::size_t t = 0; t < triangles.size(); ++t) skin.triangles.col(static_cast<Eigen::Index>(t)) = triangles[t];
    for (std::size_t e = 0; e < edges.size(); ++e) body.edges.col(static_cast<Eigen::Index>(e)) = edges[e];
    fill_report();
  }

  void fill_report() {
    report.source = {
        "bar_wobble.glb", "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef", "wobble", "auto", 1.0, 24, 1};
    report.body.nodes = kNodes;
    report.body.constraints = static_cast<int>(body.edges.cols());
    report.body.mass_kg = 38.4;
    report.body.length_m = 0.96;
    report.body.size_m = 0.34;
    report.body.youngs_modulus_pa = 1.9e6;
    report.signals = {"loop", kPeriod, 0.0021, 48, 8};
    retarget::ReplayReport replay;
    replay.cycles = 5;
    replay.duration_s = 5;
    replay.shape_rms_length = 0.0123;
    replay.travel_per_cycle_length = 0.31;
    replay.momentum_residual_mg = 3.2e-9;
    replay.real_time_factor = 2.4;
    report.closed_loop = report.open_loop = replay;
    report.open_loop->shape_rms_length = 0.051;
    replay.fell = true;
    replay.fall_time_s = 1.4;
    replay.fall_cause = "tilt of 61 degrees beyond the target's at 'LeftFoot'";
    replay.shape_rms_length = 0.22;
    report.naive = replay;
    report.effects = {{"gravity", "on", "always", 0.02},
                      {"self_contact", "off", "no two far regions come within two cells", 0}};
    report.accuracy = {"explicit", "tet", "springs", 1e-4, 0.002};
    report.timing_s = {{"import", 0.3}, {"body", 0.8}, {"prepare", 3.1}, {"invert", 12.5}, {"replay", 4.4}};
    report.warnings = {"the clip closes only to 0.4 % L; the rest was spread over the period"};
  }

  /// The bar's nodes at time t: a wave runs along it while it crawls and turns; `lag` bends it more.
  Eigen::Matrix3Xd nodes_at(double t, double lag) const {
    Eigen::Matrix3Xd nodes = body.nodes;
    for (int n = 0; n < kNodes; ++n) {
      const double wave = 2 * std::numbers::pi * (t / kPeriod - nodes(0, n));
      nodes(1, n) += 0.05 * (1 + std::sin(wave)) + lag * 0.02 * std::sin(3 * wave);
      nodes(0, n) += 0.3 * t / kPeriod - lag * 0.02 * t;
      nodes(2, n) += lag * 0.03 * t;
    }
    return nodes;
  }

  retarget::Motion motion(int frames, double rate, double lag) const {
    retarget::Motion motion;
    motion.rate_hz = rate;
    motion.frames.resize(3 * kNodes, frames);
    for (int f = 0; f < frames; ++f) motion.at(f) = nodes_at(f / rate, lag);
    return motion;
  }

  PageInput page() const {
    PageInput input{report, skin, embedding, body, {}, {}, {}, 0};
    retarget::Motion loop = motion(static_cast<int>(kRate * kPeriod), kRate, 0);
    loop.loop = true;
    loop.travel = {0.3, 0, 0};
    input.motions = {{PageRole::kClip, true, loop},
                     {PageRole::kTarget, false, loop},
                     {PageRole::kReplay, false, motion(601, 120, 1)},
                     {PageRole::kNaive, false, motion(301, 120, 5)}};
    const Eigen::VectorXd time = Eigen::VectorXd::LinSpaced(301, 0, 5);
    const Eigen::VectorXd height = 0.15 + 0.05 * (6 * time.array()).sin();
    Eigen::VectorXd broken = height.array() + 0.01 * time.array();
    broken.segment(100, 20).setConstant(std::numeric_limits<double>::quiet_NaN());
    const Eigen::VectorXd x = 0.3 * time, z = 0.05 * (2 * time.array()).cos();
    input.charts = {
        {"COM path",
         "x [m]",
         "z [m]",
         false,
         {{"target", PageRole::kTarget, x, 0 * z}, {"replay", PageRole::kReplay, 0.95 * x, z}}},
        {"Height of the COM",
         "time [s]",
         "height [m]",
         true,
         {{"target", PageRole::kTarget, time, height}, {"replay", PageRole::kReplay, time.array() + 0.001, broken}}},
        {"Activations", "time [s]", "[-]", true, {}}};
    for (int muscle = 0; muscle < 9; ++muscle) {
      input.charts.back().curves.push_back(
          {"muscle " + std::to_string(muscle), PageRole::kOther, time, 1 + 0.1 * (6 * time.array() + muscle).sin()});
    }
    for (const char* patch : {"left fore foot", "right fore foot", "belly"}) {
      std::vector<retarget::ContactState> states(60, retarget::ContactState::kOff);
      std::fill_n(states.begin() + 5, 25, retarget::ContactState::kStick);
      std::fill_n(states.begin() + 30, 10, retarget::ContactState::kSlide);
      input.contacts.push_back({patch, PageRole::kTarget, kRate, true, states});
      std::vector<retarget::ContactState> replayed;
      for (int k = 0; k < 5; ++k) replayed.insert(replayed.end(), states.begin(), states.end());
      replayed.insert(replayed.begin(), 3, retarget::ContactState::kOff);
      input.contacts.push_back({patch, PageRole::kReplay, kRate, false, replayed});
    }
    return input;
  }
};

std::string write_and_read(const PageInput& input, const std::string& name) {
  const fs::path path = fs::path(testing::TempDir()) / ("hydrostat_" + name + ".html");
  write_report_page(path, input);
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

Json data_of(const std::string& page) {
  const std::string opening = "id=\"data\">";
  const std::size_t begin = page.find(opening) + opening.size();
  return Json::parse(page.substr(begin, page.find("</script>", begin) - begin));
}

template <typename Number>
std::vector<Number> unpacked(const std::string& base64) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  std::uint32_t bits = 0;
  int count = 0;
  for (char c : base64.substr(0, base64.find('='))) {
    bits = bits << 6 | static_cast<std::uint32_t>(digits.find(c));
    if ((count += 6) >= 8) bytes += static_cast<char>(bits >> (count -= 8) & 0xff);
  }
  std::vector<Number> values(bytes.size() / sizeof(Number));
  std::memcpy(values.data(), bytes.data(), values.size() * sizeof(Number));
  return values;
}

TEST(ReportPage, ShowsTheMotionsToAHairsBreadth) {
  const WobblingBar bar;
  const Json data = data_of(write_and_read(bar.page(), "page_motion"));
  for (const Json& motion : data.at("motions")) {
    SCOPED_TRACE(motion.at("role"));
    const double lag = motion["role"] == "replay" ? 1 : motion["role"] == "naive" ? 5 : 0;
    const std::vector<float> corners = unpacked<float>(motion["corners"]);
    const std::vector<std::uint16_t> steps = unpacked<std::uint16_t>(motion["steps"]);
    const auto frames = motion["frames"].get<std::size_t>();
    ASSERT_EQ(steps.size(), frames * 3 * kNodes);
    double worst = 0;
    for (std::size_t f = 0; f < frames; ++f) {
      const Eigen::Matrix3Xd expected = bar.nodes_at(static_cast<double>(f) / motion["rate_hz"].get<double>(), lag);
      for (std::size_t i = 0; i < 3 * kNodes; ++i) {
        const double shown = corners[3 * f + i % 3] + motion["step"].get<double>() * steps[f * 3 * kNodes + i];
        worst = std::max(worst, std::abs(shown - expected.reshaped()(static_cast<Eigen::Index>(i))));
      }
    }
    EXPECT_LT(worst, 2e-5);  // [m]: half a step of a metre's 65535th, and float
  }
}

TEST(ReportPage, ThinsMotionsAndKeepsTheirLength) {
  const Json data = data_of(write_and_read(WobblingBar().page(), "page_rates"));
  const Json& motions = data.at("motions");
  EXPECT_EQ(motions[0]["rate_hz"], 30);
  EXPECT_EQ(motions[1]["rate_hz"], 60);
  EXPECT_EQ(motions[2]["rate_hz"], 60);
  EXPECT_EQ(motions[0]["duration_s"], kPeriod);
  EXPECT_EQ(motions[2]["duration_s"], 5);
}

TEST(ReportPage, CarriesCurvesAndContactsUnchanged) {
  const WobblingBar bar;
  const PageInput input = bar.page();
  const Json data = data_of(write_and_read(input, "page_curves"));
  const Json& curve = data.at("charts")[1].at("curves")[1];
  const std::vector<double> x = unpacked<double>(curve.at("x"));
  const std::vector<float> y = unpacked<float>(curve.at("y"));
  const PageCurve& given = input.charts[1].curves[1];
  ASSERT_EQ(x.size(), static_cast<std::size_t>(given.x.size()));
  for (std::size_t i = 0; i < x.size(); ++i) {
    EXPECT_EQ(x[i], given.x[static_cast<Eigen::Index>(i)]);
    if (i >= 100 && i < 120) {
      EXPECT_TRUE(std::isnan(y[i]));
    } else {
      EXPECT_FLOAT_EQ(y[i], static_cast<float>(given.y[static_cast<Eigen::Index>(i)]));
    }
  }
  EXPECT_EQ(data["contacts"][0]["states"].get<std::string>().substr(3, 4), "..SS");
  EXPECT_EQ(data["contacts"][0]["states"].get<std::string>().substr(28, 4), "SSLL");
}

TEST(ReportPage, NeedsNothingFromOutside) {
  const std::string page = write_and_read(WobblingBar().page(), "page_alone");
  for (const char* outside : {"src=\"http", "href=\"http", "@import", "src=\"//", "<script src", "<link rel=\"stylesheet"}) {
    EXPECT_EQ(page.find(outside), std::string::npos) << outside;
  }
  EXPECT_NE(page.find("WebGLRenderer"), std::string::npos);
}

TEST(ReportPage, ANameFromAClipCannotEndItsScript) {
  WobblingBar bar;
  bar.report.source.clip = "</script><script>alert(1)</script>";
  const std::string page = write_and_read(bar.page(), "page_name");
  EXPECT_EQ(page.find("alert(1)</script>"), std::string::npos);
  EXPECT_EQ(data_of(page).at("report").at("source").at("clip"), bar.report.source.clip);
}

TEST(ReportPage, AFallStandsInItsData) {
  WobblingBar bar;
  bar.report.closed_loop = bar.report.naive;
  bar.report.outcome_ok = false;
  const Json report = data_of(write_and_read(bar.page(), "page_fall")).at("report");
  EXPECT_EQ(report["replay"]["closed_loop"]["fell"], true);
  EXPECT_EQ(report["outcome_ok"], false);
}

TEST(ReportPage, HoldsTheMorphTargetsAndPlaysThemTurnedWithTheBody) {
  const WobblingBar bar;
  retarget::MovingMorphs morphs{{{"smile", Eigen::Vector2i(3, 5), Eigen::Matrix3Xd::Ones(3, 2)}}, {}, 30, true};
  morphs.weights = Eigen::RowVector3d(0, 0.5, 1);
  PageInput page = bar.page();
  page.morphs = &morphs;
  const Json told = data_of(write_and_read(page, "morphs")).at("morphs");
  EXPECT_EQ(told["targets"][0]["name"], "smile");
  EXPECT_EQ(told["frames"], 3);
  EXPECT_EQ(told["rate_hz"], 30);
  EXPECT_EQ(told["loop"], true);
  EXPECT_FALSE(data_of(write_and_read(bar.page(), "morphs")).contains("morphs"));
  EXPECT_EQ(std::system("node '" HYDROSTAT_TESTS "/io/check_morphs.mjs'"), 0);
}

TEST(ReportPage, TicksOfAnAxisAreToldApart) {
  EXPECT_EQ(std::system("node '" HYDROSTAT_TESTS "/io/check_ticks.mjs'"), 0);
}

TEST(ReportPage, RefusesAPlaceThatCannotBeWritten) {
  EXPECT_THROW(write_report_page("/proc/absent/report.html", WobblingBar().page()), Error);
}

}  // namespace
}  // namespace hydrostat::io::report_page_test
