#include "cli/export_option.h"

#include <gtest/gtest.h>

#include "retarget/error.h"
#include "tests/cli/run_program.h"

namespace hydrostat::cli::export_option_test {
namespace {

io::Exports asked(const std::vector<std::string>& words, const io::Exports& otherwise = {}) {
  CLI::App app;
  AskedExport export_options;
  add_export_options(app, export_options, "");
  std::vector<std::string> backward(words.rbegin(), words.rend());
  app.parse(backward);
  return exports_of(export_options, otherwise, "hydrostat replay");
}

TEST(ExportOption, FormatsComeOneByOneOrWithCommasAndTakeThePlaceOfTheOthers) {
  const io::Exports other{.mdd = true, .rate_hz = 24};
  EXPECT_EQ(asked({}), io::Exports());
  EXPECT_EQ(asked({}, other), other);
  EXPECT_EQ(asked({"--export", "obj", "--export", "pc2"}, other), (io::Exports{true, false, true, 24}));
  EXPECT_EQ(asked({"--export=obj,mdd,glb"}), (io::Exports{false, true, true, 60}));
  EXPECT_EQ(asked({"--export", "glb"}, other), (io::Exports{.rate_hz = 24}));
  EXPECT_EQ(asked({"--export-rate", "30"}, other), (io::Exports{.mdd = true, .rate_hz = 30}));
  EXPECT_EQ(asked({"--export", "pc2", "--export-rate", "29.97"}), (io::Exports{.pc2 = true, .rate_hz = 29.97}));
  EXPECT_THROW(asked({"--export-rate", "30"}), UsageError);
  EXPECT_THROW(asked({"--export", "glb", "--export-rate", "30"}, other), UsageError);
}

/// Before anything is read, hence of a clip that is none.
TEST(ExportOption, TellsUsageErrorsOnOneLineWithExitCode2) {
  const TemporaryDirectory directory;
  const auto expect = [&](const std::string& options, const std::string& message) {
    SCOPED_TRACE(options);
    const Outcome outcome = hydrostat_in(directory.path, "convert none.glb -o out " + options);
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_EQ(outcome.err, "hydrostat convert: " + message + "\n");
    EXPECT_EQ(directory.count(), 0u);
  };
  const std::string help = " 'hydrostat convert --help' tells what it takes.";
  expect("--export fbx", "option --export: fbx not in {glb,pc2,mdd,obj}." + help);
  expect("--export pc2 --export-rate 0.5", "option --export-rate: Value 0.5 not in range 1 to 240." + help);
  expect("--export-rate 30",
         "option --export-rate: is a rate of pc2, mdd or obj, none of which is written. Give --export pc2, mdd or obj too, "
         "or leave it out.");
}

}  // namespace
}  // namespace hydrostat::cli::export_option_test
