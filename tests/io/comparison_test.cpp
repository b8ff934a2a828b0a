#include "io/comparison.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>

#include "io/page_json.h"
#include "io/performance_page.h"
#include "io/write_file.h"
#include "tests/io/refusal.h"
#include "tests/io/temporary_directory.h"
#include "tests/retarget/box_performer.h"

namespace hydrostat::io::comparison_test {
namespace {

using Json = nlohmann::ordered_json;

/// The box bobbing for 1.5 s, and report pages of it.
class ComparisonOf : public testing::Test {
 protected:
  ComparisonOf() {
    retarget::PerformOptions options;
    options.replay.duration_s = 1.5;
    options.baselines = false;
    runs_ = retarget::perform(performer_, signals_, options);
    report_.source.clip = "bob";
    report_.body.length_m = performer_.length;
    report_.closed_loop = runs_.closed_loop->report;
    report_.accuracy.method = "explicit";
    report_.timing_s = {{"replay", 2.5}};
  }
  std::string page(const std::string& name) const {
    const std::string file = (directory_.path / (name + ".html")).string();
    write_performance_page(file, performer_, {}, signals_, runs_, report_);
    return file;
  }
  std::string out() const { return (directory_.path / "comparison.html").string(); }

  TemporaryDirectory directory_;
  retarget::Performer performer_ = retarget::make_box_performer();
  retarget::SignalSet signals_ = retarget::signals_of(performer_);
  retarget::Performances runs_;
  retarget::RunReport report_;
};

Json data_of(const std::string& file) {
  const std::string text = read_file(file), opening = "id=\"data\">";
  const std::size_t begin = text.find(opening) + opening.size();
  return Json::parse(text.substr(begin, text.find("</script>", begin) - begin));
}

const Figure& figure(const ComparedRun& run, const std::string& name) {
  for (const auto& [key, value] : run.figures) {
    if (key == name) return value;
  }
  ADD_FAILURE() << name << " is not there";
  return run.figures.front().second;
}

TEST_F(ComparisonOf, APageGivesItsReplayBack) {
  const PageData read = read_page(page("one"));
  const retarget::Motion& motion = runs_.closed_loop->motion;
  const auto stride = static_cast<Eigen::Index>(std::lround(motion.rate_hz / read.nodes.rate_hz));
  ASSERT_EQ(read.nodes.count(), (motion.count() + stride - 1) / stride);
  for (Eigen::Index f = 0; f < read.nodes.count(); ++f) {
    EXPECT_LT((read.nodes.at(f) - motion.at(f * stride)).cwiseAbs().maxCoeff(), 2e-5) << f;  // [m]
  }
  EXPECT_EQ(read.embedding.nodes, performer_.embedding.nodes);
  EXPECT_EQ(read.embedding.weights, performer_.embedding.weights);
  EXPECT_EQ(read.triangles, performer_.skin.triangles);
}

TEST_F(ComparisonOf, WhatOneRunCannotTellIsNothingThere) {
  report_.closed_loop->drift_per_cycle_length = 0.01;
  const std::string told = page("told");
  report_.closed_loop->drift_per_cycle_length = std::nan("");
  const Comparison comparison = compare_runs({told, page("untold")});
  EXPECT_TRUE(std::holds_alternative<double>(figure(comparison.runs[0], "replay.drift_per_cycle_length")));
  EXPECT_TRUE(std::holds_alternative<std::monostate>(figure(comparison.runs[1], "replay.drift_per_cycle_length")));
}

TEST_F(ComparisonOf, TheDistanceIsThatOfTheSkins) {
  const std::string first = page("first"), same = page("same");
  retarget::Motion& motion = runs_.closed_loop->motion;
  for (Eigen::Index f = 0; f < motion.count(); ++f) motion.at(f).row(0).array() += 0.03;
  report_.accuracy.method = "xpbd";
  const Comparison comparison = compare_runs({first, same, page("moved")});
  ASSERT_EQ(comparison.distances.size(), 2U);
  const auto rms = [&](std::size_t k) {
    const retarget::SkinDistance& course = comparison.distances[k].course;
    return summary_of(course.distance_m, course.time_s).rms_m;
  };
  EXPECT_EQ(rms(0), 0);
  EXPECT_NEAR(rms(1), 0.03, 2e-5);
  EXPECT_LT(comparison.distances[1].course.shape_m.maxCoeff(), 4e-5);
  EXPECT_EQ(comparison.runs[2].name, "moved.html");
  EXPECT_EQ(std::get<std::string>(figure(comparison.runs[2], "accuracy.method")), "xpbd");
  EXPECT_EQ(std::get<double>(figure(comparison.runs[0], "timing_s.total")), 2.5);
  const Json json = Json::parse(comparison_json(comparison));
  EXPECT_EQ(json["schema"], "hydrostat.comparison/1");
  EXPECT_NEAR(json["distances"][1]["rms_length"].get<double>() * performer_.length, 0.03, 2e-5);
  EXPECT_EQ(json["distances"][1]["time_s"].size(), json["distances"][1]["distance_length"].size());
  EXPECT_EQ(json["runs"][1]["figures"]["replay.fell"], false);
}

TEST_F(ComparisonOf, WhatIsNoOtherRunOfTheSameSkinIsToldSo) {
  const std::string first = page("first");
  report_.source.clip = "jump";
  const std::string jump = page("jump");
  report_.source.clip = "bob";
  performer_.skin.triangles(2, 1) = 0;
  const std::string other_triangles = page("triangles");
  performer_.skin.vertices.conservativeResize(3, 3);
  performer_.skin.triangles = performer_.skin.triangles.leftCols(1).eval();
  performer_.embedding.nodes.conservativeResize(4, 3);
  performer_.embedding.weights.conservativeResize(4, 3);
  performer_.embedding.tets.conservativeResize(3);
  performer_.clip_skin.frames.conservativeResize(9, performer_.clip_skin.count());
  const Comparison comparison = compare_runs({first, jump, other_triangles, page("fewer")});
  EXPECT_EQ(comparison.distances[0].obstacle, "it plays another clip, 'jump' and not 'bob'");
  EXPECT_EQ(comparison.distances[1].obstacle, "its skin has other triangles");
  EXPECT_EQ(comparison.distances[2].obstacle, "its skin has 3 vertices and not 4");
  const Json json = Json::parse(comparison_json(comparison));
  EXPECT_EQ(json["distances"][0]["comparable"], false);
  EXPECT_EQ(json["distances"][0]["reason"], comparison.distances[0].obstacle);
  write_comparison_page(out(), comparison);
  EXPECT_EQ(data_of(out())["others"].size(), 3U);
}

TEST_F(ComparisonOf, ThePageShowsEveryRunWithItsOwnBodyAndOpensInABrowser) {
  const std::string first = page("first");
  report_.closed_loop->fell = true;
  report_.closed_loop->fall_time_s = 1.2;
  report_.closed_loop->fall_cause = "<b>tilt</b>";
  const Comparison comparison = compare_runs({first, page("second")});
  write_comparison_page(out(), comparison);
  const Json data = data_of(out());
  ASSERT_EQ(data["motions"].size(), 2U);
  EXPECT_EQ(data["motions"][1]["performer"], 1);
  EXPECT_EQ(data["others"][0]["skin"], data["skin"]);
  bool has_height = false;
  for (const Json& chart : data["charts"]) {
    has_height = has_height || chart["title"] == "Height of the centre of mass";
    for (const Json& curve : chart["curves"]) EXPECT_TRUE(curve["name"] == "first.html" || curve["name"] == "second.html");
  }
  EXPECT_TRUE(has_height);
  EXPECT_EQ(data["charts"][0]["curves"][0]["rank"], 1);  // the second run's colour
  const std::string text = read_file(out());
  for (const char* outside : {"src=\"http", "href=\"http", "@import", "<script src"})
    EXPECT_EQ(text.find(outside), std::string::npos) << outside;
  EXPECT_EQ(std::system(("bash '" HYDROSTAT_TESTS "/page.sh' '" + out() + "'").c_str()), 0);
}

TEST_F(ComparisonOf, ImagesFromElsewhereAreLeftOut) {
  const std::string first = page("first");
  std::string text = read_file(page("second"));
  text.insert(text.find("\"body\":{\"nodes\":\""),
              R"("looks":{"parts":[],"materials":[],"images":["http://example.org/a.png","data:image/png;base64,AA=="]},)");
  const std::string second = (directory_.path / "second.html").string();
  write_file(second, text);
  write_comparison_page(out(), compare_runs({first, second}));
  EXPECT_EQ(data_of(out())["others"][0]["looks"]["images"], Json({"", "data:image/png;base64,AA=="}));
}

TEST_F(ComparisonOf, DamagedPagesAreRefused) {
  const std::string whole = read_file(page("whole"));
  const std::string file = (directory_.path / "damaged.html").string();
  const auto refused = [&](const std::string& text) {
    write_file(file, text);
    return refusal([&] { read_page(file); });
  };
  const std::string damaged =
      file + "||is damaged or of another version|Make it again with 'hydrostat replay' ('simulate' for a scene).";
  Json data = data_of(page("whole"));
  const auto with = [](const Json& json) {
    return "<script type=\"application/json\" id=\"data\">" + json.dump() + "</script>";
  };
  for (const char* key : {"schema", "report", "skin", "body", "motions"}) {
    Json less = data;
    less.erase(key);
    EXPECT_EQ(refused(with(less)), damaged) << key;
  }
  for (const auto& [pointer, value] :
       std::vector<std::pair<const char*, Json>>{{"/schema", "hydrostat.page/9"},
                                                 {"/skin/nodes", "AAAA"},
                                                 {"/skin/nodes", base64(std::vector<unsigned char>(64, 1))},
                                                 {"/skin/triangles", base64(std::vector<unsigned char>(24, 0xff))},
                                                 {"/skin/weights", base64(std::vector<unsigned char>(64, 0xff))},
                                                 {"/motions/2/step", 0},
                                                 {"/motions/2/corners", "!"},
                                                 {"/motions/2/rate_hz", -1},
                                                 {"/motions/2/steps", 7}}) {
    Json other = data;
    other[Json::json_pointer(pointer)] = value;
    EXPECT_EQ(refused(with(other)), damaged) << pointer;
  }
  EXPECT_EQ(refused("<html>"), file + "||is no report page|Make it again with 'hydrostat replay' ('simulate' for a scene).");
  std::mt19937 random(7);
  for (int k = 0; k < 40; ++k) refused(whole.substr(0, random() % whole.find("</script>")));
}

TEST(Base64, GivesTheBytesBackAndRefusesWhatIsNone) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    std::mt19937 random(seed);
    std::vector<unsigned char> bytes(seed);
    for (unsigned char& byte : bytes) byte = static_cast<unsigned char>(random());
    const std::optional<std::string> read = from_base64(base64(bytes));
    ASSERT_TRUE(read);
    EXPECT_EQ(*read, std::string(bytes.begin(), bytes.end())) << seed;
  }
  for (const char* broken : {"A", "AAA", "====", "A===", "AA*=", "A\nAA"}) EXPECT_FALSE(from_base64(broken)) << broken;
}

}  // namespace
}  // namespace hydrostat::io::comparison_test
