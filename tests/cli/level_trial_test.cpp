#include "cli/level_trial.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include "cli/command_line.h"
#include "cli/level_option.h"
#include "cli/outcome.h"
namespace hydrostat::cli::level_trial_test {
namespace {

using retarget::LevelCost;

const std::vector<LevelCost> kLevels{{400, 402, 16}, {200, 198, 8}, {0, 100, 4}, {50, 48, 2}, {25, 24, 1}, {20, 12, 0.5}};

TEST(LevelTrial, FindsTheCheapestThatKeepsItsWayAmongThoseItMayTry) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    std::vector<LevelCost> levels = kLevels;
    std::shuffle(levels.begin(), levels.end(), random);
    const double above = std::uniform_real_distribution<double>(0, 5)(random);
    std::set<int> going;
    for (const LevelCost& level : levels) {
      if (random() % 3 == 0) going.insert(level.nodes);
    }
    const auto keeps_way = [&](const LevelCost& level) { return going.contains(level.nodes); };
    std::vector<int> tried;
    const LevelTrial trial = try_levels(levels, above, /*own_nodes=*/100, 1, [&](const LevelCost& level) {
      tried.push_back(level.nodes);
      return keeps_way(level);
    });
    std::vector<int> expected;
    bool is_found = false;
    for (auto level = kLevels.rbegin(); level != kLevels.rend() && !is_found; ++level) {
      if (level->work_ms <= above || level->nodes > 100) continue;
      expected.push_back(level->nodes);
      is_found = keeps_way(*level);
    }
    EXPECT_EQ(tried, expected);
    ASSERT_EQ(trial.found.has_value(), is_found);
    if (is_found) {
      EXPECT_EQ(trial.found->nodes, expected.back());
      expected.pop_back();
    }
    EXPECT_EQ(trial.lost, expected);
  }
}

TEST(LevelTrial, TriesNoMoreThanAMinuteOfCountedWork) {
  const auto none = [](const LevelCost&) { return false; };
  EXPECT_EQ(try_levels(kLevels, 0, 1000, 1, none).lost.size(), 6U);
  EXPECT_EQ(try_levels(kLevels, 0, 1000, 600, none).lost, (std::vector<int>{12, 24}));  // 18, 36, then 72 s
  EXPECT_TRUE(try_levels(kLevels, 0, 1000, 2001, none).lost.empty());
}

TEST(LevelOption, WarnsOfAMeshThatIsFarFromTheWishAlone) {
  using Pairs = std::vector<std::pair<int, int>>;
  for (const auto& [wished, nodes] : Pairs{{24, 16}, {24, 24}, {24, 36}, {100, 67}, {100, 150}}) EXPECT_EQ(far_from_wish(wished, nodes), "") << nodes;
  for (const auto& [wished, nodes] : Pairs{{24, 15}, {24, 12}, {24, 37}, {24, 48}, {100, 66}, {100, 151}}) {
    EXPECT_EQ(far_from_wish(wished, nodes), "level: the control mesh has " + std::to_string(nodes) + " nodes where --lod asks for " + std::to_string(wished) +
                                                ", for its lattice goes by whole cells");
  }
}

TEST(Outcome, OfADivergenceIsNoFallAndWantsNoHigherLimit) {
  retarget::Replay run;
  const auto told = [&run](const std::string& way_up) {
    testing::internal::CaptureStderr();
    EXPECT_EQ(tell_run(run, "creature", "failed.glb", way_up), kShortOfTarget);
    return testing::internal::GetCapturedStderr();
  };
  run.report.fell = true;
  run.report.fall_cause = "it was so";
  EXPECT_EQ(told(""), "creature: replay: the creature fell: it was so. failed.glb shows it.\n");
  EXPECT_EQ(change_of_conversion(run), "more --nodes or a calmer clip");
  run.termination = physics::Termination::kDiverged;
  EXPECT_EQ(change_of_conversion(run), "--method euler or more --nodes");
  EXPECT_EQ(told("take another"), "creature: replay: it was so. failed.glb shows it; take another.\n");
}

TEST(Outcome, AHigherLimitIsAdvisedWhereTheFallFoundConstraintsAtTheirs) {
  retarget::Replay run;
  run.report.fell = true;
  run.report.fall_time_s = 2;
  run.course.time_s = Eigen::VectorXd::LinSpaced(23, 0, 2.2);
  run.course.saturated = Eigen::VectorXd::Zero(23);
  run.course.saturated.head(10).setConstant(0.5);  // long before
  EXPECT_EQ(change_of_conversion(run), "more --nodes or a calmer clip");
  run.course.saturated[19] = 0.12;
  EXPECT_EQ(change_of_conversion(run), "a higher --limit (12 % of all constraints were at the present one), more --nodes or a calmer clip");
}

TEST(Outcome, TellsADriftThatIsToldAndAnAssist) {
  retarget::Replay run;
  const auto told = [&run] {
    testing::internal::CaptureStdout();
    EXPECT_EQ(tell_run(run, "creature", "failed.glb"), kDone);
    return testing::internal::GetCapturedStdout();
  };
  EXPECT_NE(told().find("(clip 0.000), drift 0.00 % L a cycle; 0.00x real time"), std::string::npos) << told();
  run.report.drift_per_cycle_length = std::nan("");
  EXPECT_NE(told().find("(clip 0.000); 0.00x real time"), std::string::npos) << told();
  run.report.external_assist_mg = 6.8;
  EXPECT_NE(told().find("(clip 0.000); assisted from outside by up to 6.8 mg; 0.00x real time"), std::string::npos) << told();
}

TEST(LevelTrial, TellsWhatIsKnownAndHowToMend) {
  const LevelTrial found{kLevels[3], {12, 24}}, lost{std::nullopt, {12, 24, 48}}, unknown{std::nullopt, {}};
  EXPECT_EQ(way_up(found, true), "the cheapest level on which it keeps its way, of 48 nodes, takes 2 ms a frame: give --budget 2.2ms");
  EXPECT_EQ(way_up(found, false), "the cheapest level on which it keeps its way, of 48 nodes, takes 2 ms a frame: give --lod 50");
  EXPECT_EQ(way_up({kLevels[2], {}}, false), "the cheapest level on which it keeps its way, of 100 nodes, takes 4 ms a frame: give --lod 100");
  EXPECT_EQ(way_up(lost, true), "it falls or gets nowhere on levels of 12, 24 and 48 nodes, too: convert again with more --nodes or a calmer clip");
  EXPECT_EQ(way_up(unknown, true), "");
  const auto refused = [](const LevelTrial& trial) {
    const UsageError error = no_level_within("hydrostat replay", 0.01, kLevels, trial);
    return std::string(error.what()) + ". " + error.mend;
  };
  EXPECT_EQ(refused(found), "no level takes 0.01 ms a frame or less; the cheapest on which the creature keeps its way, of 48 nodes, takes 2 ms. Allow 2.2ms.");
  EXPECT_EQ(refused(lost), "no level takes 0.01 ms a frame or less; the cheapest, of 12 nodes, takes 0.5 ms; on those of 12, 24 and 48 nodes the creature falls or gets "
                           "nowhere, and on finer ones it is not known. Allow 0.55ms or more.");
  EXPECT_EQ(refused(unknown), "no level takes 0.01 ms a frame or less; the cheapest, of 12 nodes, takes 0.5 ms; whether the creature keeps its way on any is not known: a "
                              "replay of each would take too long. Allow 0.55ms or more.");
}

}  // namespace
}  // namespace hydrostat::cli::level_trial_test
