#include "io/signals_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "io/signals_plot.h"
#include "io/write_file.h"
#include "retarget/error.h"
#include "tests/signal/random_samples.h"

namespace hydrostat::io::signals_file_test {
namespace {

using retarget::SignalSet;
using signal::Kind;

SignalSet random_signals(unsigned seed, Kind kind) {
  retarget::SolvedSignals solved;
  solved.kind = kind;
  solved.period_s = 0.1 + 0.37 * seed;
  solved.limit = 0.25;
  solved.activation = signal::smooth_loop(seed, 40, 3) + 1e-3 * signal::random_samples(seed, 40, 3);
  solved.force = 1e4 * signal::random_samples(seed + 7, 40, 3);
  solved.bones = {"FL_upper", "FL \"lower\"", "Rücken"};
  solved.nodes.resize(2, 3);
  solved.nodes << 0, 0, 1, 1, 2, 2;
  solved.rest_length = Eigen::Vector3d(0.1, 1.0 / 3, 1e-3);
  solved.stiffness = Eigen::Vector3d(0, 1e5 / 3, 12);
  SignalSet set = retarget::analyse_signals(solved, {});
  set.layers.push_back({"softer", {.group = "FL*"}, signal::Gain{1.0 / 3}});
  set.layers.push_back(
      {"later", {.band = signal::Band{1, 3}, .range = signal::PhaseRange{0.1, 1.0 / 3}}, signal::Shift{-0.05}});
  set.layers.push_back({"calm", {.band = signal::Band{0, 6}}, signal::Filter{2}});
  set.layers.push_back({"mean", {.channel = "edge/0-1"}, signal::SetHarmonic{0, 0.95, {}}});
  if (kind == Kind::loop) set.layers.push_back({"beat", {}, signal::SetHarmonic{2, 0.1, 1.0 / 7}});
  return set;
}

void expect_same(const signal::Spectrum& a, const signal::Spectrum& b) {
  EXPECT_EQ(a.kind, b.kind);
  EXPECT_EQ(a.samples, b.samples);
  EXPECT_EQ(a.cosine, b.cosine);
  EXPECT_EQ(a.sine, b.sine);
  EXPECT_EQ(a.cubic, b.cubic);
}

TEST(SignalsFile, BringsEveryNumberBackToTheBit) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    for (const Kind kind : {Kind::loop, Kind::one_shot}) {
      const SignalSet set = random_signals(seed, kind);
      const SignalSet read = parse_signals(signals_text(set), "signals.json");
      EXPECT_EQ(read.period_s, set.period_s);
      EXPECT_EQ(read.limit, set.limit);
      EXPECT_EQ(read.nodes, set.nodes);
      EXPECT_EQ(read.rest_length, set.rest_length);
      EXPECT_EQ(read.stiffness, set.stiffness);
      expect_same(read.activation, set.activation);
      expect_same(read.force, set.force);
      ASSERT_EQ(read.count(), set.count());
      EXPECT_EQ(read.channels[2].name, set.channels[2].name);
      EXPECT_EQ(read.channels[1].group, set.channels[1].group);
      EXPECT_EQ(read.layers.size(), set.layers.size());
      EXPECT_EQ(edited_activations(read).samples, edited_activations(set).samples);
      EXPECT_EQ(signals_text(read), signals_text(set));
    }
  }
}

TEST(SignalsFile, IsWrittenWholeAndReadBack) {
  const std::filesystem::path directory = std::filesystem::path(testing::TempDir()) / "signals_file_test";
  std::filesystem::create_directories(directory);
  const std::filesystem::path file = directory / "signals.json";
  const SignalSet set = random_signals(1, Kind::loop);
  write_signals(file, set);
  EXPECT_FALSE(std::filesystem::exists(directory / "signals.json.part"));
  expect_same(read_signals(file).activation, set.activation);
  std::filesystem::remove_all(directory);
}

TEST(SignalsFile, RefusesToWriteWhatIsNotANumber) {
  SignalSet set = random_signals(1, Kind::loop);
  set.force.cosine(2, 1) = std::numeric_limits<double>::quiet_NaN();
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "signals_nan.json";
  try {
    write_signals(file, set);
    ADD_FAILURE() << "written";
  } catch (const Error& error) {
    EXPECT_EQ(error.where, "channel 'edge/0-2'");
    EXPECT_FALSE(std::filesystem::exists(file));
  }
}

/// A whole file of one channel, two harmonics.
std::string small_file() {
  return R"({
  "schema": "hydrostat.signals/1",
  "kind": "loop",
  "period_s": 0.5,
  "samples": 30,
  "rate_hz": 60,
  "harmonics": 1,
  "limit": 0.2,
  "layers": [{"name": "a", "edit": "gain", "factor": 2, "band": [0, 1]}],
  "channels": [
    {"name": "edge/0-1", "bone": "spine", "nodes": [0, 1], "rest_length": 0.1, "stiffness": 100,
     "activation": {"cosine": [1, 0.1], "sine": [0, 0.05]},
     "force": {"cosine": [0, 2], "sine": [0, 3]}}
  ]
})";
}

void collect_names(const nlohmann::json& value, std::set<std::string>& names) {
  if (!value.is_structured()) return;
  for (const auto& [key, entry] : value.items()) {
    if (value.is_object()) names.insert(key);
    collect_names(entry, names);
  }
}

TEST(SignalsFile, IsToldInTheReadmeMemberByMember) {
  const std::string readme = read_file(HYDROSTAT_README);
  const std::size_t begin = readme.find("\n## signals.json\n");
  ASSERT_NE(begin, std::string::npos);
  const std::string section = readme.substr(begin, readme.find("\n## ", begin + 1) - begin);
  std::set<std::string> names;
  for (const Kind kind : {Kind::loop, Kind::one_shot}) collect_names(nlohmann::json::parse(signals_text(random_signals(1, kind))), names);
  EXPECT_GT(names.size(), 20U);
  for (const std::string& name : names) {
    if (name == "schema") continue;
    EXPECT_NE(section.find('`' + name + '`'), std::string::npos) << name;
  }
}

TEST(SignalsFile, TakesWhatAPersonWrites) {
  const SignalSet set = parse_signals(small_file(), "signals.json");
  EXPECT_EQ(set.activation.sine(1, 0), 0.05);
  EXPECT_EQ(set.layers[0].selection.group, "*");
}

TEST(SignalsFile, RefusesBadFilesWithFilePlaceAndMend) {
  struct Slip {
    std::string what, with, where, message;
  };
  const std::vector<Slip> slips{
      {"\"period_s\": 0.5", "\"period_s\": -0.5", "period_s", "-0.5 is not above 0"},
      {"\"period_s\": 0.5", "\"period_s\": NaN", "line 4", "not JSON"},
      {"\"period_s\": 0.5", "\"period_s\": null", "period_s", "not a number"},
      {"\"period_s\": 0.5", "\"period_s\": 1e999", "", "too large"},
      {"\"period_s\": 0.5,", "", "", "'period_s' is missing"},
      {"\"rate_hz\": 60", "\"rate_hz\": 50", "rate_hz", "does not agree"},
      {"signals/1", "signals/9", "schema", "'hydrostat.signals/9' is not known"},
      {"\"loop\"", "\"loops\"", "kind", "no kind of signal"},
      {"\"samples\": 30", "\"samples\": 30.5", "samples", "not a whole number"},
      {"\"samples\": 30", "\"samples\": 99999999999", "samples", "not a whole number"},
      {"\"harmonics\": 1", "\"harmonics\": 16", "harmonics", "not a whole number from 0 to 15"},
      {"\"limit\": 0.2", "\"limit\": 1.5", "limit", "not below 1"},
      {"\"gain\"", "\"gains\"", "layers[0].edit", "no edit"},
      {"\"factor\": 2", "\"factor\": \"2\"", "layers[0].factor", "not a number"},
      {"[0, 1]}],", "[1, 0]}],", "layers[0]", "band"},
      {"\"nodes\": [0, 1]", "\"nodes\": [0]", "channel 'edge/0-1'.nodes", "has 1 entries, not 2"},
      {"\"nodes\": [0, 1]", "\"nodes\": [1, 1]", "channel 'edge/0-1'.nodes", "one node"},
      {"\"rest_length\": 0.1", "\"rest_length\": 0", "channel 'edge/0-1'.rest_length", "not above 0"},
      {"\"stiffness\": 100", "\"stiffness\": -1", "channel 'edge/0-1'.stiffness", "below 0"},
      {"[1, 0.1]", "[1, 0.1, 0.2]", "channel 'edge/0-1'.activation.cosine", "has 3 entries, not 2"},
      {"[1, 0.1]", "[1, true]", "channel 'edge/0-1'.activation.cosine[1]", "not a number"},
      {"[0, 0.05]", "[0.5, 0.05]", "channel 'edge/0-1'.activation.sine[0]", "no sine"},
      {"\"force\": {\"cosine\": [0, 2]", "\"force\": {\"cosine\": 7", "channel 'edge/0-1'.force.cosine", "not a list"},
      {"\"bone\": \"spine\"", "\"bone\": 4", "channel 'edge/0-1'.bone", "not a text"},
  };
  for (const Slip& slip : slips) {
    SCOPED_TRACE(slip.with);
    std::string text = small_file();
    const std::size_t place = text.find(slip.what);
    ASSERT_NE(place, std::string::npos);
    text.replace(place, slip.what.size(), slip.with);
    try {
      parse_signals(text, "dog/signals.json");
      ADD_FAILURE() << "taken";
    } catch (const Error& error) {
      EXPECT_EQ(error.file, "dog/signals.json");
      EXPECT_EQ(error.where, slip.where);
      EXPECT_NE(std::string(error.what()).find(slip.message), std::string::npos) << error.what();
      EXPECT_TRUE(error.mend.ends_with('.')) << error.mend;
    }
  }
}

TEST(SignalsFile, NamesThatAreNoUtf8StopNobody) {
  SignalSet set = random_signals(1, Kind::loop);
  set.channels[0].group =
      "h\xfc"
      "fte";
  EXPECT_EQ(parse_signals(signals_text(set), "signals.json").channels[0].group,
            "h\xef\xbf\xbd"
            "fte");
}

TEST(SignalsFile, RefusesTwoChannelsOfOneName) {
  SignalSet set = random_signals(1, Kind::loop);
  set.channels[2].name = set.channels[0].name;
  EXPECT_THROW(parse_signals(signals_text(set), "signals.json"), Error);
}

TEST(SignalsFile, AnyCutOfItIsRefused) {
  const std::string text = small_file();
  for (std::size_t length = 0; length < text.size(); ++length) {
    SCOPED_TRACE("length " + std::to_string(length));
    EXPECT_THROW(parse_signals(text.substr(0, length), "signals.json"), Error);
  }
}

TEST(SignalsPlot, DrawsALinePerChannelAndEscapesNames) {
  SignalSet set = random_signals(1, Kind::loop);
  set.channels[0].group = "<hip & thigh>";
  const retarget::EditedActivations edited = edited_activations(set);
  const std::string text = signals_plot(set, edited, signals_by_bone(set, edited, {0, 1}));
  const auto count = [&](const std::string& word) {
    std::size_t found = 0;
    for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++found;
    return found;
  };
  EXPECT_EQ(count("class=\"now\""), 2u);
  EXPECT_EQ(count("class=\"solved\""), 2u);
  EXPECT_EQ(count("&lt;hip &amp; thigh&gt; (1 channel)"), 1u);
  EXPECT_EQ(count("nan"), 0u);
  EXPECT_TRUE(text.ends_with("</svg>\n"));
}

}  // namespace
}  // namespace hydrostat::io::signals_file_test
