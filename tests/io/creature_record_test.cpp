#include "io/creature_record.h"

#include <gtest/gtest.h>

#include <limits>
#include <map>

#include "io/load_creature.h"
#include "io/write_file.h"
#include "tests/io/refusal.h"
#include "tests/io/temporary_directory.h"

namespace hydrostat::io::creature_record_test {
namespace {

CreatureRecord example() {
  return {"/clips/big \"dog\"\\trot.fbx",
          "00ff",
          "Armature|Tröt\n",
          0.125,
          {{"nodes", std::int64_t{200}},
           {"limit", "auto"},
           {"height", 0.1},
           {"a key with spaces", 1.0},
           {"open-loop", false},
           {"seed", std::int64_t{-1}}},
          {{"ground", "on", "the clip touches it in 30 of 40 frames"}, {"water", "off", "the scene has none"}}};
}

std::string refusal_of(const std::string& text) {
  const TemporaryDirectory directory;
  write_file(directory.path / "creature.toml", text);
  return refusal([&] { read_creature_record(directory.path); });
}

TEST(CreatureRecord, ComesBackAsItWasWritten) {
  const TemporaryDirectory directory;
  const CreatureRecord record = example();
  write_file(directory.path / "creature.toml", to_toml(record));
  const CreatureRecord back = read_creature_record(directory.path);
  EXPECT_EQ(back.source_file, record.source_file);
  EXPECT_EQ(back.source_sha256, record.source_sha256);
  EXPECT_EQ(back.clip, record.clip);
  EXPECT_EQ(back.clip_rise_m, record.clip_rise_m);
  EXPECT_EQ(back.settings, record.settings);
  ASSERT_EQ(back.effects.size(), 2U);
  EXPECT_EQ(back.effects[0].name, "ground");
  EXPECT_EQ(back.effects[1].state, "off");
  EXPECT_EQ(back.effects[1].reason, "the scene has none");
  EXPECT_EQ(to_toml(back), to_toml(record));
}

TEST(CreatureRecord, WritesNumbersAsShortAsTheyReadBackTheSame) {
  const TemporaryDirectory directory;
  const std::vector<std::pair<double, std::string>> numbers{
      {0.1, "0.1"}, {3, "3.0"}, {-1e-300, "-1e-300"}, {std::numeric_limits<double>::infinity(), "inf"}};
  for (const auto& [number, text] : numbers) {
    CreatureRecord record;
    record.settings = {{"x", number}};
    EXPECT_NE(to_toml(record).find("\nx = " + text + "\n"), std::string::npos) << to_toml(record);
    write_file(directory.path / "creature.toml", to_toml(record));
    EXPECT_EQ(read_creature_record(directory.path).settings.at(0).second, CreatureRecord::Setting(number));
  }
}

TEST(CreatureRecord, GivesFeedbackBackAndTellsNothingOfTheUsual) {
  const TemporaryDirectory directory;
  for (const retarget::Feedback& feedback : {retarget::Feedback(), {16, 1, 1}, {1, 0.6, 4.0 / 3}, {3, 0.5, 10.0 / 3}, {1, 1, 1, 1e-3}}) {
    CreatureRecord record = example();
    put_feedback(feedback, record);
    write_file(directory.path / "creature.toml", to_toml(record));
    const CreatureRecord back = read_creature_record(directory.path);
    EXPECT_EQ(feedback_of(back), feedback);
    for (const auto& [name, factor] : std::map<std::string, double>{
             {"corrector_effort", feedback.effort}, {"corrector_horizon", feedback.horizon}, {"corrector_root_weight", feedback.root_weight}}) {
      EXPECT_EQ(setting(back, name, 0.0), factor == 1 ? 0 : factor) << name;
    }
    EXPECT_EQ(setting(back, "corrector_regulator", -1.0), feedback.regulator == 0 ? -1 : feedback.regulator);
  }
}

TEST(CreatureRecord, NamesTheLineOfWhatIsWrong) {
  const std::string broken = refusal_of("schema = \"hydrostat.creature/1\"\n[source\n");
  EXPECT_NE(broken.find("creature.toml|line 2|"), std::string::npos) << broken;
  EXPECT_NE(broken.find("|Make the creature again with 'hydrostat convert'."), std::string::npos) << broken;

  const std::string other = refusal_of("\nschema = \"hydrostat.creature/9\"\n");
  EXPECT_NE(other.find("|line 2|schema is 'hydrostat.creature/9', not 'hydrostat.creature/1'|"), std::string::npos) << other;

  const std::string without = refusal_of("schema = \"hydrostat.creature/1\"\n[source]\nfile = \"a\"\n[settings]\n");
  EXPECT_NE(without.find("|line 2|a text 'sha256' is missing|"), std::string::npos) << without;

  std::string wordy_text = to_toml(example());
  wordy_text.replace(wordy_text.find("clip_rise_m = 0.125"), 19, "clip_rise_m = \"high\"");
  const std::string wordy = refusal_of(wordy_text);
  EXPECT_NE(wordy.find("a number 'clip_rise_m' is missing|"), std::string::npos) << wordy;

  const std::string no_source = refusal_of("schema = \"hydrostat.creature/1\"\n");
  EXPECT_NE(no_source.find("|the table [source] is missing|"), std::string::npos) << no_source;

  std::string odd_text = to_toml(example());
  odd_text.insert(odd_text.find("nodes"), "odd = [1]\n");
  const std::string odd = refusal_of(odd_text);
  EXPECT_NE(odd.find("setting 'odd' is neither number, text nor true or false|"), std::string::npos) << odd;
}

TEST(CreatureRecord, SettingsThatACreatureCannotGoByAreRefused) {
  using Setting = CreatureRecord::Setting;
  const auto told = [](const std::string& name, const Setting& value) {
    CreatureRecord record = example();
    record.settings = {{name, value}};
    return refusal([&] { check_settings(record, "trot/creature.toml"); });
  };
  EXPECT_EQ(told("method", "foo"),
            "trot/creature.toml|setting 'method'|is 'foo', where one of explicit, implicit, euler, xpbd, spring belongs|Mend the value, or make the creature "
            "again with 'hydrostat convert'.");
  EXPECT_NE(told("corrector_effort", "abc").find("|is 'abc', where a number above 0 and at most 1e6 belongs|"), std::string::npos);
  for (const char* name : {"corrector_effort", "corrector_horizon", "corrector_root_weight"}) {
    EXPECT_NE(told(name, 0.0).find(std::string("|setting '") + name + "'|is 0.0, where a number above 0"), std::string::npos);
  }
  EXPECT_NE(told("corrector_regulator", -1.0).find("is -1.0, where a number from 0"), std::string::npos);
  EXPECT_NE(told("step_s", std::numeric_limits<double>::quiet_NaN()).find("is nan, where"), std::string::npos);
  EXPECT_NE(told("seed", 1.5).find("is 1.5, where a whole number"), std::string::npos);
  EXPECT_NE(told("wobble", std::int64_t{1}).find("is 1, where one of auto, on, off"), std::string::npos);
  for (const char* words : {"", "glb", "pc2,glb", "mdd,pc2", "pc2,pc2", "pc2, mdd", "pc2,"}) {
    EXPECT_NE(told("export", std::string(words)).find("where a list of pc2, mdd and obj, in this order"), std::string::npos) << words;
  }
  EXPECT_NE(told("export", true).find("is true, where a list"), std::string::npos);
  EXPECT_NE(told("export-rate", 0.5).find("is 0.5, where a number from 1 to 240 belongs"), std::string::npos);
  EXPECT_NE(told("calibrated", "yes").find("is 'yes', where true or false"), std::string::npos);

  CreatureRecord sound = example();
  sound.settings = {{"method", std::string("xpbd")}, {"corrector_effort", std::int64_t{4}}, {"step_s", 1.0 / 120}, {"seed", std::int64_t{0}}, {"limit", std::string("auto")},
                    {"export", std::string("pc2,obj")}, {"export-rate", std::int64_t{24}}};
  check_settings(sound, "trot/creature.toml");
}

TEST(CreatureRecord, GivesExportsBackAndTellsNothingOfNone) {
  CreatureRecord record = example();
  const auto before = record.settings;
  EXPECT_EQ(exports_of(record), Exports());
  put_exports({.rate_hz = 30}, record);
  EXPECT_EQ(record.settings, before);
  for (const Exports& exports : {Exports{.pc2 = true}, Exports{.mdd = true, .obj = true, .rate_hz = 29.97}, Exports{true, true, true, 240}}) {
    put_exports(exports, record);
    EXPECT_EQ(record.settings.size(), before.size() + 2) << "in the place of those before";
    EXPECT_EQ(exports_of(record), exports);
  }
  put_exports({}, record);
  EXPECT_EQ(record.settings, before);
}

TEST(CreatureRecord, RefusesADirectoryWithoutOne) {
  const TemporaryDirectory directory;
  const std::string told = refusal([&] { read_creature_record(directory.path); });
  EXPECT_NE(told.find("creature.toml||cannot be read"), std::string::npos) << told;
}

}  // namespace
}  // namespace hydrostat::io::creature_record_test
