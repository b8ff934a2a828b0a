#include "cli/convert_options.h"

#include <gtest/gtest.h>

namespace hydrostat::cli::convert_options_test {
namespace {

bool is_polished(const std::string& polish, const std::string& grade, bool leaps_on) {
  ConvertOptions options;
  options.polish = polish;
  options.accuracy.grade = grade;
  return wants_polish(options, leaps_on);
}

TEST(WantsPolish, AsItIsToldAndElseByTheGrade) {
  for (const char* grade : {"", "draft", "standard", "final"}) {
    for (const bool leaps_on : {false, true}) {
      EXPECT_TRUE(is_polished("on", grade, leaps_on));
      EXPECT_FALSE(is_polished("off", grade, leaps_on));
    }
  }
  EXPECT_TRUE(is_polished("auto", "standard", false));
  EXPECT_TRUE(is_polished("auto", "final", false));
  EXPECT_FALSE(is_polished("auto", "draft", false));
}

TEST(WantsPolish, LeavesAHopAsItWasSolvedWhereNobodyAsks) {
  for (const char* grade : {"standard", "final"}) EXPECT_FALSE(is_polished("auto", grade, true));
}

}  // namespace
}  // namespace hydrostat::cli::convert_options_test
