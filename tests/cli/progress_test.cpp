#include "cli/progress.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

namespace hydrostat::cli::progress_test {
namespace {

std::string shown(ProgressStyle style) {
  std::ostringstream out;
  Progress progress(out, style);
  progress.begin("couple");
  for (int percent = 0; percent <= 35; ++percent) progress.reach(percent / 100.0);
  progress.reach(0.1);
  progress.note("a limb is thin");
  progress.end("211 nodes");
  progress.begin("invert");
  progress.begin("replay");
  progress.end();
  progress.end();
  return out.str();
}

TEST(Progress, WritesPlainLinesIntoALog) {
  EXPECT_EQ(shown(ProgressStyle::lines),
            "couple ...\ncouple 10 %\ncouple 20 %\ncouple 30 %\na limb is thin\ncouple: 211 nodes\ninvert ...\ninvert done\n"
            "replay ...\nreplay done\n");
}

TEST(Progress, RedrawsABarInItsLineOnATerminal) {
  const std::string text = shown(ProgressStyle::bar);
  EXPECT_NE(text.find("\r\033[Kcouple [##########....................] 35 %\r\033[Ka limb is thin\n\r\033[Kcouple ["),
            std::string::npos);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 4);  // the note and the end of each stage
}

TEST(Progress, IsSilentWhenQuiet) { EXPECT_EQ(shown(ProgressStyle::silent), ""); }

TEST(Progress, LeavesTheLineOfAStageThatAnExceptionEnds) {
  std::ostringstream out;
  {
    Progress progress(out, ProgressStyle::bar);
    progress.begin("couple");
  }
  EXPECT_EQ(out.str().back(), '\n');
}

}  // namespace
}  // namespace hydrostat::cli::progress_test
