#include "io/stage_records.h"

#include <gtest/gtest.h>

#include "retarget/error.h"
#include "tests/retarget/box_performer.h"

namespace hydrostat::io::stage_records_test {
namespace {

TEST(StageRecords, GivePerformancesBackToTheBit) {
  const retarget::Performer performer = retarget::make_box_performer();
  retarget::PerformOptions options;
  options.replay.duration_s = 0.1;
  options.baselines = false;
  retarget::Performances runs = retarget::perform(performer, retarget::signals_of(performer), options);
  runs.feedback = {4, 0.5, 1.5};
  runs.lapse = retarget::Lapse::kLostWay;
  runs.wished_lapse = retarget::Lapse::kFell;
  const auto read = result_of<retarget::Performances>(record_of(runs));
  EXPECT_EQ(read.feedback, runs.feedback);
  EXPECT_EQ(read.lapse, runs.lapse);
  EXPECT_EQ(read.wished_lapse, runs.wished_lapse);
  EXPECT_FALSE(read.naive || read.open_loop);
  ASSERT_TRUE(read.closed_loop);
  EXPECT_EQ(read.closed_loop->motion.frames, runs.closed_loop->motion.frames);
  EXPECT_EQ(read.closed_loop->course.com, runs.closed_loop->course.com);
  EXPECT_EQ(read.closed_loop->course.patch_state, runs.closed_loop->course.patch_state);
  EXPECT_EQ(packed(record_of(read), "", ""), packed(record_of(runs), "", ""));
}

TEST(StageRecords, GiveACharacterBackToTheBit) {
  const retarget::BoxCreature box = retarget::make_box_creature();
  ImportedCharacter imported;
  imported.character.skeleton = box.skeleton;
  imported.character.skin.vertices = box.scene.body.rest;
  imported.character.skin.skin_weights.assign(static_cast<std::size_t>(box.scene.body.node_count()), {{0, 0.25}, {3, 0.75}});
  imported.character.clip.name = "Walk";
  imported.character.clip.bone_pose.assign(3, box.skeleton.bind_pose);
  imported.warnings = {"one", "another"};
  const auto read = result_of<ImportedCharacter>(record_of(imported));
  EXPECT_EQ(read.warnings, imported.warnings);
  EXPECT_EQ(read.character.skeleton.names, imported.character.skeleton.names);
  EXPECT_EQ(read.character.skeleton.weighted, imported.character.skeleton.weighted);
  EXPECT_EQ(read.character.skin.skin_weights[5][1].bone, 3);
  EXPECT_EQ(read.character.skin.skin_weights[5][1].weight, 0.75);
  EXPECT_EQ(read.character.clip.bone_pose[2][4].matrix(), imported.character.clip.bone_pose[2][4].matrix());
  EXPECT_EQ(packed(record_of(read), "", ""), packed(record_of(imported), "", ""));
}

TEST(StageRecords, GiveABodyOfElementsBackToTheBit) {
  for (const retarget::BoxCreature& box : retarget::element_box_creatures()) {
    retarget::Creature creature;
    creature.scene = box.scene;
    creature.is_mirror_image = true;
    const auto read = result_of<retarget::Creature>(record_of(creature));
    EXPECT_TRUE(read.is_mirror_image);
    ASSERT_EQ(read.scene.body.elements.size(), 1U);
    EXPECT_EQ(read.scene.body.elements[0].fit.of_element, box.scene.body.elements[0].fit.of_element);
    EXPECT_EQ(read.scene.body.elements[0].block.law, box.scene.body.elements[0].block.law);
    EXPECT_EQ(packed(record_of(read), "", ""), packed(record_of(creature), "", ""));
  }
}

TEST(TargetFile, ComesBackWholeOrNotAtAll) {
  PerformedTarget target;
  target.performer = retarget::make_box_performer();
  target.performer.prepared.support_friction = 0.6;
  target.performer.prepared.firmness = 7;
  target.performer.prepared.ends.last = true;
  target.report.source.clip = "Walk";
  target.report.warnings = {"told"};
  const std::string bytes = target_bytes(target);
  const PerformedTarget read = parse_target(bytes, "target.bin");
  EXPECT_EQ(read.performer.prepared.target.frames, target.performer.prepared.target.frames);
  EXPECT_EQ(read.performer.prepared.support_friction, 0.6);
  EXPECT_EQ(read.performer.prepared.firmness, 7);
  EXPECT_FALSE(read.performer.prepared.ends.first);
  EXPECT_TRUE(read.performer.prepared.ends.last);
  EXPECT_EQ(read.performer.prepared.contacts.state, target.performer.prepared.contacts.state);
  EXPECT_EQ(read.performer.muscles.fields, target.performer.muscles.fields);
  EXPECT_EQ(read.report.source.clip, "Walk");
  EXPECT_EQ(read.report.warnings, target.report.warnings);
  EXPECT_EQ(target_bytes(read), bytes);
  for (const std::size_t place : {std::size_t{3}, bytes.size() / 2, bytes.size() - 1}) {
    std::string damaged = bytes;
    damaged[place] = static_cast<char>(damaged[place] ^ 1);
    EXPECT_THROW(parse_target(damaged, "target.bin"), Error);
    EXPECT_THROW(parse_target(bytes.substr(0, place), "target.bin"), Error);
  }
}

TEST(RigFile, ComesBackWholeOrNotAtAll) {
  const retarget::BoxCreature box = retarget::make_box_creature();
  const Eigen::Index nodes = box.scene.body.node_count(), vertices = nodes;
  retarget::Rig rig{box.skeleton, {box.scene.body.rest, {}, {}}, box.bone_weights};
  rig.skin.skin_weights.assign(static_cast<std::size_t>(vertices), {{0, 0.25}, {3, 0.75}});
  rig.skin.triangles.resize(3, 1);
  rig.skin.triangles << 0, 1, 2;
  const std::string bytes = rig_bytes(rig);
  EXPECT_EQ(rig_bytes(parse_rig(bytes, "rig.bin", nodes, vertices)), bytes);
  EXPECT_THROW(parse_rig(bytes, "rig.bin", nodes + 1, vertices), Error) << "of another body";
  EXPECT_THROW(parse_rig(bytes, "rig.bin", nodes, vertices - 1), Error);
  for (const std::size_t place : {std::size_t{3}, bytes.size() / 2, bytes.size() - 1}) {
    std::string damaged = bytes;
    damaged[place] = static_cast<char>(damaged[place] ^ 1);
    EXPECT_THROW(parse_rig(damaged, "rig.bin", nodes, vertices), Error);
    EXPECT_THROW(parse_rig(bytes.substr(0, place), "rig.bin", nodes, vertices), Error);
  }
  const auto refused = [&](const char* what, const auto& spoil) {
    retarget::Rig spoilt = rig;
    spoil(spoilt);
    EXPECT_THROW(parse_rig(rig_bytes(spoilt), "rig.bin", nodes, vertices), Error) << what;
  };
  refused("parents", [](retarget::Rig& spoilt) { spoilt.skeleton.parents[0] = 1; });
  refused("triangles", [](retarget::Rig& spoilt) { spoilt.skin.triangles(0, 0) = -1; });
  refused("bone", [](retarget::Rig& spoilt) { spoilt.skin.skin_weights[0][0].bone = 99; });
  refused("vertex", [](retarget::Rig& spoilt) { spoilt.skin.skin_weights.push_back({{0, 1.0}}); });
}

}  // namespace
}  // namespace hydrostat::io::stage_records_test
