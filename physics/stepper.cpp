#include "physics/stepper.h"

namespace hydrostat::physics {

std::string name_of(Method method) {
  switch (method) {
    case Method::kExplicit:
      return "explicit";
    case Method::kEuler:
      return "euler";
    case Method::kImplicit:
      return "implicit";
  }
  return {};
}

template <int Dim>
std::unique_ptr<StepperOf<Dim>> make_stepper(Method method, const SceneOf<Dim>& scene) {
  switch (method) {
    case Method::kExplicit:
      return make_guarded_stepper(scene, make_explicit_stepper(scene));
    case Method::kEuler:
      return make_euler_stepper(scene);
    case Method::kImplicit:
      return make_guarded_stepper(scene, make_implicit_stepper(scene));
  }
  return nullptr;
}

template std::unique_ptr<StepperOf<2>> make_stepper<2>(Method, const SceneOf<2>&);
template std::unique_ptr<StepperOf<3>> make_stepper<3>(Method, const SceneOf<3>&);

}  // namespace hydrostat::physics
