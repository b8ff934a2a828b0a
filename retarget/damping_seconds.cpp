#include "retarget/damping_seconds.h"

#include <cmath>

#include "physics/dashpot_stages.h"
#include "physics/elastic_forces.h"
#include "retarget/cpu_seconds.h"

namespace hydrostat::retarget {

template <int Dim>
double damping_seconds(const physics::SceneOf<Dim>& scene, physics::Method method, double dt, const physics::StateOf<Dim>& state) {
  const physics::BodyOf<Dim>& body = scene.body;
  physics::PointsOf<Dim> force = physics::PointsOf<Dim>::Zero(Dim, body.node_count());
  const auto seconds_of_a_pass = [&] { return seconds_of([&] { physics::add_damping_forces<Dim>(body, state.x, state.v, force); }); };
  if (method != physics::Method::kExplicit && method != physics::Method::kSpring) return seconds_of_a_pass();
  const auto stepper = method == physics::Method::kSpring ? physics::make_spring_stepper(scene) : physics::make_explicit_stepper(scene);
  physics::StateOf<Dim> moved = state;
  physics::ImpulsesOf<Dim> impulses = physics::make_impulses(scene);
  stepper->step(dt, Eigen::VectorXd::Ones(body.edge_count()), nullptr, moved, impulses);
  const physics::StepWork work = stepper->work();
  if (work.stages == 0) return seconds_of_a_pass();
  const auto stages = static_cast<int>(std::round(work.stages / work.passes));
  physics::DashpotStages<Dim> dashpots(body);
  return seconds_of([&] { dashpots.add_mean_forces(state.x, state.v, dt / work.passes, stages, force); });
}

template double damping_seconds<2>(const physics::SceneOf<2>&, physics::Method, double, const physics::StateOf<2>&);
template double damping_seconds<3>(const physics::SceneOf<3>&, physics::Method, double, const physics::StateOf<3>&);

}  // namespace hydrostat::retarget
