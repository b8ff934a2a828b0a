#include "io/clip_range.h"

#include <gtest/gtest.h>

#include <utility>

#include "retarget/error.h"

namespace hydrostat::io::clip_range_test {
namespace {

SceneClip clip_of(const std::string& name, std::vector<double> times, double duration_s) {
  Channel channel;
  channel.translation = {
      Interpolation::kLinear, times, Eigen::MatrixXd::Zero(3, static_cast<Eigen::Index>(times.size())), {}, {}};
  channel.scale = {Interpolation::kLinear, {0}, Eigen::Vector3d::Ones(), {}, {}};
  return {name, duration_s, {channel}};
}

Scene three_clips() {
  Scene scene;
  scene.clips = {clip_of("Armature|rest", {0.5}, 0), clip_of("Armature|walk", {0.25, 0.5, 1.25}, 1.25),
                 clip_of("2", {0, 1}, 1)};
  return scene;
}

TEST(RangeOf, GoesFromFirstToLastKeyOfWhatMoves) {
  const ClipRange range = range_of(three_clips().clips[1]);
  EXPECT_EQ(range.start_s, 0.25);
  EXPECT_EQ(range.end_s, 1.25);
  EXPECT_EQ(range.key_rate_hz, 2);
  EXPECT_EQ(range_of(three_clips().clips[0]).length_s(), 0);
}

TEST(RangeOf, StaysWithinTheTake) {
  const ClipRange range = range_of(clip_of("take", {-0.1, 0.5, 3}, 2));
  EXPECT_EQ(range.start_s, 0);
  EXPECT_EQ(range.end_s, 2);
}

TEST(Cut, CountsFromTheFirstKeyAndKeepsTheRate) {
  const ClipRange whole{0.25, 1.25, 24};
  const ClipRange part = cut(whole, 0.5, 0.75, "file", "clip 'walk'");
  EXPECT_EQ(part.start_s, 0.75);
  EXPECT_EQ(part.end_s, 1.0);
  EXPECT_EQ(part.key_rate_hz, 24);
  const ClipRange rest = cut(whole, 0.5, {}, "file", "clip 'walk'");
  EXPECT_EQ(rest.end_s, 1.25);
  const ClipRange odd{0.0416, 4.9583, 24};  // whole is whole, to the bit
  EXPECT_EQ(cut(odd, 0, {}, "file", "clip 'walk'").end_s, odd.end_s);
  EXPECT_EQ(cut(whole, 0, 1.0004, "file", "clip 'walk'").end_s, 1.25);  // as info prints it, rounded
}

TEST(Cut, RefusesWhatLiesOutsideOrLeavesNothing) {
  for (const auto& [from, to] : {std::pair{0.5, 0.5}, {0.7, 0.2}, {0.2, 1.5}, {2.0, 3.0}}) {
    try {
      cut({0.25, 1.25, 24}, from, to, "spider.gltf", "clip 'all'");
      ADD_FAILURE() << from << " " << to;
    } catch (const Error& error) {
      EXPECT_EQ(error.where, "clip 'all'");
      EXPECT_NE(error.mend.find("within its 1 s"), std::string::npos) << error.mend;
    }
  }
}

TEST(ChooseClip, TakesNameOrPartBehindTheArmatureOrIndex) {
  const Scene scene = three_clips();
  EXPECT_EQ(choose_clip(scene, "", "file"), 1u);  // the first that moves
  EXPECT_EQ(choose_clip(scene, "Armature|walk", "file"), 1u);
  EXPECT_EQ(choose_clip(scene, "walk", "file"), 1u);
  EXPECT_EQ(choose_clip(scene, "1", "file"), 1u);
  EXPECT_EQ(choose_clip(scene, "2", "file"), 2u);  // a name before an index
}

TEST(ChooseClip, RefusesWhatDoesNotMoveAndListsWhatDoes) {
  const Scene scene = three_clips();
  for (const char* wanted : {"rest", "0", "gallop", "3", "-1"}) {
    try {
      choose_clip(scene, wanted, "file");
      ADD_FAILURE() << wanted;
    } catch (const Error& error) {
      EXPECT_NE(error.mend.find("1 'Armature|walk'"), std::string::npos) << error.mend;
    }
  }
  Scene none;
  EXPECT_THROW(choose_clip(none, "", "file"), Error);
  Scene endless;
  endless.clips = {clip_of("endless", {0, 4000}, 4000)};
  EXPECT_THROW(choose_clip(endless, "", "file"), Error);
}

}  // namespace
}  // namespace hydrostat::io::clip_range_test
