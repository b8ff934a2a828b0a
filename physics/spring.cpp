#include "physics/element_constraint.h"
#include "physics/springs_alone.h"
#include "physics/stepper.h"

namespace hydrostat::physics {
namespace {

constexpr double kMostSubsteps = 1e5;  // of a step: nothing else takes over

template <int Dim>
SceneOf<Dim> with_springs_alone(const SceneOf<Dim>& scene) {
  SceneOf<Dim> result = scene;
  result.body = springs_alone(scene.body);
  return result;
}

/// Springs and dashpots along edges, stepped like the explicit method: the cheapest of all, for drafts.
///
/// Linear and angular momentum change by the booked impulses alone, to rounding. Volumes and elements are left out, so that
/// nothing but the springs' own stiffness resists a change of volume: a strongly loaded tet may turn inside out and stay so.
/// Source: Provot, "Deformation constraints in a mass-spring model to describe rigid cloth behavior", Graphics Interface 1995, section 2,
/// for springs alone; Van Gelder, "Approximate simulation of elastic membranes by triangulated spring meshes", Journal of Graphics Tools
/// 3(2), 1998, for stiffness that goes with an element's measure over the square of the edge's length.
template <int Dim>
class SpringStepper final : public StepperOf<Dim> {
 public:
  explicit SpringStepper(const SceneOf<Dim>& scene)
      : scene_(scene), springs_(with_springs_alone(scene)), stepper_(make_explicit_stepper(springs_, kMostSubsteps)) {}

  double substep(double dt) const override { return stepper_->substep(dt); }

  StepWork work() const override { return stepper_->work(); }

  void forget() override { stepper_->forget(); }

  Termination step(double dt, const Eigen::VectorXd& activation, const PointsOf<Dim>* effect_force, StateOf<Dim>& state,
                   ImpulsesOf<Dim>& impulses) override {
    for (std::size_t n = 0; n < springs_.obstacles.size(); ++n) {  // their owner may have changed them
      springs_.obstacles[n].velocity = scene_.obstacles[n].velocity;
    }
    return stepper_->step(dt, activation, effect_force, state, impulses);
  }

 private:
  const SceneOf<Dim>& scene_;
  SceneOf<Dim> springs_;
  std::unique_ptr<StepperOf<Dim>> stepper_;
};

}  // namespace

template <int Dim>
BodyOf<Dim> springs_alone(const BodyOf<Dim>& body) {
  BodyOf<Dim> springs = body;
  springs.volume_stiffness.resize(0);
  springs.elements.clear();
  for (const BodyElements<Dim>& elements : body.elements) {
    const Eigen::MatrixXi& edges = elements.fit.of_element;
    for (Eigen::Index e = 0; e < edges.cols(); ++e) {
      const double modulus = youngs_modulus_times_volume(elements.block, static_cast<int>(e));
      for (Eigen::Index p = 0; p < edges.rows(); ++p) {
        const double length = body.rest_length[edges(p, e)];
        springs.edge_stiffness[edges(p, e)] += kEdgesPerTet<Dim> * modulus / (static_cast<double>(edges.rows()) * length * length);
      }
    }
  }
  return springs;
}
template BodyOf<2> springs_alone<2>(const BodyOf<2>&);
template BodyOf<3> springs_alone<3>(const BodyOf<3>&);

template <int Dim>
std::unique_ptr<StepperOf<Dim>> make_spring_stepper(const SceneOf<Dim>& scene) {
  return std::make_unique<SpringStepper<Dim>>(scene);
}
template std::unique_ptr<StepperOf<2>> make_spring_stepper<2>(const SceneOf<2>&);
template std::unique_ptr<StepperOf<3>> make_spring_stepper<3>(const SceneOf<3>&);

}  // namespace hydrostat::physics
