#include "io/batch_results.h"

#include <gtest/gtest.h>

#include "io/write_file.h"
#include "tests/io/refusal.h"
#include "tests/io/temporary_directory.h"

namespace hydrostat::io::batch_results_test {
namespace {

std::vector<BatchResult> example() {
  return {{"trot", "/c/trot.fbx", "/o/trot", "done", 0, 12.5, "", "ab", "cd", {{"cycles", 15}, {"shape_rms_length", 0.01}}, {"high", "\"far\""}},
          {"odd, \"name\"", "/c/odd.fbx", "/o/odd", "refused", 1, 0.5, "no\xff skeleton", "ef", "", {}, {}}};
}

TEST(BatchResults, ComeBackAsTheyWereWritten) {
  const TemporaryDirectory directory;
  write_file(directory.path / "r.json", batch_results_json(example()));
  const std::vector<BatchResult> back = read_batch_results(directory.path / "r.json");
  ASSERT_EQ(back.size(), 2U);
  EXPECT_EQ(back[0].name, "trot");
  EXPECT_EQ(back[0].seconds, 12.5);
  EXPECT_EQ(back[0].settings, "ab");
  EXPECT_EQ(back[0].report_sha256, "cd");
  EXPECT_EQ(back[0].figures, example()[0].figures);
  EXPECT_EQ(back[0].warnings, example()[0].warnings);
  EXPECT_EQ(back[1].exit_code, 1);
  EXPECT_EQ(back[1].state, "refused");
  EXPECT_EQ(back[1].message, "no\xEF\xBF\xBD skeleton");
  EXPECT_TRUE(read_batch_results(directory.path / "none.json").empty());
}

TEST(BatchResults, MakeATableThatASpreadsheetReads) {
  EXPECT_EQ(batch_results_csv(example()),
            "name,clip,out,state,exit_code,seconds,cycles,shape_rms_length,clip_shape_rms_length,drift_per_cycle_length,"
            "heading_deg_per_cycle,travel_per_cycle_length,clip_travel_per_cycle_length,slip_per_stance_length,warnings,message\r\n"
            "\"trot\",\"/c/trot.fbx\",\"/o/trot\",\"done\",0,12.5,15,0.01,,,,,,,2,\"\"\r\n"
            "\"odd, \"\"name\"\"\",\"/c/odd.fbx\",\"/o/odd\",\"refused\",1,0.5,,,,,,,,,0,\"no\xff skeleton\"\r\n");
}

TEST(BatchResults, TakeTheClosedLoopsFiguresFromTheReport) {
  const TemporaryDirectory directory;
  EXPECT_TRUE(read_batch_figures(directory.path).empty());
  write_file(directory.path / "report.json",
             R"({"replay": {"naive": {"cycles": 1}, "closed_loop": {"cycles": 15, "fell": true}}})");
  EXPECT_EQ(read_batch_figures(directory.path), (std::map<std::string, double>{{"cycles", 15}}));
  write_file(directory.path / "report.json", "cut sh");
  EXPECT_TRUE(read_batch_figures(directory.path).empty());
}

TEST(BatchResults, TakeTheWarningsFromTheReport) {
  const TemporaryDirectory directory;
  EXPECT_TRUE(read_batch_warnings(directory.path).empty());
  write_file(directory.path / "report.json", R"({"warnings": ["one", "two"]})");
  EXPECT_EQ(read_batch_warnings(directory.path), (std::vector<std::string>{"one", "two"}));
  for (const char* text : {"cut sh", "{}", R"({"warnings": 3})"}) {
    write_file(directory.path / "report.json", text);
    EXPECT_TRUE(read_batch_warnings(directory.path).empty()) << text;
  }
}

/// Of a program that did not tell of them.
TEST(BatchResults, MayLackTheWarnings) {
  const TemporaryDirectory directory;
  std::string text = batch_results_json({example()[1]});
  const std::size_t begin = text.find(",\n   \"warnings\": []");
  ASSERT_NE(begin, std::string::npos) << text;
  write_file(directory.path / "r.json", text.erase(begin, text.find(']', begin) + 1 - begin));
  EXPECT_EQ(read_batch_results(directory.path / "r.json").size(), 1U);
}

TEST(BatchResults, RefuseAFileThatIsNone) {
  const TemporaryDirectory directory;
  const std::filesystem::path file = directory.path / "r.json";
  for (const char* text :
       {"", "[]", R"({"schema": "hydrostat.batch/9", "results": []})", R"({"schema": "hydrostat.batch/1"})"}) {
    SCOPED_TRACE(text);
    write_file(file, text);
    EXPECT_EQ(refusal([&] { read_batch_results(file); }),
              file.string() + "||is not a results file of hydrostat batch|Remove it, or run without --resume.");
  }
}

}  // namespace
}  // namespace hydrostat::io::batch_results_test
