#include "cli/outcome.h"

#include <gtest/gtest.h>

#include <sstream>

namespace hydrostat::cli::outcome_test {
namespace {

std::string noted(ProgressStyle style, const std::string& told_elsewhere) {
  std::ostringstream out;
  Progress progress(out, style);
  note_warnings(progress, {"assist: of the guard", "level: another keeps it better"}, told_elsewhere);
  return out.str();
}

TEST(NoteWarnings, TellsEachInALineButWhatIsToldElsewhereAndNothingWhereQuiet) {
  const std::string assist = "warning: assist: of the guard\n", level = "warning: level: another keeps it better\n";
  EXPECT_EQ(noted(ProgressStyle::lines, ""), assist + level);
  EXPECT_EQ(noted(ProgressStyle::lines, "level: "), assist);
  EXPECT_EQ(noted(ProgressStyle::silent, ""), "");
}

}  // namespace
}  // namespace hydrostat::cli::outcome_test
