#include "cli/number_option.h"

#include <gtest/gtest.h>

#include "retarget/error.h"

namespace hydrostat::cli::number_option_test {
namespace {

TEST(NumberOption, TakesFiniteNumbersWithinItsRangeAlone) {
  const CLI::Validator validator = number_within(0.5, 2);
  for (const std::string good : {"0.5", "1", "2", "1e0"}) EXPECT_EQ(validator(good), "") << good;
  for (const std::string bad : {"0.4", "2.1", "nan", "inf", "-1", "", "1x", "one"}) {
    EXPECT_EQ(validator(bad), "Value " + bad + " not in range 0.5 to 2");
    EXPECT_THROW(parse_number(bad, 0.5, 2, "hydrostat test", "--it"), UsageError);
  }
  EXPECT_EQ(parse_number("1.25", 0.5, 2, "hydrostat test", "--it"), 1.25);
}

}  // namespace
}  // namespace hydrostat::cli::number_option_test
