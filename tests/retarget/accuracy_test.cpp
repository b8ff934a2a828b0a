#include "retarget/setting_choice.h"

#include <gtest/gtest.h>

#include <cmath>
#include <ctime>
#include <optional>
#include <random>
#include <utility>

#include "physics/element_body.h"
#include "retarget/step_cost.h"
#include "tests/sanitizers.h"

namespace hydrostat::retarget::accuracy_test {
namespace {

using Scenario = ScenarioOf<2>;

/// A plate in the plane, of springs or of finite elements, drawn from a seed: its size, stuff, start and what it meets.
Scenario plate(unsigned seed) {
  std::mt19937 random(seed);
  const auto within = [&](double low, double high) {
    return low + (high - low) * (static_cast<double>(random()) / 4294967295.0);
  };
  const physics::SimplexMeshOf<2> mesh = physics::mesh_of_box<2>({within(0.3, 0.8), within(0.15, 0.3)}, {5, 2});
  const physics::ElementMesh<2> elements{mesh.nodes,
                                         mesh.simplices,
                                         {{1000, std::pow(10, within(4.5, 6)), within(0.3, 0.45)}},
                                         Eigen::VectorXd::Ones(mesh.simplices.cols())};
  const double damping = within(0, 0.01);
  Scenario scenario;
  scenario.scene.body =
      random() % 2 == 0
          ? make_spring_body<2>(elements, damping)
          : physics::make_body<2>(elements, physics::ElementBodyOptions{physics::ElasticLaw::kStableNeoHookean, 0, damping});
  scenario.scene.has_ground = random() % 2 == 0;
  scenario.scene.self_contact.is_on = seed % 3 == 0;  // it never touches itself: that changes nothing
  scenario.scene.body.rest.row(1).array() += within(0.16, 0.3);
  physics::touch_with_whole_surface(scenario.scene);
  scenario.start = {scenario.scene.body.rest, physics::PointsOf<2>::Zero(2, mesh.nodes.cols())};
  const double turn = within(-3, 3), fast = within(-1, 1);
  const Eigen::Vector2d centre = scenario.scene.body.rest.rowwise().mean();
  for (Eigen::Index i = 0; i < mesh.nodes.cols(); ++i) {
    const Eigen::Vector2d arm = scenario.start.x.col(i) - centre;
    scenario.start.v.col(i) = Eigen::Vector2d(fast - turn * arm.y(), turn * arm.x());
  }
  scenario.length = (mesh.nodes.rowwise().maxCoeff() - mesh.nodes.rowwise().minCoeff()).maxCoeff();
  scenario.size = physics::size_of_volume<2>(scenario.scene.body.rest_volume.sum());
  return scenario;
}

/// How far a setting is from a motion eight times as fine, in windows that the estimate has not seen [per L].
double true_error(const Scenario& scenario, AccuracyOptions options, const StepSetting& setting) {
  options.fineness = 8;
  options.windows += 3;
  const ReferenceOf<2> truth = make_reference(scenario, options, false);
  return measure_error(truth, scenario, setting).error_rel_length;
}

AccuracyOptions short_motion() {
  AccuracyOptions options;
  options.duration_s = 0.5;
  options.windows = 4;
  return options;
}

TEST(Accuracy, ReferenceIsWhatASecondMethodFinds) {
  for (unsigned seed = 1; seed <= trials(5u); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Scenario scenario = plate(seed);
    const ReferenceOf<2> reference = make_reference(scenario, short_motion());
    EXPECT_LT(reference.uncertainty_m() / scenario.length, 0.01);
    EXPECT_EQ(reference.windows.size() > 1, scenario.scene.has_ground);
    EXPECT_NE(reference.setting.method, reference.check.method);
    // It errs by what it says when its own step is tried against it.
    const AccuracyRow own = measure_error(reference, scenario, reference.setting);
    EXPECT_EQ(own.error_rms_m, 0);
    EXPECT_TRUE(own.stable);
  }
}

TEST(Accuracy, ShorterStepsErrLess) {
  const Scenario scenario = plate(2);
  const ReferenceOf<2> reference = make_reference(scenario, short_motion(), false);
  double last = 1;
  for (const double dt_s : {1.0 / 30, 1.0 / 120, 1.0 / 480}) {
    const double error = measure_error(reference, scenario, {physics::Method::kEuler, dt_s}).error_rms_m;
    EXPECT_LT(error, 0.6 * last);
    last = error;
  }
}

TEST(Accuracy, IsWithinTwiceTheEstimateInNineOfTen) {
  int within = 0, all = 0;
  for (unsigned seed = 100; seed < 100 + trials(10u); ++seed) {
    const Scenario scenario = plate(seed);
    const StepChoice choice =
        choose_setting(make_reference(scenario, short_motion(), false), 0.01 * scenario.length, std::nullopt);
    const double error = true_error(scenario, short_motion(), choice.setting);
    within += error <= 2 * choice.estimated_error_m / scenario.length;
    ++all;
    EXPECT_LT(error, 0.02) << "seed " << seed;
    EXPECT_TRUE(choice.is_met) << "seed " << seed;
  }
  EXPECT_GE(within, 0.9 * all);
}

/// Where nobody asked for a bound the estimate is made from few runs.
TEST(Accuracy, OfAGivenSettingIsWithinTwiceItsEstimateInNineOfTen) {
  int within = 0, all = 0;
  for (unsigned seed = 200; seed < 200 + trials(10u); ++seed) {
    const Scenario scenario = plate(seed);
    SimulationOptions options;
    options.duration_s = 0.5;
    options.dt_s = 1.0 / 120;
    options.method = physics::kMethods[seed % 4];  // `spring` is another body
    const double estimate = estimated_error(scenario, options).error_length;
    const double error = true_error(scenario, short_motion(), {options.method, options.dt_s});
    within += error <= 2 * estimate;
    ++all;
    EXPECT_LT(estimate, 20 * error + 1e-3) << "seed " << seed;  // nor is it mere caution
  }
  EXPECT_GE(within, 0.9 * all);
}

/// A bar that floats, turns and is bent by its own muscles, without dashpots: errors grow for as long as it goes.
template <int Dim>
ScenarioOf<Dim> floating(unsigned seed) {
  std::mt19937 random(seed);
  const auto within = [&](double low, double high) {
    return low + (high - low) * (static_cast<double>(random()) / 4294967295.0);
  };
  physics::VectorOf<Dim> size = physics::VectorOf<Dim>::Constant(within(0.12, 0.25));
  size[0] = within(0.4, 0.8);
  Eigen::Matrix<int, Dim, 1> cells = Eigen::Matrix<int, Dim, 1>::Ones();
  cells[0] = 4;
  const physics::SimplexMeshOf<Dim> mesh = physics::mesh_of_box<Dim>(size, cells);
  const physics::ElementMesh<Dim> elements{
      mesh.nodes, mesh.simplices, {{1000, std::pow(10, within(4.5, 5.5)), 0.35}}, Eigen::VectorXd::Ones(mesh.simplices.cols())};
  ScenarioOf<Dim> scenario;
  scenario.scene.body = make_spring_body<Dim>(elements, 0);
  scenario.scene.has_ground = false;
  scenario.scene.gravity.setZero();
  physics::touch_with_whole_surface(scenario.scene);
  scenario.start = {mesh.nodes, physics::PointsOf<Dim>::Zero(Dim, mesh.nodes.cols())};
  const double turn = within(1, 4), rate = within(4, 13), amplitude = within(0.05, 0.2);
  scenario.start.v.row(0) = -turn * mesh.nodes.row(1);
  scenario.start.v.row(1) = turn * mesh.nodes.row(0);
  Eigen::VectorXd strength = Eigen::VectorXd::Zero(scenario.scene.body.edge_count());  // of one side alone
  for (Eigen::Index e = 0; e < strength.size(); ++e) {
    const auto ends = scenario.scene.body.edges.col(e);
    if (mesh.nodes(1, ends[0]) + mesh.nodes(1, ends[1]) > 0) strength[e] = amplitude;
  }
  scenario.drive = [=](double time_s, Eigen::VectorXd& activation) { activation = (1 - strength.array() * std::sin(rate * time_s)).matrix(); };
  scenario.length = size[0];
  scenario.size = physics::size_of_volume<Dim>(scenario.scene.body.rest_volume.sum());
  return scenario;
}

/// Of a choice for the whole of a run eight times as long as the first part, and of settings nobody chose: how often the true
/// error over all of it is within twice the estimate.
template <int Dim>
std::pair<int, int> whole_runs_within(unsigned first_seed, unsigned count) {
  AccuracyOptions first, all;
  first.duration_s = 0.4;
  all.duration_s = 3.2;
  int chosen = 0, given = 0;
  for (unsigned seed = first_seed; seed < first_seed + count; ++seed) {
    const ScenarioOf<Dim> scenario = floating<Dim>(seed);
    const ReferenceOf<Dim> reference = make_reference(scenario, first, false);
    const double most_m = 0.05 * scenario.length;
    const std::optional<ReferenceOf<Dim>> whole = reference_of_whole(reference, all.duration_s);
    EXPECT_TRUE(whole);
    if (!whole) continue;
    const StepChoice choice = choose_for_whole(*whole, choose_setting(reference, most_m, std::nullopt), most_m, std::nullopt);
    AccuracyOptions fine = all;
    fine.fineness = 8;
    const ReferenceOf<Dim> truth = make_reference(scenario, fine, false);
    const double error_m = measure_error(truth, scenario, choice.setting).error_rms_m;
    chosen += error_m <= 2 * choice.estimated_error_m;
    EXPECT_TRUE(choice.is_met) << "seed " << seed;
    EXPECT_LT(error_m, 2 * most_m) << "seed " << seed;
    SimulationOptions options;
    options.duration_s = all.duration_s;
    options.dt_s = 1.0 / 120;
    options.method = physics::kMethods[seed % 5];
    const EstimatedError estimate = estimated_error(scenario, options);
    EXPECT_NEAR(estimate.span_s, options.duration_s, 0.05);
    const AccuracyRow row = measure_error(truth, scenario, {options.method, options.dt_s});
    given += row.error_rel_length <= 2 * estimate.error_length;
  }
  return {chosen, given};
}

TEST(Accuracy, OfAWholeRunIsWithinTwiceTheEstimateInNineOfTen) {
  const unsigned count = trials(10u);
  const auto [chosen, given] = whole_runs_within<2>(400, count);
  EXPECT_GE(chosen, 0.9 * count);
  EXPECT_GE(given, 0.9 * count);
}

TEST(Accuracy, OfAWholeRunInSpaceIsWithinTwiceTheEstimate) {
  const auto [chosen, given] = whole_runs_within<3>(500, 3);
  EXPECT_EQ(chosen, 3);
  EXPECT_EQ(given, 3);
}

/// Its dashpots, as strong as a large body's, ask the explicit method for steps of nanoseconds.
TEST(Accuracy, OfATinyBodyIsFoundWithoutItsExplicitSteps) {
  const physics::SimplexMeshOf<2> mesh = physics::mesh_of_box<2>({0.001, 0.00025}, {5, 2});
  const physics::ElementMesh<2> elements{mesh.nodes, mesh.simplices, {{1000, 2000, 0.4}}, Eigen::VectorXd::Ones(mesh.simplices.cols())};
  Scenario scenario;
  scenario.scene.body = make_spring_body<2>(elements, 0.01);
  scenario.scene.has_ground = true;
  scenario.scene.body.rest.row(1).array() += 0.0005;
  physics::touch_with_whole_surface(scenario.scene);
  scenario.start = {scenario.scene.body.rest, physics::PointsOf<2>::Zero(2, mesh.nodes.cols())};
  scenario.length = 0.001;
  scenario.size = physics::size_of_volume<2>(scenario.scene.body.rest_volume.sum());
  const std::clock_t begin = std::clock();
  const double estimate = estimated_error(scenario, {.duration_s = 0.5}).error_length;
  EXPECT_LT(static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC, 20);
  EXPECT_GT(estimate, 0);
  EXPECT_LT(estimate, 0.1);
}

TEST(Accuracy, ChoiceHangsOnNoClock) {
  const Scenario scenario = plate(5);
  const ReferenceOf<2> reference = make_reference(scenario, short_motion(), false);
  const StepChoice once = choose_setting(reference, 0.01 * scenario.length, std::nullopt);
  const StepChoice again = choose_setting(reference, 0.01 * scenario.length, std::nullopt);
  ASSERT_EQ(once.tried.size(), again.tried.size());
  for (std::size_t k = 0; k < once.tried.size(); ++k) {
    EXPECT_EQ(once.tried[k].work_ms, again.tried[k].work_ms);
    EXPECT_EQ(once.tried[k].error_rms_m, again.tried[k].error_rms_m);
    EXPECT_GT(once.tried[k].work_ms, 0);
  }
  EXPECT_EQ(once.setting.method, again.setting.method);
  EXPECT_EQ(once.setting.dt_s, again.setting.dt_s);
}

/// The body in another mesh starts from the same shape and speed.
TEST(Accuracy, CarriesAMotionOverToAnotherMesh) {
  const auto bar = [](int cells) {
    const physics::SimplexMeshOf<2> mesh = physics::mesh_of_box<2>({0.8, 0.2}, {4 * cells, cells});
    const physics::ElementMesh<2> elements{
        mesh.nodes, mesh.simplices, {{1000, 1e6, 0.3}}, Eigen::VectorXd::Ones(mesh.simplices.cols())};
    Scenario scenario;
    scenario.scene.body =
        physics::make_body<2>(elements, physics::ElementBodyOptions{physics::ElasticLaw::kStableNeoHookean, 0, 0.0});
    scenario.scene.has_ground = false;
    physics::touch_with_whole_surface(scenario.scene);
    scenario.start = {scenario.scene.body.rest, physics::PointsOf<2>::Zero(2, mesh.nodes.cols())};
    scenario.start.v.row(0).setConstant(0.7);
    scenario.length = 0.8;
    return scenario;
  };
  AccuracyOptions options;
  options.duration_s = 0.2;
  const ReferenceOf<2> reference = make_reference(bar(2), options, false);
  const AccuracyRow row = measure_error(reference, bar(3), {physics::Method::kImplicit, 1.0 / 240});
  EXPECT_LT(row.error_rel_length, 1e-3);  // it falls freely: meshes do not matter, explicit is ahead by half a step
  EXPECT_EQ(row.nodes, bar(3).scene.body.node_count());
}

TEST(ParetoFront, HoldsWhatNothingBeatsInBoth) {
  const auto row = [](double error, double ms, bool stable = true) {
    AccuracyRow made;
    made.error_rms_m = error;
    made.ms_per_sim_s = made.work_ms = ms;
    made.stable = stable;
    return made;
  };
  const std::vector<AccuracyRow> rows{row(3, 1), row(1, 3), row(2, 2), row(2, 3), row(3, 1), row(0, 0, false)};
  EXPECT_EQ(pareto_front(rows), (std::vector<bool>{true, true, true, false, false, false}));
  EXPECT_EQ(cheapest_within(rows, 2.5), 2);
  EXPECT_EQ(cheapest_within(rows, 0.5), -1);
  EXPECT_EQ(most_accurate(rows), 1);
}

/// By the time by which it is taken, whichever that is.
TEST(CheapestWithin, LeavesNothingBothCheaperAndMoreExact) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> any(0, 1);
    std::vector<AccuracyRow> rows(20);
    for (AccuracyRow& row : rows) {
      row.error_rms_m = any(random);
      row.ms_per_sim_s = any(random);
      row.work_ms = any(random);
      row.stable = any(random) < 0.8;
      if (!row.stable) row.ms_per_sim_s = std::nan("");
    }
    for (double AccuracyRow::* time : {&AccuracyRow::work_ms, &AccuracyRow::ms_per_sim_s}) {
      const int taken = cheapest_within(rows, 0.5, time);
      ASSERT_GE(taken, 0);
      const AccuracyRow& best = rows[static_cast<std::size_t>(taken)];
      EXPECT_LE(best.error_rms_m, 0.5);
      EXPECT_TRUE(best.stable);
      for (const AccuracyRow& row : rows) {
        EXPECT_FALSE(row.stable && row.*time < best.*time && row.error_rms_m < best.error_rms_m);
      }
    }
  }
}

}  // namespace
}  // namespace hydrostat::retarget::accuracy_test
