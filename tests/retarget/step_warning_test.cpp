#include "retarget/step_warning.h"

#include <gtest/gtest.h>

#include "tests/physics/lattice_scene.h"

namespace hydrostat::retarget::step_warning_test {
namespace {

constexpr double kDt = 1.0 / 240;  // [s]

/// A bar that is as stiff for its size as one of 1 m and 2e6 Pa.
physics::Scene bar_of(double length, double damping_time) {
  physics::Material material;
  material.youngs_modulus = 2e6 * length;
  material.damping_time = damping_time;
  return physics::in_the_air<3>(physics::bar(4, 1, 1, length / 4, material), true);
}

TEST(ExplicitStepWarning, IsNoneWhereTheStepsAreTaken) {
  EXPECT_EQ(explicit_step_warning<3>(bar_of(1, 0.01), kDt, 0.01), "");
  EXPECT_EQ(explicit_step_warning<3>(bar_of(0.001, 0.01), kDt, 0.01), "");
}

TEST(ExplicitStepWarning, NamesADampingTimeThatDoes) {
  for (const double length : {1e-4, 3e-5}) {
    for (const double damping_time : {0.1, 3.0}) {
      SCOPED_TRACE(std::to_string(length) + " m, " + std::to_string(damping_time) + " s");
      const std::string warning = explicit_step_warning<3>(bar_of(length, damping_time), kDt, damping_time);
      const std::size_t at = warning.find("damping_time_s = ");
      ASSERT_NE(at, std::string::npos) << warning;
      const double named = std::stod(warning.substr(at + 17));
      EXPECT_EQ(explicit_step_warning<3>(bar_of(length, named), kDt, named), "");
      EXPECT_NE(explicit_step_warning<3>(bar_of(length, 3 * named), kDt, 3 * named), "") << "it could be longer";
    }
  }
}

TEST(ExplicitStepWarning, NamesAnotherMethodWhereNoDampingTimeWould) {
  const std::string warning = explicit_step_warning<3>(bar_of(1e-8, 0), kDt, 0);
  EXPECT_NE(warning.find("implicit"), std::string::npos) << warning;
  EXPECT_EQ(warning.find("damping_time_s"), std::string::npos) << warning;
}

}  // namespace
}  // namespace hydrostat::retarget::step_warning_test
