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

std::unique_ptr<Stepper> make_stepper(Method method, const Scene& scene) {
  switch (method) {
    case Method::kExplicit:
      return make_explicit_stepper(scene);
    case Method::kEuler:
      return make_euler_stepper(scene);
  }
  return nullptr;
}

Impulses make_impulses(const Scene& scene) {
  Impulses impulses;
  impulses.contact = Eigen::Matrix3Xd::Zero(3, scene.contact_points.count());
  impulses.contact_nodes = impulses.effect_nodes = Eigen::Matrix3Xd::Zero(3, scene.body.node_count());
  impulses.contact_moment = impulses.effect_moment = impulses.gravity_moment = Eigen::Vector3d::Zero();
  return impulses;
}

}  // namespace hydrostat::physics
