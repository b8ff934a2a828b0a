#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "io/signals_file.h"
#include "tests/signal/random_samples.h"

namespace hydrostat::signals_test {
namespace {

struct Outcome {
  int exit_code;
  std::string output;  // standard output and error
};

/// A creature of four edges in a directory of its own.
class SignalsCommand : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = testing::TempDir() + "signals_test_XXXXXX";
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    directory_ = pattern;
    retarget::SolvedSignals solved;
    solved.period_s = 0.8;
    solved.limit = 0.3;
    solved.activation = signal::smooth_loop(3, 48, 4);
    solved.force = signal::random_samples(3, 48, 4);
    solved.bones = {"FL_upper", "FL_lower", "spine", "spine"};
    solved.nodes.resize(2, 4);
    solved.nodes << 0, 0, 1, 2, 1, 2, 2, 3;
    solved.rest_length = Eigen::Vector4d::Constant(0.1);
    solved.stiffness = Eigen::Vector4d::Constant(100);
    io::write_signals(file(), retarget::analyse_signals(solved, {}));
  }
  void TearDown() override { std::filesystem::remove_all(directory_); }

  std::filesystem::path file() const { return directory_ / "signals.json"; }
  retarget::SignalSet stored() const { return io::read_signals(file()); }
  std::string text_of(const std::filesystem::path& path) const {
    std::ifstream stream(path);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }

  /// `hydrostat signals DIR <arguments>`.
  Outcome run(const std::string& arguments) const {
    const std::string command =
        std::string("'") + HYDROSTAT_BINARY + "' signals '" + directory_.string() + "' " + arguments + " 2>&1";
    FILE* pipe = popen(command.c_str(), "r");
    std::string output;
    std::array<char, 4096> piece;
    for (std::size_t size = 0; (size = fread(piece.data(), 1, piece.size(), pipe)) > 0;) output.append(piece.data(), size);
    return {WEXITSTATUS(pclose(pipe)), output};
  }

  std::filesystem::path directory_;
};

void expect_said(const Outcome& outcome, int exit_code, const std::vector<std::string>& words) {
  EXPECT_EQ(outcome.exit_code, exit_code) << outcome.output;
  for (const std::string& word : words)
    EXPECT_NE(outcome.output.find(word), std::string::npos) << word << "\n" << outcome.output;
}

TEST_F(SignalsCommand, ListGroupsChannelsByBone) {
  expect_said(run("list"), 0,
              {"loop of 0.8 s, 48 samples", "FL_upper: 1 channels, mean ", "spine: 2 channels", "harmonics 1 ("});
  expect_said(run("list --bone 'FL_*' --json"), 0,
              {"\"schema\": \"hydrostat.signals_list/1\"", "\"bone\": \"FL_lower\"", "\"channels\": [\"edge/0-1\"]"});
  EXPECT_EQ(run("list --bone 'FL_*' --json").output.find("spine"), std::string::npos);
}

TEST_F(SignalsCommand, AnEditThatLeavesTheNumbersIsRefusedAndTheFileStays) {
  ASSERT_EQ(run("gain --factor 1e80").exit_code, 0);
  const std::string before = text_of(file());
  expect_said(run("gain --factor 1e308"), 2, {"option --factor or --range: layer 'gain 2' makes the signals too large to be reckoned with", "Give less"});
  EXPECT_EQ(text_of(file()), before);
  EXPECT_EQ(run("list").output.find("nan"), std::string::npos);
}

TEST_F(SignalsCommand, PlotDrawsThem) {
  expect_said(run("plot --bone spine"), 0, {"signals.svg: 2 channels"});
  const std::string drawing = text_of(directory_ / "signals.svg");
  EXPECT_TRUE(drawing.starts_with("<svg "));
  EXPECT_NE(drawing.find("spine (2 channels)"), std::string::npos);
}

TEST_F(SignalsCommand, GainAppendsALayerAndLeavesTheSolvedCoefficients) {
  const signal::Spectrum solved = stored().activation;
  expect_said(run("gain --bone 'FL_*' --factor 1.5 --band 1:3 --name bold"), 0,
              {"layer 1 'bold': gain by 1.5", "band 1:3", "2 channels touched", "of 192 samples held at the limit"});
  const retarget::SignalSet set = stored();
  EXPECT_EQ(set.activation.cosine, solved.cosine);
  ASSERT_EQ(set.layers.size(), 1u);
  EXPECT_EQ(std::get<signal::Gain>(set.layers[0].edit).factor, 1.5);
  EXPECT_EQ(set.layers[0].selection.band->last, 3);
}

TEST_F(SignalsCommand, TellsTheSamplesThatTheLimitHolds) {
  expect_said(run("gain --factor 8"), 0, {" samples held at the limit of 1 +- 0.3 (0 without layers)"});
  EXPECT_GT(retarget::edited_activations(stored()).clipped, 0);
}

TEST_F(SignalsCommand, SetShiftAndFilterAppendTheirLayers) {
  expect_said(run("set --channel edge/0-1 --harmonic 2 --amplitude 0.05 --phase 1"), 0,
              {"1 channels touched", "phase 1 rad"});
  expect_said(run("set --channel edge/0-1 --harmonic 3 --amplitude 0.05"), 0, {"set harmonic 3"});
  expect_said(run("shift --by -0.25"), 0, {"shift by -0.25 of the period"});
  expect_said(run("shift --seconds 0.2 --range 0.9:0.1"), 0, {"shift by 0.25 of the period", "range 0.9:0.1"});
  expect_said(run("filter --low-pass 3 --roll-off 1"), 0, {"filter, roll-off over 1", "band 0:3"});
  expect_said(run("filter --band 2:"), 0, {"band 2:24"});
  const retarget::SignalSet set = stored();
  ASSERT_EQ(set.layers.size(), 6u);
  EXPECT_EQ(std::get<signal::SetHarmonic>(set.layers[0].edit).phase, 1);
  EXPECT_FALSE(std::get<signal::SetHarmonic>(set.layers[1].edit).phase);
  EXPECT_NEAR(std::get<signal::Shift>(set.layers[3].edit).by, 0.25, 1e-15);
}

TEST_F(SignalsCommand, LayersListsAndResetDropsThem) {
  run("gain --factor 2 --name one");
  run("shift --by 0.5 --name two");
  expect_said(run("layers"), 0, {"1 'one': gain by 2", "2 'two': shift by 0.5", "4 channels touched", "2 layers;"});
  expect_said(run("layers --json"), 0, {"\"edit\": \"gain\"", "\"by\": 0.5"});
  expect_said(run("reset --layer 1"), 0, {"1 layers dropped, 1 left"});
  EXPECT_EQ(stored().layers.at(0).name, "two");
  expect_said(run("reset"), 0, {"1 layers dropped, 0 left"});
  EXPECT_TRUE(stored().layers.empty());
}

/// However a layer was spoilt by hand, 'layers' tells of it and 'reset' mends the file.
TEST_F(SignalsCommand, ResetMendsWhatNoOtherVerbTakes) {
  const std::string before = text_of(file());
  const auto spoil = [&](const std::string& layers) {
    std::string text = before;
    text.replace(text.find("\"layers\": []"), 12, "\"layers\": [" + layers + "]");
    std::ofstream(file()) << text;
  };
  const std::string huge = R"({"name": "huge", "edit": "gain", "factor": 1e150})", none = R"({"name": "none", "edit": "gain", "factor": 1e400})",
                    odd = R"({"name": "odd", "edit": "bend"})", off = R"({"name": "off", "edit": "shift", "by": 3})";
  const std::vector<std::pair<std::string, std::string>> cases{
      {huge + "," + huge, "2 layers; layer 'huge' makes the signals too large to be reckoned with"},
      {none, "1 'none': refused: factor: not a number"},
      {odd, "1 'odd': refused: edit: 'bend' is no edit"},
      {off, "1 'off': shift by 3 of the period, channel '*', bone '*': refused: shift is not a share"},
      {"7", "1 '': refused: not an object"}};
  for (const auto& [layers, told] : cases) {
    SCOPED_TRACE(layers);
    spoil(layers);
    EXPECT_EQ(run("list").exit_code, 1);
    expect_said(run("layers"), 0, {told});
    expect_said(run("reset"), 0, {" layers dropped, 0 left; "});
    EXPECT_EQ(text_of(file()), before);
  }
  spoil(huge + "," + huge + "," + huge);
  expect_said(run("reset --layer 1"), 0, {"1 layers dropped, 2 left; layer 'huge' makes the signals too large"});
  expect_said(run("reset --layer 1"), 0, {"1 layers dropped, 1 left; ", " samples held at the limit"});
  spoil(odd + "," + off + "," + none);
  expect_said(run("reset --layer 2"), 1, {"signals.json: layer 1: edit: 'bend' is no edit. Drop it first, or all layers: leave --layer out."});
  spoil(odd + "," + off);
  expect_said(run("reset --layer 1"), 0, {"1 layers dropped, 1 left; 'hydrostat signals DIR layers' tells which of them are refused"});
  spoil("");
  std::string text = before;
  text.replace(text.find("\"period_s\": 0.8"), 15, "\"period_s\": 1e400");
  std::ofstream(file()) << text;
  expect_said(run("reset"), 1, {"signals.json: period_s: not a number"});
}

TEST_F(SignalsCommand, ResetBringsTheFileBackToTheByte) {
  const std::string before = text_of(file());
  run("gain --factor 2");
  EXPECT_NE(text_of(file()), before);
  run("reset");
  EXPECT_EQ(text_of(file()), before);
}

TEST_F(SignalsCommand, RefusesAPatternThatMatchesNothingAndNamesWhatExists) {
  const std::string before = text_of(file());
  expect_said(
      run("gain --bone tail --factor 2"), 1,
      {"signals.json: selection: no channel matches --channel '*' --bone 'tail'", "FL_upper, FL_lower, spine", "edge/0-1"});
  expect_said(run("list --channel x"), 1, {"no channel matches"});
  EXPECT_EQ(text_of(file()), before);
}

TEST_F(SignalsCommand, RefusesOptionsOutOfRange) {
  const std::string before = text_of(file());
  expect_said(run("gain --factor 2 --band 3:1"), 2, {"option --band", "'3:1'"});
  expect_said(run("gain --factor 2 --band 3"), 2, {"option --band", "no colon"});
  expect_said(run("gain --factor 2 --band 0:25"), 2, {"within 0:24"});
  expect_said(run("gain --factor 2 --range 0:x"), 2, {"option --range", "'x' is not a number"});
  expect_said(run("gain --factor 2 --range 0:2"), 2, {"range is not within 0 to 1"});
  expect_said(run("gain --factor nan"), 2, {"factor is not a finite number"});
  expect_said(run("gain"), 2, {"--factor"});
  expect_said(run("set --harmonic 25 --amplitude 1"), 2, {"harmonic 25 is not in 0 to 24"});
  expect_said(run("shift --by 3"), 2, {"shift is not a share of the period"});
  expect_said(run("shift"), 2, {"--seconds"});
  expect_said(run("filter --low-pass 2 --band 1:2"), 2, {"--low-pass"});
  expect_said(run("reset --layer 1"), 2, {"layer 1 is not among the 0 that exist"});
  expect_said(run(""), 2, {"subcommand"});
  EXPECT_EQ(text_of(file()), before);
}

TEST_F(SignalsCommand, RefusesADirectoryWithoutSignals) {
  std::filesystem::remove(file());
  expect_said(run("list"), 1, {"signals.json", "cannot be read"});
}

TEST_F(SignalsCommand, RefusesADamagedFile) {
  std::string text = text_of(file());
  text.replace(text.find("\"period_s\": 0.8"), 15, "\"period_s\": -1.");
  std::ofstream(file()) << text;
  expect_said(run("list"), 1, {"signals.json: line "});
}

}  // namespace
}  // namespace hydrostat::signals_test
