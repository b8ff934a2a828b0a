#include "retarget/run_warnings.h"

#include <gtest/gtest.h>

#include "tests/retarget/box_performer.h"

namespace hydrostat::retarget::run_warnings_test {
namespace {

TEST(TargetWarnings, SayNothingOfATargetThatLacksNothing) {
  const Performer performer = make_box_performer();
  EXPECT_TRUE(target_warnings(performer.prepared, performer.scene.body, 0.1, true).empty());
}

TEST(TargetWarnings, NameFrameAndPatchesOfTheMissingWrench) {
  Performer performer = make_box_performer();
  performer.prepared.missing_wrench(1, 7) = 0.2;
  performer.prepared.contacts.state[0][7] = ContactState::kOff;
  const auto warnings = target_warnings(performer.prepared, performer.scene.body, 0.1, true);
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_EQ(warnings[0].find("contact cannot give all that the motion needs: 0.20 mg are missing at frame 7, standing on 'back_left', "
                             "'front_right', 'front_left'"),
            0U)
      << warnings[0];
  for (auto& states : performer.prepared.contacts.state) states[7] = ContactState::kOff;
  EXPECT_NE(target_warnings(performer.prepared, performer.scene.body, 0.1, true)[0].find("frame 7, in flight"), std::string::npos);
}

TEST(TargetWarnings, TellOfAClipThatNeedsFarMoreThanTheLimit) {
  const Performer performer = make_box_performer();  // bobs by 3 %
  const auto warnings = target_warnings(performer.prepared, performer.scene.body, 0.015, false);
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_EQ(warnings[0], "the clip bends and stretches constraints by 3 %, the limit allows 2 %: expect a smaller motion; give a higher --limit");
  EXPECT_TRUE(target_warnings(performer.prepared, performer.scene.body, 0.025, false).empty());
}

TEST(InverseWarnings, ComeOnePerFigureThatIsTooLarge) {
  InverseReport report;
  EXPECT_TRUE(inverse_warnings(report).empty());
  report.saturated = 0.06;
  report.miss_rms_length = 4e-4;
  report.root_residual_mg = 0.02;
  EXPECT_EQ(inverse_warnings(report).size(), 3U);
}

TEST(FeedbackWarnings, TellOfCalmerFeedbackAlone) {
  Performances performances;
  EXPECT_TRUE(feedback_warnings(performances).empty());
  performances.effort = 16;
  EXPECT_EQ(feedback_warnings(performances), std::vector<std::string>{"feedback: it keeps up only where effort is 16 times as dear as usual"});
}

}  // namespace
}  // namespace hydrostat::retarget::run_warnings_test
