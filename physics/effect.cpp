#include "physics/effect.h"

#include "physics/fluid.h"

namespace hydrostat::physics {

template <int Dim>
std::vector<std::unique_ptr<EffectOf<Dim>>> plan_effects(const SceneOf<Dim>& scene) {
  std::vector<std::unique_ptr<EffectOf<Dim>>> plan;
  if (scene.water) plan.push_back(std::make_unique<FluidEffect<Dim>>(scene, *scene.water));
  if (scene.air) plan.push_back(std::make_unique<FluidEffect<Dim>>(scene, *scene.air));
  return plan;
}
template std::vector<std::unique_ptr<EffectOf<2>>> plan_effects<2>(const SceneOf<2>&);
template std::vector<std::unique_ptr<EffectOf<3>>> plan_effects<3>(const SceneOf<3>&);

}  // namespace hydrostat::physics
