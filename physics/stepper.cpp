#include "physics/stepper.h"

namespace hydrostat::physics {

std::string name_of(Method method) {
  switch (method) {
    case Method::kExplicit:
      return "explicit";
    case Method::kEuler:
      return "euler";
  }
  return {};
}

template <int Dim>
std::unique_ptr<StepperOf<Dim>> make_stepper(Method method, const SceneOf<Dim>& scene) {
  switch (method) {
    case Method::kExplicit:
      return make_explicit_stepper(scene);
    case Method::kEuler:
      return make_euler_stepper(scene);
  }
  return nullptr;
}

template <int Dim>
ImpulsesOf<Dim> make_impulses(const SceneOf<Dim>& scene) {
  ImpulsesOf<Dim> impulses;
  impulses.contact = PointsOf<Dim>::Zero(Dim, scene.contact_points.count());
  impulses.contact_nodes = impulses.effect_nodes = PointsOf<Dim>::Zero(Dim, scene.body.node_count());
  impulses.contact_moment = impulses.effect_moment = impulses.gravity_moment = SpinOf<Dim>::Zero();
  return impulses;
}

#define HYDROSTAT_INSTANTIATE(Dim)                                                         \
  template std::unique_ptr<StepperOf<Dim>> make_stepper<Dim>(Method, const SceneOf<Dim>&); \
  template ImpulsesOf<Dim> make_impulses<Dim>(const SceneOf<Dim>&);
HYDROSTAT_INSTANTIATE(2)
HYDROSTAT_INSTANTIATE(3)
#undef HYDROSTAT_INSTANTIATE

}  // namespace hydrostat::physics
