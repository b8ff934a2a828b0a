#include "retarget/run_warnings.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "tests/retarget/box_performer.h"

namespace hydrostat::retarget::run_warnings_test {
namespace {

TEST(TargetWarnings, SayNothingOfATargetThatLacksNothing) {
  const Performer performer = make_box_performer();
  EXPECT_TRUE(target_warnings(performer.prepared, performer.scene.body, 0.1, true).empty());
}

TEST(TargetWarnings, NameTimeAndPatchesOfTheMissingWrench) {
  Performer performer = make_box_performer();
  performer.prepared.missing_wrench(1, 7) = 0.2;
  performer.prepared.contacts.state[0][7] = ContactState::kOff;
  const auto warnings = target_warnings(performer.prepared, performer.scene.body, 0.1, true);
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_EQ(warnings[0].find("contact cannot give all that the motion needs: 0.20 mg are missing at 0.12 s (frame 7), standing on 'back_left', "
                             "'front_right', 'front_left'"),
            0U)
      << warnings[0];
  for (auto& states : performer.prepared.contacts.state) states[7] = ContactState::kOff;
  EXPECT_NE(target_warnings(performer.prepared, performer.scene.body, 0.1, true)[0].find("0.12 s (frame 7), in flight"), std::string::npos);
}

TEST(TargetWarnings, TellOfAClipThatNeedsFarMoreThanTheLimit) {
  const Performer performer = make_box_performer();  // bobs by 3 %
  const auto warnings = target_warnings(performer.prepared, performer.scene.body, 0.015, false);
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_EQ(warnings[0], "the clip bends and stretches constraints by 3 %, the limit allows 2 %: expect a smaller motion; give a higher --limit");
  EXPECT_TRUE(target_warnings(performer.prepared, performer.scene.body, 0.025, false).empty());
}

TEST(TargetWarnings, TellHowFarAClipIsMovedWhereThatIsTooFar) {
  Performer performer = make_box_performer();
  PreparationReport& report = performer.prepared.report;
  report.total_shift_rms_length = 0.0399;
  EXPECT_TRUE(target_warnings(performer.prepared, performer.scene.body, 0.1, true).empty());
  report.total_shift_rms_length = 0.0633;
  report.momentum_shift_rms_length = 0.0581;
  report.volume_shift_rms_length = 0.0221;
  report.foot_shift_rms_length = 0.0016;
  const auto warnings = target_warnings(performer.prepared, performer.scene.body, 0.1, true);
  ASSERT_EQ(warnings.size(), 1U);
  for (const char* words : {"moved by 6.3 % L", "5.8 % to be in balance", "2.2 % to keep its volume", "0.2 % to stand"}) {
    EXPECT_NE(warnings[0].find(words), std::string::npos) << words << ": " << warnings[0];
  }
}

TEST(InverseWarnings, ComeOnePerFigureThatIsTooLarge) {
  InverseReport report;
  EXPECT_TRUE(inverse_warnings(report).empty());
  report.saturated = 0.06;
  report.miss_rms_length = 4e-4;
  report.root_residual_mg = 0.02;
  EXPECT_EQ(inverse_warnings(report).size(), 3U);
}

Performances performances_of(double travel, const Feedback& feedback, Lapse wished, Lapse lapse) {
  Performances performances;
  performances.closed_loop.emplace().report.travel_per_cycle_length = travel;
  performances.closed_loop->report.clip_travel_per_cycle_length = 0.5;
  performances.closed_loop->report.drift_per_cycle_length = 0.025;
  performances.feedback = feedback;
  performances.wished_lapse = wished;
  performances.lapse = lapse;
  return performances;
}

TEST(FeedbackWarnings, SayNothingWhereWhatWasWishedWillDoOrFallsOnAnyGain) {
  EXPECT_TRUE(feedback_warnings(performances_of(0.5, {}, Lapse::kNothing, Lapse::kNothing)).empty());
  EXPECT_TRUE(feedback_warnings(performances_of(0.1, {}, Lapse::kFell, Lapse::kFell)).empty());
  EXPECT_TRUE(feedback_warnings(performances_of(0.5, {4, 1, 1}, Lapse::kNothing, Lapse::kNothing), {4, 1, 1}).empty());
}

TEST(FeedbackWarnings, TellWhichGainWasTakenAndWhy) {
  const auto told = [](const Performances& performances, const Feedback& wished = {}) {
    const std::vector<std::string> warnings = feedback_warnings(performances, wished);
    return warnings.size() == 1 ? warnings.front() : std::to_string(warnings.size()) + " warnings";
  };
  EXPECT_EQ(told(performances_of(0.5, {16, 1, 1}, Lapse::kFell, Lapse::kNothing)),
            "feedback: on the usual gain the creature falls, it stays up where effort is 16 times as dear as usual");
  EXPECT_EQ(told(performances_of(0.5, {1, 0.5, 1.5}, Lapse::kLostWay, Lapse::kNothing)),
            "feedback: on the usual gain the creature loses its way, it keeps it where the horizon is 0.5 times as long as usual and "
            "momentum weighs 1.5 times as much");
  EXPECT_EQ(told(performances_of(0.5, {1, 1, 1, 1e-3}, Lapse::kFell, Lapse::kNothing)),
            "feedback: on the usual gain the creature falls, it stays up where a regulator answers what is small, costs up to 0.001");
  EXPECT_EQ(told(performances_of(0.5, {1, 1, 1, 1}, Lapse::kFell, Lapse::kNothing)),
            "feedback: on the usual gain the creature falls, it stays up where a regulator answers all");
  EXPECT_EQ(told(performances_of(0.4, {16, 1, 1}, Lapse::kFell, Lapse::kLostWay)),
            "feedback: on the usual gain the creature falls, it stays up where effort is 16 times as dear as usual, but makes 80 % of the "
            "clip's way and drifts 2.5 % L a cycle");
  EXPECT_EQ(told(performances_of(0.4, {16, 1, 1}, Lapse::kLostWay, Lapse::kLostWay)),
            "feedback: on the usual gain the creature loses its way, it strays less where effort is 16 times as dear as usual, but makes 80 % of "
            "the clip's way and drifts 2.5 % L a cycle");
  EXPECT_EQ(told(performances_of(0.5, {}, Lapse::kFell, Lapse::kNothing), {4, 1, 1}),
            "feedback: on its own gain the creature falls, it stays up on the usual one");
  Performances unsure = performances_of(0.5, {1, 1, 1, 1}, Lapse::kFell, Lapse::kNothing);
  unsure.trials_lost = 2;
  EXPECT_EQ(told(unsure), "feedback: on the usual gain the creature falls, it stays up where a regulator answers all; of 4 bodies 10 % off the plan, "
                          "shoved by 0.1 m/s, it loses 2");
  unsure = performances_of(0.5, {}, Lapse::kNothing, Lapse::kNothing);
  unsure.trials_lost = 1;
  EXPECT_EQ(told(unsure), "feedback: of 4 bodies 10 % off the plan, shoved by 0.1 m/s, it loses 1, and fewer by no regulator");
  unsure.feedback = {1, 1, 1, 1};
  EXPECT_EQ(told(unsure), "feedback: on the usual gain the creature loses bodies off the plan, it keeps more of them where a regulator answers all; "
                          "of 4 bodies 10 % off the plan, shoved by 0.1 m/s, it loses 1");
  EXPECT_EQ(told(performances_of(0.4, {}, Lapse::kLostWay, Lapse::kLostWay)),
            "feedback: the creature makes 80 % of the clip's way and drifts 2.5 % L a cycle, and strays half as far on no other gain");
}

/// Early falls and short replays tell none.
TEST(FeedbackWarnings, LeaveADriftOutThatCannotBeTold) {
  Performances lost = performances_of(0.4, {}, Lapse::kLostWay, Lapse::kLostWay);
  lost.closed_loop->report.drift_per_cycle_length = std::nan("");
  EXPECT_EQ(feedback_warnings(lost).front(), "feedback: the creature makes 80 % of the clip's way, and strays half as far on no other gain");
}

TEST(FeedbackWarnings, TellOfATurn) {
  Performances lost = performances_of(0.5, {}, Lapse::kLostWay, Lapse::kLostWay);
  double& turn = lost.closed_loop->report.heading_deg_per_cycle;
  for (const double degrees : {0.94, -0.94}) {
    turn = degrees;
    EXPECT_EQ(feedback_warnings(lost).front(),
              "feedback: the creature makes 100 % of the clip's way, drifts 2.5 % L and turns by 0.9 degrees a cycle, and strays half as far on no other gain");
  }
  lost.closed_loop->report.clip_travel_per_cycle_length = 0.04;
  EXPECT_EQ(feedback_warnings(lost).front(),
            "feedback: the creature turns by 0.9 degrees a cycle on its place, and strays half as far on no other gain");
  lost.closed_loop->report.world_rms_length = 0.06;
  lost.closed_loop->report.shape_rms_length = 0;
  EXPECT_EQ(feedback_warnings(lost).front(),
            "feedback: the creature is 6 % L (RMS) off its place and turns by 0.9 degrees a cycle, and strays half as far on no other gain");
  turn = 0.04;
  EXPECT_EQ(feedback_warnings(lost).front(), "feedback: the creature is 6 % L (RMS) off its place, and strays half as far on no other gain");
}

TEST(FeedbackWarnings, TellOfALostPlaceWhereTheClipGoesNowhere) {
  Performances lost = performances_of(0, {}, Lapse::kLostWay, Lapse::kLostWay);
  ReplayReport& run = lost.closed_loop->report;
  run.clip_travel_per_cycle_length = 0.04;
  run.shape_rms_length = 0.3;
  run.world_rms_length = std::hypot(0.3, 0.19);
  EXPECT_EQ(feedback_warnings(lost).front(), "feedback: the creature is 19 % L (RMS) off its place, and strays half as far on no other gain");
  lost.feedback = {16, 1, 1};
  EXPECT_EQ(feedback_warnings(lost).front(), "feedback: on the usual gain the creature loses its place, it strays less where effort is 16 times as dear "
                                             "as usual, but is 19 % L (RMS) off its place");
}

TEST(MotionWarnings, TellOfWhatCarriedTheCreatureAndOfAStrangeShape) {
  ReplayReport run;
  run.guard_steps = 469;
  run.clip_shape_rms_length = 0.09;
  EXPECT_TRUE(motion_warnings(run).empty());
  run.external_assist_mg = 1e-9;  // of rounding
  EXPECT_TRUE(motion_warnings(run).empty());
  run.external_assist_mg = 6.8;
  run.external_assist_time_s = 0.64;
  ASSERT_EQ(motion_warnings(run).size(), 1U);
  for (const char* word : {"assist: the creature is not self-driven throughout", "469 steps", "6.8 times its weight at 0.64 s", "--method euler"}) {
    EXPECT_NE(motion_warnings(run)[0].find(word), std::string::npos) << motion_warnings(run)[0];
  }
  run.external_assist_mg = 0;
  run.clip_shape_rms_length = 0.123;
  ASSERT_EQ(motion_warnings(run).size(), 1U);
  EXPECT_EQ(motion_warnings(run)[0].find("the skin is 12 % L from the clip's"), 0U) << motion_warnings(run)[0];
  run.fell = true;
  EXPECT_TRUE(motion_warnings(run).empty());
}

/// Nothing where it was taken; else what decided.
TEST(PolishWarnings, TellWhyItWasLeftOut) {
  Polished polished;
  polished.report.correction_rms_before = polished.report.correction_rms_after = 0.01;
  EXPECT_NE(polish_warnings(polished).at(0).find("no round of it"), std::string::npos);
  polished.is_frail = true;
  polished.solved_on_trials = {8, 1, 0.004};
  polished.polished_on_trials = {8, 3, 0.005};
  EXPECT_NE(polish_warnings(polished).at(0).find("of 8 bodies up to 10 % off the plan, shoved by 0.1 m/s, it loses 3 instead of 1"), std::string::npos);
  polished.polished_on_trials = {8, 1, 0.0068};
  EXPECT_NE(polish_warnings(polished).at(0).find("0.68 % L from the target by it instead of 0.40"), std::string::npos);
  polished.is_frail = false;
  polished.report.correction_rms_after = 0.001;
  EXPECT_TRUE(polish_warnings(polished).empty());
}

/// Whether it falls, loses its way, needs other feedback, cannot be told, corrects more or strays; but the last two not where that is for a
/// push or another body.
TEST(PolishedReplayWarnings, AreOfWhatGoesWorseByPolishThanWithout) {
  Performances before;
  before.closed_loop.emplace();
  before.closed_loop->report.correction_rms = 4e-4;
  before.closed_loop->report.shape_rms_length = 0.004;
  Performances fine = before;
  fine.closed_loop->report.correction_rms = 3.9e-4;
  fine.closed_loop->report.shape_rms_length = 0.0049;
  EXPECT_TRUE(polished_replay_warnings(before, fine, true).empty());
  const auto told = [&](bool always, const std::function<void(Performances&, ReplayReport&)>& spoil) {
    Performances after = fine;
    spoil(after, after.closed_loop->report);
    EXPECT_EQ(polished_replay_warnings(before, after, false).size(), always ? 1u : 0u);
    const auto warnings = polished_replay_warnings(before, after, true);
    return warnings.empty() ? "nothing" : warnings[0];
  };
  const auto expect_told = [&](const std::string& what, bool always, const std::function<void(Performances&, ReplayReport&)>& spoil) {
    EXPECT_NE(told(always, spoil).find(what), std::string::npos) << what;
  };
  for (const double correction : {4e-4, 8e-4, std::numeric_limits<double>::quiet_NaN()}) {
    expect_told("instead of 0.0004", false, [&](Performances&, ReplayReport& run) { run.correction_rms = correction; });
  }
  expect_told("0.0008 instead", false, [](Performances&, ReplayReport& run) { run.correction_rms = 8e-4; });
  expect_told("0.52 % L from the target by it instead of 0.40", false, [](Performances&, ReplayReport& run) { run.shape_rms_length = 0.0052; });
  expect_told("falls at 3.2 s", true, [](Performances&, ReplayReport& run) { run.fell = true, run.fall_time_s = 3.25; });
  expect_told("diverges at 0.5 s", true, [](Performances& runs, ReplayReport& run) {
    runs.closed_loop->termination = physics::Termination::kDiverged;
    run.duration_s = 0.5;
  });
  expect_told("loses its place", true, [](Performances& runs, ReplayReport&) { runs.lapse = Lapse::kLostWay; });
  expect_told("other feedback", true, [](Performances& runs, ReplayReport&) { runs.feedback.regulator = 1; });
}

TEST(MotionWarnings, TellOfWhatCarriedTheBodyOfAScene) {
  SimulationReport run;
  run.guard_steps = 12;
  run.external_assist_mg = 1e-9;  // of rounding
  EXPECT_TRUE(motion_warnings(run).empty());
  run.external_assist_mg = 2.5;
  ASSERT_EQ(motion_warnings(run).size(), 1U);
  for (const char* word : {"assist: the body is not moved by its scene alone", "12 steps", "2.5 times its weight", "--method euler"}) {
    EXPECT_NE(motion_warnings(run)[0].find(word), std::string::npos) << motion_warnings(run)[0];
  }
}

}  // namespace
}  // namespace hydrostat::retarget::run_warnings_test
