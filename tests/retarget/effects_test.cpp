#include "retarget/effects.h"

#include <gtest/gtest.h>

#include <map>

#include "tests/retarget/box_performer.h"

namespace hydrostat::retarget::effects_test {
namespace {

std::map<std::string, EffectReport> effects(const ReplayOptions& options) {
  std::map<std::string, EffectReport> by_name;
  for (const EffectReport& effect : effects_of(make_box_performer(), options)) by_name[effect.name] = effect;
  return by_name;
}

TEST(EffectsOf, CostOnlyWhereTheyAreOn) {
  for (const auto& [name, effect] : effects({})) {
    SCOPED_TRACE(name);
    EXPECT_FALSE(effect.reason.empty());
    ASSERT_TRUE(effect.state == "on" || effect.state == "off");
    EXPECT_TRUE(effect.state == "on" || effect.ms_per_sim_s == 0);
  }
}

TEST(EffectsOf, MeasureWhatTheSolverDoes) {
  const auto found = effects({});
  for (const char* name : {"gravity", "volume", "damping", "embedding"}) {
    EXPECT_EQ(found.at(name).state, "on");
    EXPECT_GT(found.at(name).ms_per_sim_s, 0) << name;
  }
}

TEST(EffectsOf, PushesAreOnWhereTheyAreAskedFor) {
  EXPECT_EQ(effects({}).at("pushes").state, "off");
  ReplayOptions options;
  options.pushes.push_back({1, 0.1, Eigen::Vector3d::UnitX()});
  EXPECT_EQ(effects(options).at("pushes").state, "on");
  EXPECT_GT(effects(options).at("pushes").ms_per_sim_s, 0);
}

}  // namespace
}  // namespace hydrostat::retarget::effects_test
