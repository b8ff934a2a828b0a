#include "cli/number_option.h"

#include <gtest/gtest.h>

#include <functional>
#include <string>

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

TEST(NumberOption, OfAShareOrATimeTakesItsUnitAndTellsItsRangeInIt) {
  const auto refused = [](const std::function<double()>& parse) {
    try {
      return std::to_string(parse());
    } catch (const UsageError& error) {
      return error.where + ": " + error.what() + ". " + error.mend;
    }
  };
  for (const std::string good : {"1%", "1 %", "1  %", "0.01", "1e-2"}) EXPECT_EQ(parse_share(good, "hydrostat test", "--it"), 0.01) << good;
  for (const std::string bad : {"1", "60%", "1 %x", "0%", "%", " %", "", "nan", "-1%", "1e-8", "0,5%"}) {
    EXPECT_EQ(refused([&] { return parse_share(bad, "hydrostat test", "--it"); }),
              "option --it: '" + bad + "' is no share of L from 1e-07 to 0.5, or from 0.00001% to 50%. Write it like 1% or 0.01.");
  }
  for (const std::string good : {"2ms", "2 ms", "2", "2.0ms"}) EXPECT_EQ(parse_milliseconds(good, 0.5, 10, "hydrostat test", "--it"), 2) << good;
  for (const std::string bad : {"2s", "0.4ms", "11", "ms", "soon", "nanms"}) {
    EXPECT_EQ(refused([&] { return parse_milliseconds(bad, 0.5, 10, "hydrostat test", "--it"); }),
              "option --it: '" + bad + "' is no time from 0.5 to 10 ms. Write it like 2ms.");
  }
}

}  // namespace
}  // namespace hydrostat::cli::number_option_test
