#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "io/import_worker.h"
#include "io/write_file.h"
#include "tests/io/import_case.h"
#include "tests/io/temporary_directory.h"
#include "tests/sanitizers.h"

namespace hydrostat::io::info_command_test {
namespace {

using namespace import_case;

std::string written(const std::filesystem::path& file, const std::string& text) {
  write_file(file, text);
  return file.string();
}

TEST(InfoCommand, TellsTheSchemaOfTheContract) {
  const Outcome outcome = run("info " + kSamples + "/boxdog_trot.fbx --json");
  ASSERT_EQ(outcome.exit_code, 0);
  const nlohmann::json json = nlohmann::json::parse(outcome.text);
  EXPECT_EQ(json.at("schema"), "hydrostat.info/1");
  EXPECT_EQ(json.at("format"), "fbx");
  EXPECT_DOUBLE_EQ(json.at("metres_per_unit"), 0.01);
  EXPECT_EQ(json.at("up"), "y");
  EXPECT_TRUE(json.at("meshes").at(0).at("skinned"));
  EXPECT_EQ(json.at("meshes").at(0).at("triangles"), 3390);
  for (const char* field : {"name", "parent", "weighted"}) EXPECT_TRUE(json.at("bones").at(0).contains(field)) << field;
  const nlohmann::json& clip = json.at("clips").at(0);
  for (const char* field : {"index", "name", "duration_s", "range_s", "rate_hz", "loop", "in_place", "speed_m_s"}) {
    EXPECT_TRUE(clip.contains(field)) << field;
  }
  EXPECT_EQ(clip.at("bbox").at(1).at("fraction"), 0.15);
  EXPECT_EQ(clip.at("bbox").at(1).at("min").size(), 3u);
  EXPECT_TRUE(json.at("warnings").is_array());
}

TEST(InfoCommand, RefusesBadInputWithOneSentenceAndExitCodeOne) {
  const TemporaryDirectory directory;
  const std::string prose = written(directory.path / "notes.fbx", "This is no clip.\n");
  const std::vector<std::pair<std::string, std::string>> refused{
      {(directory.path / "missing.glb").string(), "there is no such file"},
      {prose, "it cannot be read"},
      {written(directory.path / "notes.glb", "This is no clip.\n"), "no whole glTF"},
      {written(directory.path / "empty.fbx", ""), "it is empty"},
      {written(directory.path / "notes.txt", "This is no clip.\n"), "no known kind of clip file"}};
  for (const auto& [path, what] : refused) {
    const Outcome outcome = run("info '" + path + "'");
    EXPECT_EQ(outcome.exit_code, 1) << path;
    EXPECT_EQ(outcome.text.find(path + ": "), 0u) << outcome.text;
    EXPECT_NE(outcome.text.find(what), std::string::npos) << outcome.text;
    EXPECT_EQ(std::count(outcome.text.begin(), outcome.text.end(), '\n'), 1) << outcome.text;
  }
}

TEST(InfoCommand, OfADirectoryTellsARowForEachFile) {
  const Outcome table = run("info " + kSamples);
  EXPECT_EQ(table.exit_code, 0);
  EXPECT_EQ(std::count(table.text.begin(), table.text.end(), '\n'), 4) << table.text;
  const TemporaryDirectory directory;
  EXPECT_NE(run("info '" + directory.path.string() + "'").text.find("holds no clip file"), std::string::npos);
  written(directory.path / "notes.glb", "This is no clip.\n");
  const Outcome refused = run("info --json '" + directory.path.string() + "'");
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_NE(nlohmann::json::parse(refused.text).at("files").at(0).at("error").get<std::string>().find("no whole glTF"),
            std::string::npos);
}

TEST(InfoCommand, TellsWhatAnAnimatorAsks) {
  const FileInfo trot = inspect(kSamples + "/boxdog_trot.fbx");
  const ClipInfo& clip = trot.clips.front();
  EXPECT_LT(clip.closure_defect_length, 0.001);
  EXPECT_GT(clip.max_strain, 0.2);
  EXPECT_LT(clip.max_strain, 0.35);  // legs that stand side by side do not pull at each other
  ASSERT_EQ(clip.contacts.size(), 4u);  // its paws
  std::map<std::string, double> lifts_s;
  for (const ContactInfo& contact : clip.contacts) {
    EXPECT_GT(contact.duty, 0.56) << contact.bone;  // as it was made, and it lifts its feet gently
    EXPECT_LT(contact.duty, 0.72) << contact.bone;
    EXPECT_LE(contact.times_s.size(), 2u) << contact.bone;  // one stance, perhaps over the loop's end
    lifts_s[contact.bone] = contact.times_s.front().second;
  }
  EXPECT_NEAR(lifts_s["FL_foot"], lifts_s["BR_foot"], 0.03);
  EXPECT_NEAR(lifts_s["FR_foot"], lifts_s["BL_foot"], 0.03);
  EXPECT_EQ(trot.unit_reason, "the file's UnitScaleFactor");
}

TEST(InfoCommand, TheSizeOfAnotherUnitIsToldWithTheUnit) {
  const FileInfo large = inspect(kSamples + "/worm_crawl.glb", {.metres_per_unit = 100});
  EXPECT_EQ(large.unit_reason, "as --unit says");
  ASSERT_FALSE(large.warnings.empty());
  const std::string& warning = large.warnings.back();
  EXPECT_NE(warning.find("44.4 m long"), std::string::npos) << warning;
  EXPECT_NE(warning.find("if the file's unit were 1 m it would be 0.444 m"), std::string::npos) << warning;
}

TEST(InfoCommand, SegmentsThatNoTriangleJoinsAskForStrainAtTheirJoints) {
  if (assets().empty()) GTEST_SKIP();
  EXPECT_GT(inspect(assets() + "/gltf/spider_animated.gltf").clips.at(0).max_strain, 0.2);
  EXPECT_GT(inspect(assets() + "/bvh/jumping_jacks.bvh").clips.at(0).max_strain, 0.2);
}

TEST(InfoCommand, TheLargestFilesTakeLittleTimeAndMemory) {
  if (assets().empty() || kSanitized) GTEST_SKIP();
  for (const auto& [file, most_s] : {std::pair{"fbx/alien_14_clips.fbx", 3.0}, {"bvh/cmu_01_03_long.bvh", 2.0}}) {
    rusage before{}, after{};
    getrusage(RUSAGE_CHILDREN, &before);
    EXPECT_EQ(run("info '" + assets() + "/" + file + "'").exit_code, 0);
    getrusage(RUSAGE_CHILDREN, &after);
    const auto seconds = [](const timeval& time) {
      return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
    };
    EXPECT_LT(seconds(after.ru_utime) + seconds(after.ru_stime) - seconds(before.ru_utime) - seconds(before.ru_stime),
              most_s)
        << file;
    EXPECT_LT(after.ru_maxrss, 300 << 10) << file;  // [KiB] of the largest of its processes
  }
}

TEST(InfoCommand, ASkeletonStandsOnTheFeetThatAConversionGivesIt) {
  if (assets().empty()) GTEST_SKIP();
  const FileInfo jacks = inspect(assets() + "/bvh/jumping_jacks.bvh");
  double left = 0, right = 0;
  for (const ContactInfo& contact : jacks.clips.at(0).contacts) {
    double& most = contact.bone.starts_with("Left") ? left : right;
    most = std::max(most, contact.duty);
  }
  EXPECT_GT(std::min(left, right), 0.2) << "jumping jacks stand on both feet";
}

TEST(InfoCommand, UnitAndAxisOfTheUserStand) {
  const std::string path = kSamples + "/worm_crawl.glb";
  const FileInfo as_is = inspect(path), turned = inspect(path, {.up = "z", .metres_per_unit = 2});
  const BoxInfo &a = as_is.clips[0].bbox[0], &b = turned.clips[0].bbox[0];
  EXPECT_LT((2 * Eigen::Vector3d(a.min.x(), a.min.z(), -a.max.y()) - b.min).norm(), 1e-9);
  EXPECT_LT((2 * Eigen::Vector3d(a.max.x(), a.max.z(), -a.min.y()) - b.max).norm(), 1e-9);
  EXPECT_EQ(turned.up, "z");
}

TEST(InfoCommand, TheReaderSeesNothingElseAndIsHeldToItsLimits) {
  const FileInfo info = inspect(kSamples + "/worm_crawl.glb");
  EXPECT_TRUE(info.network_confined);  // Landlock is the kernel's choice, seccomp is in all
  const Outcome slow = run("info " + kSamples + "/boxdog_trot.fbx --import-memory 0.1");
  EXPECT_EQ(slow.exit_code, 2);
}

TEST(InfoCommand, RefusesAnUnknownOptionWithExitCodeTwo) {
  EXPECT_EQ(run("info " + kSamples + "/worm_crawl.glb --jsn").exit_code, 2);
  EXPECT_EQ(run("info").exit_code, 2);
}

}  // namespace
}  // namespace hydrostat::io::info_command_test
