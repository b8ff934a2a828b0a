#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/cli/run_program.h"

namespace hydrostat::cli::compare_test {
namespace {

/// A disc in the plane, simulated by three methods for 1.5 s.
class Compare : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    directory_ = std::make_unique<TemporaryDirectory>();
    for (const char* method : {"explicit", "implicit", "xpbd"}) {
      const Outcome outcome =
          hydrostat_in(directory_->path, "simulate '" HYDROSTAT_SAMPLES "/scenes/bouncing_circle.toml' -o " +
                                             std::string(method) + " --duration 1.5 --quiet --method " + method);
      ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    }
  }
  static void TearDownTestSuite() { directory_.reset(); }
  static Outcome compare(const std::string& arguments) { return hydrostat_in(directory_->path, "compare " + arguments); }

  static inline std::unique_ptr<TemporaryDirectory> directory_;
};

TEST_F(Compare, HoldsMotionsAgainstTheFirstInTableJsonAndPage) {
  const Outcome told = compare("explicit implicit/ xpbd/report.html -o page.html");
  ASSERT_EQ(told.exit_code, 0) << told.err;
  EXPECT_EQ(told.err, "");
  for (const char* text : {"accuracy.method", "implicit: its skin is away from that of explicit by ", "xpbd: its skin"}) {
    EXPECT_NE(told.out.find(text), std::string::npos) << text << "\n" << told.out;
  }
  EXPECT_EQ(std::system(("bash '" HYDROSTAT_TESTS "/page.sh' '" + (directory_->path / "page.html").string() + "'").c_str()),
            0);
  const Outcome json_told = compare("explicit implicit xpbd --json");
  const auto json = nlohmann::json::parse(json_told.out);
  EXPECT_EQ(json["schema"], "hydrostat.comparison/1");
  ASSERT_EQ(json["runs"].size(), 3U);
  EXPECT_EQ(json["runs"][2]["figures"]["accuracy.method"], "xpbd");
  EXPECT_EQ(json["runs"][2]["name"], "xpbd");
  // A softer stand-in strays farther than another accurate method.
  EXPECT_GT(json["distances"][1]["shape_rms_length"], json["distances"][0]["shape_rms_length"]);
  EXPECT_GT(json["distances"][0]["rms_length"], 0);
  EXPECT_EQ(compare("explicit implicit xpbd --json").out, json_told.out);
}

TEST_F(Compare, RefusesWhatCannotBeCompared) {
  const auto expect = [](const std::string& arguments, int exit_code, const std::string& message) {
    const Outcome outcome = compare(arguments);
    EXPECT_EQ(outcome.exit_code, exit_code) << arguments;
    EXPECT_EQ(outcome.out, "") << arguments;
    EXPECT_EQ(outcome.err, message + "\n") << arguments;
  };
  expect("explicit", 2, "hydrostat compare: command line: there is nothing to compare with. Name two creatures or more.");
  expect("explicit ./explicit/", 2, "hydrostat compare: command line: './explicit/' is named twice. Name different ones.");
  expect("explicit xpbd -o page.png", 2,
         "hydrostat compare: option --out: 'page.png' does not end with .html. The comparison is written as a page.");
  expect("explicit xpbd -o xpbd/report.html", 2,
         "hydrostat compare: option --out: 'xpbd/report.html' is one of the pages that are compared. Name another file.");
  expect("explicit absent", 1,
         "absent: is no creature and no report page. Make one with 'hydrostat convert' or 'hydrostat simulate'.");
  std::filesystem::copy(directory_->path / "xpbd", directory_->path / "bare", std::filesystem::copy_options::recursive);
  std::filesystem::remove(directory_->path / "bare" / "report.html");
  expect("explicit bare", 1,
         "bare/report.html: is missing. Make it again with 'hydrostat replay' ('simulate' for a scene).");
  EXPECT_FALSE(std::filesystem::exists(directory_->path / "page.png"));
}

TEST_F(Compare, NamesRunsByWhatTellsThemApart) {
  for (const char* place : {"a", "b"}) {
    std::filesystem::create_directory(directory_->path / place);
    std::filesystem::copy(directory_->path / "xpbd", directory_->path / place / "disc",
                          std::filesystem::copy_options::recursive);
  }
  const auto json = nlohmann::json::parse(compare("explicit a/disc b/disc --json").out);
  EXPECT_EQ(json["runs"][0]["name"], "explicit");
  EXPECT_EQ(json["runs"][1]["name"], "a/disc");
  EXPECT_EQ(json["runs"][2]["name"], "b/disc");
  EXPECT_EQ(json["distances"][0]["rms_length"], json["distances"][1]["rms_length"]);
}

}  // namespace
}  // namespace hydrostat::cli::compare_test
