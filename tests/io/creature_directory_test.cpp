#include "io/creature_directory.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <memory>

#include "io/creature_record.h"
#include "io/obj_out.h"
#include "io/write_file.h"
#include "tests/io/refusal.h"
#include "tests/io/temporary_directory.h"

namespace hydrostat::io::creature_directory_test {
namespace {

namespace fs = std::filesystem;
using Start = CreatureWriter::Start;

void make_creature(const fs::path& creature, const std::string& mark) {
  CreatureWriter writer(creature, Start::afresh);
  writer.write("creature.toml", mark);
  writer.write("report.json", mark);
  writer.commit();
}

TEST(CreatureWriter, ShowsNothingUntilTheCreatureIsWhole) {
  const TemporaryDirectory directory;
  const fs::path creature = directory.path / "deep" / "trot";
  {
    CreatureWriter writer(creature, Start::afresh);
    writer.write("creature.toml", "new");
    EXPECT_FALSE(fs::exists(creature));
    writer.commit();
  }
  EXPECT_EQ(read_file(creature / "creature.toml"), "new");
  EXPECT_EQ(std::distance(fs::directory_iterator(creature.parent_path()), fs::directory_iterator()), 1);
}

TEST(CreatureWriter, LeavesTheOldCreatureWhenItIsAbandoned) {
  const TemporaryDirectory directory;
  const fs::path creature = directory.path / "trot";
  make_creature(creature, "old");
  {
    CreatureWriter writer(creature, Start::afresh);
    writer.write("creature.toml", "new");
    write_file(writer.cache_directory() / "body-1.bin", "new");
  }
  EXPECT_EQ(read_file(creature / "creature.toml"), "old");
  EXPECT_FALSE(fs::exists(creature / "cache"));
  EXPECT_EQ(directory.count(), 1U);
}

TEST(CreatureWriter, KeepsTheCacheAndTheUsersFilesAndNoOldResults) {
  const TemporaryDirectory directory;
  const fs::path creature = directory.path / "trot";
  make_creature(creature, "old");
  write_file(creature / "cache" / "body-1.bin", "cached");
  write_file(creature / "notes" / "mine.txt", "my notes");
  const char* const old_results[] = {"replay.glb", "scene.toml", "appearance.bin", "morphs.bin", "path.bin", "wobble.bin", "rig.bin",
                                     "accuracy.csv", "replay.pc2", "replay.mdd", "replay.obj", "replay.mtl", "replay_obj/replay_0001.obj"};
  for (const char* name : old_results) write_file(creature / name, "old");
  {
    CreatureWriter writer(creature, Start::afresh);
    EXPECT_EQ(read_file(writer.cache_directory() / "body-1.bin"), "cached");
    write_file(writer.cache_directory() / "body-1.bin", "cached anew");
    EXPECT_EQ(read_file(creature / "cache" / "body-1.bin"), "cached");
    writer.write("creature.toml", "new");
    writer.commit();
  }
  EXPECT_EQ(read_file(creature / "creature.toml"), "new");
  EXPECT_EQ(read_file(creature / "cache" / "body-1.bin"), "cached anew");
  EXPECT_EQ(read_file(creature / "notes" / "mine.txt"), "my notes");
  for (const char* name : old_results) EXPECT_FALSE(fs::exists(creature / name)) << name;
  EXPECT_FALSE(fs::exists(creature / "report.json"));
  EXPECT_EQ(directory.count(), 1U);
}

/// In the directory of frames too, by whichever way these go.
TEST(CreatureWriter, KeepsTheUsersFilesAmongFrames) {
  const char* const mine[] = {"mine.obj", "replay_0001.blend", "replay_1.obj", "other_0001.obj", "render/replay_0001.obj"};
  const char* const frames[] = {"replay_0001.obj", "replay_0012.obj", "replay.mtl"};
  const auto frame = [](Eigen::Index) { return std::string("new"); };
  for (const Start start : {Start::afresh, Start::amended}) {
    for (const bool exported_anew : {false, true}) {
      const TemporaryDirectory directory;
      const fs::path creature = directory.path / "trot", place = creature / "replay_obj";
      make_creature(creature, "old");
      for (const char* name : mine) write_file(place / name, "mine");
      for (const char* name : frames) write_file(place / name, "old");
      {
        CreatureWriter writer(creature, start);
        writer.write("creature.toml", "new");
        writer.remove("replay_obj");
        if (exported_anew) write_obj_frames(writer.directory() / "replay_obj", "replay", 1, frame, "new");
        for (const char* name : frames) EXPECT_EQ(read_file(place / name), "old");
        writer.commit();
      }
      for (const char* name : mine) EXPECT_EQ(read_file(place / name), "mine") << name;
      for (const char* name : frames) EXPECT_EQ(fs::exists(place / name), exported_anew && name != frames[1]) << name;
      EXPECT_TRUE(!exported_anew || read_file(place / "replay_0001.obj") == "new");
    }
  }
}

TEST(CreatureWriter, TakesADirectoryOfFramesThatIsALinkForALink) {
  const TemporaryDirectory directory;
  const fs::path creature = directory.path / "trot";
  make_creature(creature, "old");
  write_file(directory.path / "elsewhere" / "replay_0001.obj", "old");
  fs::create_directory_symlink(directory.path / "elsewhere", creature / "replay_obj");
  CreatureWriter writer(creature, Start::amended);
  writer.remove("replay_obj");
  writer.commit();
  EXPECT_FALSE(fs::exists(fs::symlink_status(creature / "replay_obj")));
  EXPECT_EQ(read_file(directory.path / "elsewhere" / "replay_0001.obj"), "old");
}

TEST(CreatureWriter, AmendsACreatureAllAtOnce) {
  const TemporaryDirectory directory;
  const fs::path creature = directory.path / "trot";
  make_creature(creature, "old");
  write_file(creature / "replay.glb", "old motion");
  {
    CreatureWriter writer(creature, Start::amended);
    writer.write("report.json", "new");
    writer.remove("replay.glb");
    EXPECT_EQ(read_file(creature / "report.json"), "old");
    EXPECT_TRUE(fs::exists(creature / "replay.glb"));
    writer.commit();
  }
  EXPECT_EQ(read_file(creature / "creature.toml"), "old");
  EXPECT_EQ(read_file(creature / "report.json"), "new");
  EXPECT_FALSE(fs::exists(creature / "replay.glb"));
}

TEST(CreatureWriter, SurvivesBeingKilledAndCleansUpAfterTheDead) {
  const TemporaryDirectory directory;
  const fs::path creature = directory.path / "trot";
  make_creature(creature, "old");
  for (const int signal : {SIGKILL, SIGINT, SIGTERM}) {
    const pid_t child = fork();
    if (child == 0) {
      auto* writer = new CreatureWriter(creature, Start::afresh);
      writer->write("creature.toml", "half");
      raise(signal);
    }
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status));
    EXPECT_EQ(read_file(creature / "creature.toml"), "old");
    EXPECT_EQ(directory.count(), 2U) << "what the one before left was cleaned up";
  }
  make_creature(creature, "new");
  EXPECT_EQ(read_file(creature / "creature.toml"), "new");
  EXPECT_EQ(directory.count(), 1U);
}

TEST(CreatureWriter, LeavesTheLivingAndTheNeighboursAlone) {
  const TemporaryDirectory directory;
  CreatureWriter living(directory.path / "trot", Start::afresh);
  CreatureWriter neighbour(directory.path / "trot2", Start::afresh);
  living.write("creature.toml", "first");
  neighbour.write("creature.toml", "neighbour");
  make_creature(directory.path / "trot", "second");
  EXPECT_EQ(read_file(living.directory() / "creature.toml"), "first");
  EXPECT_EQ(read_file(neighbour.directory() / "creature.toml"), "neighbour");
  living.commit();
  EXPECT_EQ(read_file(directory.path / "trot" / "creature.toml"), "first");
}

TEST(CreatureWriter, BringsBackACreatureThatWaitedAsideForADeadRun) {
  const TemporaryDirectory directory;
  const fs::path creature = directory.path / "trot";
  make_creature(creature, "old");
  fs::rename(creature, directory.path / ".trot.part-abcdef.old");
  EXPECT_NE(refusal([&] { CreatureWriter(directory.path / "none", Start::amended); }).find("holds no creature"),
            std::string::npos);
  CreatureWriter writer(creature, Start::amended);
  EXPECT_EQ(read_file(creature / "creature.toml"), "old");
}

TEST(CreatureWriter, FollowsASymbolicLinkAndATrailingSlash) {
  const TemporaryDirectory directory;
  make_creature(directory.path / "real", "old");
  fs::create_directory_symlink(directory.path / "real", directory.path / "link");
  make_creature(directory.path / "link" / "", "new");
  EXPECT_TRUE(fs::is_symlink(directory.path / "link"));
  EXPECT_EQ(read_file(directory.path / "real" / "creature.toml"), "new");
}

TEST(CreatureWriter, TakesAnEmptyDirectory) {
  const TemporaryDirectory directory;
  fs::create_directory(directory.path / "trot");
  make_creature(directory.path / "trot", "new");
  EXPECT_TRUE(is_creature(directory.path / "trot"));
}

TEST(CreatureWriter, RefusesADirectoryThatIsNoCreature) {
  const TemporaryDirectory directory;
  write_file(directory.path / "home" / "thesis.txt", "years of work");
  const fs::path home = directory.path / "home";
  EXPECT_EQ(refusal([&] { CreatureWriter(home, Start::afresh); }),
            home.string() + "||is no creature but holds 'thesis.txt'|Give a new or an empty directory.");
  EXPECT_EQ(refusal([&] { CreatureWriter(home, Start::amended); }),
            home.string() + "||holds no creature (no creature.toml)|Make one with 'hydrostat convert CLIP -o DIR'.");
  EXPECT_EQ(read_file(home / "thesis.txt"), "years of work");
  EXPECT_EQ(directory.count(), 1U);
}

TEST(CreatureWriter, RefusesASimulationWhereACreatureBelongsAndTheOtherWayRound) {
  const TemporaryDirectory directory;
  using Kind = CreatureWriter::Kind;
  const auto make = [&](const fs::path& place, Kind kind) {
    CreatureRecord record;
    if (kind == Kind::simulation) record.settings = {{"kind", std::string("scene")}};
    CreatureWriter writer(place, Start::afresh, kind);
    writer.write("creature.toml", to_toml(record));
    writer.commit();
  };
  const fs::path creature = directory.path / "trot", simulation = directory.path / "bar";
  make(creature, Kind::creature);
  make(simulation, Kind::simulation);
  EXPECT_EQ(refusal([&] { make(creature, Kind::simulation); }),
            creature.string() + "||holds a creature, which a simulation would replace|Give another directory, or remove this one first.");
  EXPECT_EQ(refusal([&] { make(simulation, Kind::creature); }),
            simulation.string() + "||holds a scene's simulation, which a creature would replace|Give another directory, or remove this one first.");
  make(creature, Kind::creature);
  make(simulation, Kind::simulation);
}

TEST(CreatureWriter, RefusesAFile) {
  const TemporaryDirectory directory;
  const fs::path file = directory.path / "trot";
  write_file(file, "a file");
  EXPECT_EQ(
      refusal([&] { CreatureWriter(file, Start::afresh); }),
      file.string() + "||is a file where a creature's directory belongs|Move the file away, or give another directory.");
  const std::string below = refusal([&] { CreatureWriter(file / "inner", Start::afresh); });
  EXPECT_NE(below.find("the directory cannot be written: Not a directory"), std::string::npos) << below;
  EXPECT_EQ(read_file(file), "a file");
}

TEST(CreatureWriter, RefusesAPlaceThatCannotBeWritten) {
  const std::string told = refusal([] { CreatureWriter("/proc/hydrostat", Start::afresh); });
  EXPECT_NE(told.find("/proc/hydrostat||the directory cannot be written: "), std::string::npos) << told;
}

TEST(CreatureWriter, NamesTheFinalPlaceOfAFileThatCannotBeWritten) {
  const TemporaryDirectory directory;
  CreatureWriter writer(directory.path / "trot", Start::afresh);
  fs::create_directories(writer.directory() / "body.json" / "in the way");
  const std::string told = refusal([&] { writer.write("body.json", "{}"); });
  EXPECT_EQ(told.find((directory.path / "trot" / "body.json").string() + "||cannot be written: Is a directory"), 0U) << told;
}

}  // namespace
}  // namespace hydrostat::io::creature_directory_test
