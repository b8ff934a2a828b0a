#include "retarget/simulation.h"

#include <gtest/gtest.h>

#include <cmath>

#include "physics/elastic_forces.h"
#include "retarget/accuracy.h"

namespace hydrostat::retarget::simulation_test {
namespace {

using physics::VectorOf;

template <int Dim>
physics::ElementMesh<Dim> of_one_material(const physics::SimplexMeshOf<Dim>& mesh, const physics::ElementMaterial& material) {
  return {mesh.nodes, mesh.simplices, {material}, Eigen::VectorXd::Ones(mesh.simplices.cols())};
}

/// A cube (square) of 0.2 m, its lowest point `height` [m] above the ground.
template <int Dim>
ScenarioOf<Dim> cube_at(double height) {
  ScenarioOf<Dim> scenario;
  const physics::SimplexMeshOf<Dim> mesh =
      physics::mesh_of_box<Dim>(VectorOf<Dim>::Constant(0.2), Eigen::Matrix<int, Dim, 1>::Constant(2));
  scenario.scene.body = make_spring_body<Dim>(of_one_material(mesh, {1000, 2e5, 0.4}), 0.01);
  scenario.scene.body.rest.row(1).array() += 0.1 + height;
  physics::touch_with_whole_surface(scenario.scene);
  scenario.start = {scenario.scene.body.rest, physics::PointsOf<Dim>::Zero(Dim, mesh.nodes.cols())};
  scenario.length = scenario.size = 0.2;
  return scenario;
}

/// The ground bears the weight, and friction holds the sole that bulges under it.
void expect_to_lie(double contact_weights) {
  EXPECT_GT(contact_weights, 0.98);
  EXPECT_LT(contact_weights, std::hypot(1, physics::Ground{}.friction));
}

template <typename Dimension>
class Simulations : public testing::Test {};
using Dimensions = testing::Types<std::integral_constant<int, 2>, std::integral_constant<int, 3>>;
TYPED_TEST_SUITE(Simulations, Dimensions);

TYPED_TEST(Simulations, FallFreelyUntilTheyTouch) {
  constexpr int Dim = TypeParam::value;
  const ScenarioOf<Dim> scenario = cube_at<Dim>(1.0);
  SimulationOptions options;
  options.duration_s = 0.4;
  const Simulation run = simulate(scenario, options);
  const double t = run.course.time_s.tail<1>()[0];
  EXPECT_NEAR(t, 0.4, 1e-12);
  // Symplectic Euler's parabola lies half a substep ahead.
  const double h = physics::make_stepper(options.method, scenario.scene)->substep(options.dt_s);
  EXPECT_NEAR(run.course.com(1, 0) - run.course.com.row(1).tail<1>()[0], 0.5 * 9.81 * t * (t + h), 1e-9);
  EXPECT_EQ(run.course.contact_weights.maxCoeff(), 0);
  EXPECT_LT(run.report.momentum_residual_mg, 1e-10);
  EXPECT_LT(run.report.angular_residual_mgl, 1e-10);
  EXPECT_LT(run.report.energy_excess_mgl, 1e-3);
  EXPECT_LT(run.report.volume_error_max, 1e-9);
  EXPECT_EQ(run.motion.frames.rows(), 3 * scenario.scene.body.node_count());
  EXPECT_NEAR(run.motion.rate_hz, 60, 1e-9);
  EXPECT_EQ(run.motion.count(), 25);
}

TYPED_TEST(Simulations, ComeToRestOnTheGround) {
  constexpr int Dim = TypeParam::value;
  for (const physics::Method method : {physics::Method::kExplicit, physics::Method::kEuler}) {
    SCOPED_TRACE(physics::name_of(method));
    SimulationOptions options;
    options.method = method;
    options.duration_s = 1.5;
    const Simulation run = simulate(cube_at<Dim>(0.02), options);
    expect_to_lie(run.course.contact_weights.tail<1>()[0]);
    EXPECT_LT(run.report.speed_end_m_s, 0.01);
    EXPECT_LT(run.report.momentum_residual_mg, 1e-6);
    EXPECT_LT(run.report.penetration_max_size, 0.02);
    EXPECT_LT(run.report.energy_excess_mgl, 1e-3);
    EXPECT_LT(run.report.energy_end_mgl, run.report.energy_start_mgl);
    EXPECT_EQ(run.report.inverted_elements, 0);
    EXPECT_FALSE(run.report.diverged);
  }
}

TYPED_TEST(Simulations, TraceWhatActs) {
  constexpr int Dim = TypeParam::value;
  ScenarioOf<Dim> scenario = cube_at<Dim>(0.01);
  VectorOf<Dim> sideways = VectorOf<Dim>::Zero();
  sideways[0] = 1.5;
  scenario.pushes = {{0.1, 0.05, sideways}};
  Wave wave;
  wave.share = Eigen::VectorXd::Ones(scenario.scene.body.edge_count());
  wave.phase = Eigen::VectorXd::Zero(scenario.scene.body.edge_count());
  wave.amplitude = 0.1;
  wave.frequency_hz = 2;
  scenario.waves = {wave};
  const double mass = scenario.scene.body.mass.sum();
  for (const int every : {1, 4}) {
    SimulationOptions options;
    options.duration_s = 0.3;
    options.trace = true;
    options.steps_per_row = every;
    const Trace trace = simulate(scenario, options).trace;
    ASSERT_EQ(trace.count(), 72 / every + 1);
    double pushed = 0;
    for (Eigen::Index s = 1; s < trace.count(); ++s) {
      const double dt = trace.time_s[s] - trace.time_s[s - 1];
      const auto sum_of = [&](const Eigen::MatrixXd& rows, Eigen::Index row) -> Eigen::Vector3d {
        return Eigen::Map<const Eigen::Matrix3Xd>(rows.col(row).data(), 3, rows.rows() / 3).rowwise().sum();
      };
      const auto momentum_at = [&](Eigen::Index row) -> Eigen::Vector3d {
        return Eigen::Map<const Eigen::Matrix3Xd>(trace.velocity.col(row).data(), 3, trace.mass_kg.size()) * trace.mass_kg;
      };
      const Eigen::Vector3d force = sum_of(trace.contact_force, s) + sum_of(trace.effect_force, s) - Eigen::Vector3d(0, 9.81 * mass, 0);
      EXPECT_LT(((momentum_at(s) - momentum_at(s - 1)) / dt - force).norm() / (9.81 * mass), 1e-9);
      pushed += dt * sum_of(trace.effect_force, s).x();
      EXPECT_LE((trace.activation.col(s).array() - 1).abs().maxCoeff(), 0.1);
      if (Dim == 2) {
        for (Eigen::Index r = 2; r < trace.position.rows(); r += 3) EXPECT_EQ(trace.position(r, s), 0);
      }
    }
    EXPECT_NEAR(pushed, 1.5 * mass, 1e-9 * mass);
    EXPECT_EQ(trace.elements.rows(), Dim + 1);
  }
}

TYPED_TEST(Simulations, AccountForTheWorkOfActivationsPushesAndPlates) {
  constexpr int Dim = TypeParam::value;
  ScenarioOf<Dim> scenario = cube_at<Dim>(0.0);
  scenario.scene.body.edge_damping.setZero();  // so that nothing is lost but in contact
  scenario.scene.has_ground = false;
  scenario.scene.gravity.setZero();
  scenario.pushes = {{0.0, 0.1, VectorOf<Dim>::Ones()}};
  Wave wave;
  wave.share = Eigen::VectorXd::Ones(scenario.scene.body.edge_count());
  wave.phase = Eigen::VectorXd::Zero(scenario.scene.body.edge_count());
  wave.amplitude = 0.05;
  wave.frequency_hz = 1;
  scenario.waves = {wave};
  SimulationOptions options;
  options.dt_s = 1.0 / 2000;  // the energy of symplectic Euler errs with the substep
  options.duration_s = 1;
  const Simulation run = simulate(scenario, options);
  const SimulationReport& report = run.report;
  EXPECT_GT(report.work_mgl, 0.1);
  EXPECT_NEAR(report.energy_end_mgl - report.energy_start_mgl, report.work_mgl, 0.01 * report.work_mgl);
  EXPECT_LT(report.energy_excess_mgl, 0.01 * report.work_mgl);
}

TYPED_TEST(Simulations, MoveTheirObstaclesForAWhile) {
  constexpr int Dim = TypeParam::value;
  ScenarioOf<Dim> scenario = cube_at<Dim>(0.0);
  physics::ObstacleOf<Dim> plate;
  plate.shape = physics::HalfSpace{};
  plate.place = 0.25 * VectorOf<Dim>::UnitY();
  plate.turn = -physics::BlockOf<Dim>::Identity();
  if (Dim == 3) plate.turn.row(2) *= -1;
  scenario.scene.obstacles = {plate};
  scenario.moves = {{0, 0.1, 0.6, -0.2 * VectorOf<Dim>::UnitY()}, {0, 0.8, 0.9, VectorOf<Dim>::UnitY()}};
  SimulationOptions options;
  options.method = physics::Method::kEuler;
  options.duration_s = 1.2;
  const Simulation run = simulate(scenario, options);
  ASSERT_EQ(run.obstacle_travels.size(), 1U);
  const Eigen::RowVectorXd height = run.obstacle_travels[0].frames.row(1);
  EXPECT_NEAR(height[42], -0.1, 1e-9);  // at 0.7 s
  EXPECT_NEAR(height[72], 0.0, 1e-9);
  EXPECT_GT(run.course.contact_weights[42], 1.5);
  EXPECT_GT(run.report.work_mgl, 0.01);
  EXPECT_LT(run.report.energy_excess_mgl, 0.01 * run.report.work_mgl);
  expect_to_lie(run.course.contact_weights[72]);
}

TYPED_TEST(Simulations, HoldWhatIsClampedUntilItIsLetGo) {
  constexpr int Dim = TypeParam::value;
  for (const physics::Method method : {physics::Method::kExplicit, physics::Method::kEuler}) {
    SCOPED_TRACE(physics::name_of(method));
    ScenarioOf<Dim> scenario = cube_at<Dim>(1.0);
    Clamp top, corner{{0}, 0.5};
    for (int i = 0; i < scenario.scene.body.node_count(); ++i) {
      if (scenario.scene.body.rest(1, i) > 1.199) top.nodes.push_back(i);
    }
    top.until_s = 0.5;
    scenario.clamps = {top, corner};
    hold_at(scenario.clamps, 0, scenario.scene.body.held);
    EXPECT_EQ(scenario.scene.body.held.size(), top.nodes.size() + 1);
    SimulationOptions options;
    options.method = method;
    options.duration_s = 0.7;
    options.trace = true;
    const Simulation run = simulate(scenario, options);
    EXPECT_LT(run.report.momentum_residual_mg, 1e-6);
    EXPECT_LT(run.report.energy_excess_mgl, 0.01);
    const Eigen::Index release = 120;  // at 0.5 s
    for (const int node : top.nodes) {
      EXPECT_EQ(run.trace.position.col(release).segment(3 * node, 3), run.trace.position.col(0).segment(3 * node, 3));
      EXPECT_EQ(run.trace.effect_force.col(release + 1).segment(3 * node, 3).norm(), 0);
    }
    // It hangs still by then, and what holds it bears its weight.
    double held = 0;
    for (Eigen::Index r = 1; r < run.trace.effect_force.rows(); r += 3) held += run.trace.effect_force(r, release);
    EXPECT_NEAR(held / (9.81 * scenario.scene.body.mass.sum()), 1, 0.02);
    EXPECT_NEAR(run.course.com(1, 30) - run.course.com.row(1).tail<1>()[0], 0.5 * 9.81 * 0.04, 0.01);
  }
}

TYPED_TEST(Simulations, ThatDivergeSayWhenAndKeepWhatCameBefore) {
  constexpr int Dim = TypeParam::value;
  ScenarioOf<Dim> scenario = cube_at<Dim>(1.0);
  scenario.start.v.row(0).setConstant(1e200);  // no number holds its square
  SimulationOptions options;
  options.trace = true;
  const Simulation run = simulate(scenario, options);
  EXPECT_TRUE(run.report.diverged);
  EXPECT_NE(run.report.diverged_cause.find("'explicit'"), std::string::npos);
  EXPECT_LT(run.report.duration_s, options.duration_s);
  EXPECT_GE(run.motion.count(), 1);
  EXPECT_TRUE(run.motion.frames.allFinite());
  EXPECT_TRUE(run.trace.velocity.allFinite());
  EXPECT_EQ(run.trace.count(), std::lround(run.report.duration_s / options.dt_s) + 1);
}

TYPED_TEST(Simulations, TellEveryEffectWithItsReason) {
  constexpr int Dim = TypeParam::value;
  ScenarioOf<Dim> scenario = cube_at<Dim>(0.0);
  const auto of = [](const std::vector<EffectReport>& effects, const std::string& name) {
    for (const EffectReport& effect : effects) {
      if (effect.name == name) return effect;
    }
    ADD_FAILURE() << name;
    return EffectReport{};
  };
  const std::vector<EffectReport> effects = effects_of(scenario, {});
  EXPECT_EQ(effects.size(), 13U);
  for (const EffectReport& effect : effects) EXPECT_FALSE(effect.reason.empty()) << effect.name;
  EXPECT_EQ(of(effects, "ground").state, "on");
  EXPECT_GT(of(effects, "damping").ms_per_sim_s, 0);
  EXPECT_EQ(of(effects, "pushes").state, "off");
  scenario.scene.has_ground = false;
  EXPECT_EQ(of(effects_of(scenario, {}), "ground").state, "off");
  EXPECT_EQ(of(effects_of(scenario, {}), "friction").state, "off");
}

TYPED_TEST(Simulations, ErrLessTheShorterTheStep) {
  constexpr int Dim = TypeParam::value;
  const ScenarioOf<Dim> scenario = cube_at<Dim>(1.0);  // it falls freely
  SimulationOptions options;
  options.method = physics::Method::kEuler;
  options.duration_s = 0.3;
  const double coarse = estimated_error(scenario, options).error_length;
  options.dt_s /= 4;
  EXPECT_GT(coarse, 1e-5);
  EXPECT_LT(estimated_error(scenario, options).error_length, 0.6 * coarse);
}

/// A block of a material, evenly strained, holds the energy that Hooke's law gives: the mean over many directions.
TYPED_TEST(Simulations, SpringsHaveTheStiffnessOfTheirMaterial) {
  constexpr int Dim = TypeParam::value;
  const physics::ElementMaterial material{1000, 3e5, 0.4};
  const physics::SimplexMeshOf<Dim> mesh =
      physics::mesh_of_ball<Dim>(1, 8);  // edges in many directions
  const physics::BodyOf<Dim> body = make_spring_body<Dim>(of_one_material(mesh, material), 0);
  const physics::Lame lame = physics::lame_of(material.youngs_modulus, material.poissons_ratio);
  const Eigen::VectorXd passive = Eigen::VectorXd::Ones(body.edge_count());
  constexpr double kStrain = 1e-5;
  double shear = 0, stretch = 0;
  for (int a = 0; a < Dim; ++a) {
    for (int b = 0; b < Dim; ++b) {
      physics::BlockOf<Dim> gradient = physics::BlockOf<Dim>::Identity();
      if (a == b) {
        gradient(a, a) += kStrain;
        stretch += physics::elastic_energy<Dim>(body, gradient * body.rest, passive) / Dim;
      } else {
        gradient(a, b) = gradient(b, a) = kStrain / 2;
        shear += physics::elastic_energy<Dim>(body, gradient * body.rest, passive) / (Dim * (Dim - 1));
      }
    }
  }
  const double unit = 0.5 * kStrain * kStrain * body.rest_volume.sum();
  EXPECT_NEAR(shear / (lame.mu * unit), 1, 0.15);
  EXPECT_NEAR(stretch / ((lame.lambda + 2 * lame.mu) * unit), 1, 0.1);
}

}  // namespace
}  // namespace hydrostat::retarget::simulation_test
