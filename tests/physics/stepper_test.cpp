#include "physics/stepper.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstring>

#include "tests/physics/element_method_scene.h"

namespace {
std::atomic<long> allocations = 0;  // of this program: Eigen's by malloc and the library's by new, which the linker wraps
}  // namespace

extern "C" {
void* __real_malloc(std::size_t size);
void* __real__Znwm(std::size_t size);
void* __wrap_malloc(std::size_t size) {
  ++allocations;
  return __real_malloc(size);
}
void* __wrap__Znwm(std::size_t size) {
  ++allocations;
  return __real__Znwm(size);
}
}

namespace hydrostat::physics::stepper_test {
namespace {

constexpr double kDt = 1.0 / 240;  // [s]
constexpr double kGravity = 9.81;

template <int Dim>
double deepest(const SceneOf<Dim>& scene, const StateOf<Dim>& state) {
  double depth = 0;
  for (int p = 0; p < scene.contact_points.count(); ++p) {
    depth = std::max(depth, scene.ground.offset - scene.ground.normal.dot(scene.contact_points.of(state.x, p)));
  }
  return depth;
}

/// Runs `steps`, the first few with sanitizers, and gives each to `look(before, after, impulses)`.
template <int Dim, typename Look>
StateOf<Dim> run(Method method, const SceneOf<Dim>& scene, StateOf<Dim> state, int steps, const Look& look,
                 double activation_amplitude = 0, unsigned seed = 0) {
  std::mt19937 random(seed);
  const std::unique_ptr<StepperOf<Dim>> stepper = make_stepper(method, scene);
  ImpulsesOf<Dim> impulses = make_impulses(scene);
  Eigen::VectorXd activation = passive(scene.body);
  for (int k = 0; k < few_steps(steps); ++k) {
    if (activation_amplitude > 0 && k % 12 == 0) activation = random_activation(random, scene.body, activation_amplitude);
    const StateOf<Dim> before = state;
    EXPECT_EQ(stepper->step(kDt, activation, nullptr, state, impulses), Termination::kDone) << "step " << k;
    look(before, state, impulses);
  }
  return state;
}
template <int Dim>
StateOf<Dim> run(Method method, const SceneOf<Dim>& scene, StateOf<Dim> state, int steps) {
  return run(method, scene, std::move(state), steps, [](const StateOf<Dim>&, const StateOf<Dim>&, const ImpulsesOf<Dim>&) {});
}

/// What every method has to keep in both dimensions, whatever the scene.
template <typename Case>
class Steppers : public testing::Test {};
TYPED_TEST_SUITE(Steppers, Cases, CaseName);

METHOD_TEST(Steppers, StayAtRestInTheRestShape) {
  SceneOf<Dim> scene = scene_of(random_body<Dim>(4), {});
  scene.gravity.setZero();
  scene.has_ground = false;
  const StateOf<Dim> end = run<Dim>(method, scene, {scene.body.rest, 0 * scene.body.rest}, 24);
  EXPECT_LT((end.x - scene.body.rest).cwiseAbs().maxCoeff(), 1e-12);
}

METHOD_TEST(Steppers, MoveTheCentreOfMassOnAParabolaInFreeFlightWhateverTheActivation) {
  const bool is_explicit = method == Method::kExplicit || method == Method::kSpring;
  for (unsigned seed = 0; seed < trials(4u); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    SceneOf<Dim> scene = scene_of(random_body<Dim>(seed), {});
    if (seed % 2 == 1) scene.gravity.setZero();
    scene.has_ground = false;
    const BodyOf<Dim>& body = scene.body;
    StateOf<Dim> start{body.rest, random_points<Dim>(random, body.node_count(), 1)};
    const VectorOf<Dim> from = momentum(body, start.v) / body.mass.sum(), place = centre_of_mass(body, start.x);
    const StateOf<Dim> end = run<Dim>(method, scene, start, 240, [](const StateOf<Dim>&, const StateOf<Dim>&, const ImpulsesOf<Dim>&) {}, 0.2, seed);
    if (kSanitized) continue;  // the rest is of the end
    EXPECT_LT((momentum(body, end.v) / body.mass.sum() - from - scene.gravity).norm(), linear_tolerance(method));
    // Semi-implicit steps of h and shorter ones fall up to g h t / 2 farther than the parabola.
    const double h = make_stepper(method, scene)->substep(kDt), exact = is_explicit ? 1e-9 : 1e-5;
    const VectorOf<Dim> beyond = centre_of_mass(body, end.x) - place - from - 0.5 * scene.gravity;
    const VectorOf<Dim> down = -VectorOf<Dim>::UnitY();
    EXPECT_LT((beyond - down.dot(beyond) * down).norm(), exact);
    EXPECT_GT(down.dot(beyond), -exact);
    EXPECT_LT(down.dot(beyond), 0.5 * h * scene.gravity.norm() + exact);
  }
}

METHOD_TEST(Steppers, BalanceMomentumWithTheBookedImpulsesInContact) {
  const SceneOf<Dim> scene = scene_of(four_legged<Dim>(), soles(four_legged<Dim>()), slope<Dim>(8, 0.6));
  const BodyOf<Dim>& body = scene.body;
  StateOf<Dim> start = laid_down(scene, 0.05);
  for (int i = 0; i < body.node_count(); ++i) start.v.col(i) = vec<Dim>(0.7, 0, 0.3);
  double worst = 0, worst_moment = 0;
  run<Dim>(method, scene, start, 240,
      [&](const StateOf<Dim>& before, const StateOf<Dim>& after, const ImpulsesOf<Dim>& impulses) {
        const VectorOf<Dim> change = momentum(body, after.v) - momentum(body, before.v);
        const VectorOf<Dim> contact = impulses.contact_nodes.rowwise().sum();
        EXPECT_LT((contact - impulses.contact.rowwise().sum()).norm(), 1e-9);
        worst = std::max(
            worst, (change - contact - kDt * body.mass.sum() * scene.gravity).norm() / (body.mass.sum() * kGravity * kDt));
        const SpinOf<Dim> turned = angular_momentum(body, after.x, after.v, VectorOf<Dim>::Zero()) -
                                   angular_momentum(body, before.x, before.v, VectorOf<Dim>::Zero());
        const double scale = body.mass.sum() * kGravity * kDt;  // L is 1 m
        worst_moment = std::max(worst_moment, (turned - impulses.contact_moment - impulses.gravity_moment).norm() / scale);
      },
      0.1);
  EXPECT_LT(worst, 1e-6);
  // mg L; the last is backward Euler's own loss at touchdown.
  const double tolerance = angular_tolerance(method);
  EXPECT_LT(worst_moment, tolerance < 1e-9 ? 1e-9 : tolerance < 1 ? 1e-4 : 1.0);
}

METHOD_TEST(Steppers, BookDeclaredEffectsAndNothingElse) {
  SceneOf<Dim> scene = scene_of(random_body<Dim>(3), {});
  scene.has_ground = false;
  const BodyOf<Dim>& body = scene.body;
  std::mt19937 random(3);
  const PointsOf<Dim> push = random_points<Dim>(random, body.node_count(), 20);
  const std::unique_ptr<StepperOf<Dim>> stepper = make_stepper(method, scene);
  ImpulsesOf<Dim> impulses = make_impulses(scene);
  StateOf<Dim> state{body.rest, PointsOf<Dim>::Zero(Dim, body.node_count())};
  for (int k = 0; k < 24; ++k) {
    const StateOf<Dim> before = state;
    ASSERT_EQ(stepper->step(kDt, passive(body), &push, state, impulses), Termination::kDone);
    EXPECT_LT((impulses.effect_nodes - kDt * push).norm(), 1e-12);
    const VectorOf<Dim> change = momentum(body, state.v) - momentum(body, before.v);
    EXPECT_LT((change - kDt * (push.rowwise().sum() + body.mass.sum() * scene.gravity)).norm(),
              1e-3 * linear_tolerance(method));
    const SpinOf<Dim> turned = angular_momentum(body, state.x, state.v, VectorOf<Dim>::Zero()) -
                               angular_momentum(body, before.x, before.v, VectorOf<Dim>::Zero());
    EXPECT_LT((turned - impulses.effect_moment - impulses.gravity_moment).norm(), angular_tolerance(method));
  }
}

METHOD_TEST(Steppers, PushFromTheGroundInsideTheConeWhereItIsTouched) {
  for (unsigned seed = 0; seed < trials(3u); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SceneOf<Dim> scene = scene_of(bar<Dim>(4, 2, 2, 0.1), soles(bar<Dim>(4, 2, 2, 0.1)), slope<Dim>(5.0 * seed, 0.5));
    add_skin_points(scene, 2, seed);
    StateOf<Dim> start = laid_down(scene, 0.02);
    for (int i = 0; i < scene.body.node_count(); ++i) start.v.col(i) = vec<Dim>(1, -0.5, 0.5);
    const VectorOf<Dim> normal = scene.ground.normal;
    int pushes = 0;
    run<Dim>(method, scene, start, 240,
        [&](const StateOf<Dim>& before, const StateOf<Dim>& after, const ImpulsesOf<Dim>& impulses) {
          for (int p = 0; p < scene.contact_points.count(); ++p) {
            const VectorOf<Dim> impulse = impulses.contact.col(p);
            const double along = normal.dot(impulse);
            EXPECT_GE(along, 0);
            EXPECT_LE((impulse - along * normal).norm(), scene.ground.friction * along + 1e-12);
            if (along == 0) continue;
            ++pushes;
            const double gap_before = normal.dot(scene.contact_points.of(before.x, p)),
                         gap_after = normal.dot(scene.contact_points.of(after.x, p));
            EXPECT_LT(std::min(gap_before, gap_after), 0.002 * size_of(scene.body));
          }
        },
        0.1, seed);
    if (kSanitized) continue;  // the rest is of the end
    EXPECT_GT(pushes, Dim == 3 ? 200 : 100);
  }
}

METHOD_TEST(Steppers, LetABodyComeToRestOnFlatGroundThatCarriesItsWeight) {
  SceneOf<Dim> scene = scene_of(four_legged<Dim>(), soles(four_legged<Dim>()));
  add_skin_points(scene, 2, 1);
  const BodyOf<Dim>& body = scene.body;
  VectorOf<Dim> carried = VectorOf<Dim>::Zero();
  int steps = 0;
  const StateOf<Dim> end = run<Dim>(method, scene, laid_down(scene, 0.02), 720,
                                     [&](const StateOf<Dim>&, const StateOf<Dim>& after, const ImpulsesOf<Dim>& impulses) {
                                       if (++steps > 600) carried += impulses.contact.rowwise().sum();
                                       EXPECT_LT(deepest(scene, after), 0.005 * size_of(body));
                                     });
  if (kSanitized) return;  // the rest is of the end
  EXPECT_LT(end.v.colwise().norm().maxCoeff(), method == Method::kXpbd ? 1e-3 : 1e-4);  // [m/s]
  EXPECT_LT((carried / (120 * kDt) + body.mass.sum() * scene.gravity).norm(), 1e-3 * body.mass.sum() * kGravity);
  EXPECT_LT(deepest(scene, end), 0.0005 * size_of(body));
  EXPECT_GT(jacobians(body, end.x).minCoeff(), 0.8);
}

METHOD_TEST(Steppers, HoldABodyOnASlopeWithinTheConeOfFriction) {
  const SceneOf<Dim> scene = scene_of(four_legged<Dim>(), soles(four_legged<Dim>()), slope<Dim>(20, 0.5));
  VectorOf<Dim> settled = VectorOf<Dim>::Zero();
  int steps = 0;
  const StateOf<Dim> end =
      run<Dim>(method, scene, laid_down(scene), 720, [&](const StateOf<Dim>&, const StateOf<Dim>& after, const ImpulsesOf<Dim>&) {
        if (++steps == 480) settled = centre_of_mass(scene.body, after.x);
      });
  if (kSanitized) return;  // the rest is of the end
  EXPECT_LT((centre_of_mass(scene.body, end.x) - settled).norm(), 0.0005);  // [m] in one second
}

METHOD_TEST(Steppers, LetABodySlideDownASlopeBeyondTheConeOfFriction) {
  const BodyOf<Dim> brick = bar<Dim>(6, 2, 4, 0.1);
  const SceneOf<Dim> scene = scene_of(brick, soles(brick), slope<Dim>(20, 0.3));
  const VectorOf<Dim> downhill = vec<Dim>(-scene.ground.normal.y(), scene.ground.normal.x(), 0);
  double speed = 0, faster = 0;
  int steps = 0;
  run<Dim>(method, scene, laid_down(scene), 480, [&](const StateOf<Dim>&, const StateOf<Dim>& after, const ImpulsesOf<Dim>&) {
    const double along = downhill.dot(momentum(brick, after.v)) / brick.mass.sum();
    if (++steps == 240) speed = along;
    faster = along - speed;
  });
  if (kSanitized) return;  // the rest is of the end
  const double angle = std::asin(-scene.ground.normal.x());
  EXPECT_NEAR(faster / (kGravity * (std::sin(angle) - 0.3 * std::cos(angle))), 1, 0.02);  // in the second second
}

METHOD_TEST(Steppers, GainNoEnergyFromADropOfABodysHeight) {
  if (method == Method::kXpbd) GTEST_SKIP() << "its passes leave constraints unsolved whose energy counts here";
  const BodyOf<Dim> body = four_legged<Dim>();
  const SceneOf<Dim> scene = scene_of(body, soles(body));
  SceneOf<Dim> counted = scene;
  if (method == Method::kSpring) counted.body.volume_stiffness.resize(0);  // it knows of no volume
  StateOf<Dim> start = laid_down(scene, 0.4);
  const double at_first = energy(counted, start, passive(body));
  double highest = 0;
  run<Dim>(method, scene, start, 480, [&](const StateOf<Dim>&, const StateOf<Dim>& after, const ImpulsesOf<Dim>&) {
    highest = std::max(highest, energy(counted, after, passive(body)) - at_first);
  });
  EXPECT_LT(highest, 1e-3 * body.mass.sum() * kGravity * 0.4);
}

METHOD_TEST(Steppers, GainNoEnergyFromDashpotsThatAreStifferThanTheBody) {
  if (method == Method::kXpbd || method == Method::kSpring) GTEST_SKIP() << "it has dashpots of its own";
  BodyOf<Dim> body = bar<Dim>(3, 2, 2, 0.1);
  body.edge_damping = 0.3 * body.edge_stiffness;  // [N s/m]
  SceneOf<Dim> scene = scene_of(body, {});
  scene.has_ground = false;
  for (unsigned seed = 1; seed <= trials(4U); ++seed) {
    std::mt19937 random(seed);
    // What moves in every direction at first only tumbles a step later: the dashpots turn otherwise than they set out to.
    StateOf<Dim> start{body.rest, random_points<Dim>(random, body.node_count(), 3)};
    const VectorOf<Dim> centre = centre_of_mass(body, start.x);
    for (int i = 0; i < body.node_count(); ++i) start.v.col(i) += turning<Dim>(SpinOf<Dim>::Constant(20), start.x.col(i) - centre);
    double gain = 0;
    run<Dim>(method, scene, start, 60, [&](const StateOf<Dim>& before, const StateOf<Dim>& after, const ImpulsesOf<Dim>&) {
      gain = std::max(gain, energy(scene, after, passive(body)) - energy(scene, before, passive(body)));
    });
    EXPECT_LT(gain, 1e-3 * energy(scene, start, passive(body))) << "seed " << seed;
  }
}

TEST(Xpbd, IsNotFedByDashpotsThatStopABodyWithinASubstep) {
  for (const double damping_time : {0.003, 0.01, 0.1}) {
    BodyOf<3> body = bar<3>(8, 2, 2, 0.125);
    body.edge_stiffness *= 50;
    body.volume_stiffness *= 50;
    body.edge_damping = damping_time * body.edge_stiffness;
    SceneOf<3> scene = scene_of(body, {});
    scene.has_ground = false;
    for (unsigned seed = 1; seed <= trials(3U); ++seed) {
      std::mt19937 random(seed);
      const StateOf<3> start{body.rest + random_points<3>(random, body.node_count(), 0.01), random_points<3>(random, body.node_count(), 1)};
      double highest = 0;
      run<3>(Method::kXpbd, scene, start, 120, [&](const StateOf<3>&, const StateOf<3>& after, const ImpulsesOf<3>&) {
        highest = std::max(highest, energy(scene, after, passive(body)));
      });
      EXPECT_LT(highest, 1.01 * energy(scene, start, passive(body))) << damping_time << " s, seed " << seed;
    }
  }
}

METHOD_TEST(Steppers, LiftAPointThatStartsBelowTheGroundWithoutThrowingIt) {
  const BodyOf<Dim> body = bar<Dim>(3, 2, 3, 0.1);
  const SceneOf<Dim> scene = scene_of(body, soles(body));
  StateOf<Dim> start = laid_down(scene, -0.01);
  double fastest = 0;
  const StateOf<Dim> end =
      run<Dim>(method, scene, start, 480, [&](const StateOf<Dim>&, const StateOf<Dim>& after, const ImpulsesOf<Dim>&) {
        fastest = std::max(fastest, (momentum(body, after.v) / body.mass.sum()).norm());
      });
  if (kSanitized) return;  // the rest is of the end
  EXPECT_LT(deepest(scene, end), 0.0005 * size_of(body));
  EXPECT_LT(end.v.norm(), 1e-3);
  EXPECT_LT(fastest,
            method == Method::kExplicit ? 0.6 : 3);  // [m/s]; a spring gives back what the start put into it
}

METHOD_TEST(Steppers, GiveTheSameBytesTwice) {
  const SceneOf<Dim> scene = scene_of(four_legged<Dim>(), soles(four_legged<Dim>()), slope<Dim>(10, 0.4));
  const auto nothing = [](const StateOf<Dim>&, const StateOf<Dim>&, const ImpulsesOf<Dim>&) {};
  const StateOf<Dim> one = run<Dim>(method, scene, laid_down(scene, 0.02), 120, nothing, 0.2, 7),
                     two = run<Dim>(method, scene, laid_down(scene, 0.02), 120, nothing, 0.2, 7);
  EXPECT_EQ(std::memcmp(one.x.data(), two.x.data(), sizeof(double) * static_cast<std::size_t>(one.x.size())), 0);
  EXPECT_EQ(std::memcmp(one.v.data(), two.v.data(), sizeof(double) * static_cast<std::size_t>(one.v.size())), 0);
}

METHOD_TEST(Steppers, AllocateNothingInTheStepLoop) {
  SceneOf<Dim> scene = scene_of(four_legged<Dim>(), soles(four_legged<Dim>()));
  add_skin_points(scene, 2, 1);
  const std::unique_ptr<StepperOf<Dim>> stepper = make_stepper(method, scene);
  ImpulsesOf<Dim> impulses = make_impulses(scene);
  StateOf<Dim> state = laid_down(scene, 0.01);
  std::mt19937 random(1);
  const Eigen::VectorXd activation = random_activation(random, scene.body, 0.1);
  const PointsOf<Dim> push = PointsOf<Dim>::Ones(Dim, scene.body.node_count());
  const long at_first = allocations;
  const Eigen::VectorXd one(5);
  const std::vector<int> two(5);
  EXPECT_EQ(allocations - at_first, 2);  // the count counts
  stepper->step(kDt, activation, &push, state, impulses);
  const long before = allocations;
  for (int k = 0; k < 48; ++k) stepper->step(kDt, activation, &push, state, impulses);
  EXPECT_EQ(allocations - before, 0);
}

METHOD_TEST(Steppers, AllocateNothingInTheStepLoopOfElements) {
  SceneOf<Dim> scene = scene_of(random_element_body<Dim>(5, Cut::kBoxes, ElasticLaw::kStableNeoHookean), {});
  touch_with_whole_surface(scene);
  const std::unique_ptr<StepperOf<Dim>> stepper = make_stepper(method, scene);
  ImpulsesOf<Dim> impulses = make_impulses(scene);
  StateOf<Dim> state = laid_down(scene, 0.01);
  std::mt19937 random(1);
  const Eigen::VectorXd activations[2] = {random_activation(random, scene.body, 0.1), random_activation(random, scene.body, 0.1)};
  stepper->step(kDt, activations[1], nullptr, state, impulses);
  const long before = allocations;
  for (int k = 0; k < 48; ++k) stepper->step(kDt, activations[k % 2], nullptr, state, impulses);
  EXPECT_EQ(allocations - before, 0);
}

/// The midpoint rule turns stiff modes round in every step: activations that do so, too, must not push them ever higher.
TEST(Implicit, IsNotFedByActivationsThatJumpFromStepToStep) {
  const BodyOf<2> body = bar<2>(16, 4, 1, 0.0625);
  const SceneOf<2> scene = in_the_air(body, false);
  for (unsigned seed = 1; seed <= trials(4U); ++seed) {
    std::mt19937 random(seed);
    const Eigen::VectorXd rest = Eigen::VectorXd::Ones(body.edge_count()), jump = random_activation(random, body, 0.1) - rest;
    const auto stepper = make_implicit_stepper(scene);
    StateOf<2> state{body.rest, PointsOf<2>::Zero(2, body.node_count())};
    ImpulsesOf<2> impulses = make_impulses(scene);
    double most = 0;
    for (int s = 0; s < 240; ++s) {
      const Eigen::VectorXd activation = rest + (s % 2 == 0 ? 1 : -1) * jump;
      ASSERT_EQ(stepper->step(1.0 / 240, activation, nullptr, state, impulses), Termination::kDone);
      most = std::max(most, energy(scene, state, rest));
    }
    EXPECT_LT(most, elastic_energy<2>(body, body.rest, rest + jump)) << "seed " << seed;
  }
}

TEST(Explicit, AllocatesNothingWhereThreadsShareTheStep) {
  SceneOf<2> scene = in_the_air<2>(make_body(element_bar<2>({60, 45}, {0.6, 0.45}, Cut::kTwoTriangles), {}), false);
  scene.threads = 2;
  const std::unique_ptr<StepperOf<2>> stepper = make_stepper(Method::kExplicit, scene);
  ImpulsesOf<2> impulses = make_impulses(scene);
  StateOf<2> state{1.01 * scene.body.rest, PointsOf<2>::Zero(2, scene.body.node_count())};
  stepper->step(kDt, passive(scene.body), nullptr, state, impulses);
  const Eigen::VectorXd ones = passive(scene.body);
  const long before = allocations;
  EXPECT_EQ(stepper->step(kDt, ones, nullptr, state, impulses), Termination::kDone);
  EXPECT_EQ(allocations - before, 0);
}

METHOD_TEST(Steppers, AllocateNothingInTheStepLoopOfABodyOnItself) {
  SceneOf<Dim> scene =
      in_the_air(body_of(make_lattice<Dim>(7, 2, 1, 0.1, [](int i, int, int) { return i != 3; }), {1000, 2e5, 4, 0.01}), false);
  scene.self_contact.is_on = true;
  StateOf<Dim> state{scene.body.rest, PointsOf<Dim>::Zero(Dim, scene.body.node_count())};
  for (int i = 0; i < scene.body.node_count(); ++i) {  // two pieces pressed together
    if (state.x(0, i) > 0.35) state.x(0, i) -= 0.1;
    state.v(0, i) = state.x(0, i) < 0.32 && scene.body.rest(0, i) < 0.35 ? 0.2 : -0.2;
  }
  const std::unique_ptr<StepperOf<Dim>> stepper = make_stepper(method, scene);
  ImpulsesOf<Dim> impulses = make_impulses(scene);
  for (int k = 0; k < 4; ++k) stepper->step(kDt, passive(scene.body), nullptr, state, impulses);
  EXPECT_GT(impulses.internal_nodes.norm(), 0);
  const Eigen::VectorXd ones = passive(scene.body);
  const long before = allocations;
  for (int k = 0; k < 12; ++k) stepper->step(kDt, ones, nullptr, state, impulses);
  EXPECT_EQ(allocations - before, 0);
}

METHOD_TEST(Steppers, SayThatTheyDivergedAndLeaveTheStartState) {
  const BodyOf<Dim> body = random_body<Dim>(2);
  const SceneOf<Dim> scene = scene_of(body, soles(body));
  const std::unique_ptr<StepperOf<Dim>> stepper = make_stepper(method, scene);
  ImpulsesOf<Dim> impulses = make_impulses(scene);
  const double nan = std::nan("");
  for (const double bad : {1e12, nan}) {
    StateOf<Dim> state = laid_down(scene, 0.1);
    const StateOf<Dim> start = state;
    EXPECT_EQ(stepper->step(kDt, Eigen::VectorXd::Constant(body.edge_count(), bad), nullptr, state, impulses),
              Termination::kDiverged);
    EXPECT_EQ(state.x, start.x);
    EXPECT_EQ(state.v, start.v);
  }
  StateOf<Dim> state = laid_down(scene, 0.1);
  EXPECT_EQ(stepper->step(kDt, passive(body), nullptr, state, impulses), Termination::kDone);  // and go on afterwards
}

METHOD_TEST(Steppers, NeverCallAStateThatIsNoNumberDone) {
  for (const bool flat : {true, false}) {
    SCOPED_TRACE(flat ? "flattened to y = 0" : "one tet inverted");
    BodyOf<Dim> body = bar<Dim>(4, 2, 2, 0.1);
    SceneOf<Dim> scene = scene_of(std::move(body), {});
    scene.has_ground = false;
    scene.gravity.setZero();
    StateOf<Dim> state{scene.body.rest, PointsOf<Dim>::Zero(Dim, scene.body.node_count())};
    if (flat) {
      state.x.row(1).setZero();
    } else {
      const Eigen::Matrix<int, Dim + 1, 1> tet = scene.body.tets.col(0);
      VectorOf<Dim> middle = VectorOf<Dim>::Zero();
      for (int k = 1; k <= Dim; ++k) middle += state.x.col(tet[k]) / Dim;
      state.x.col(tet[0]) += 1.5 * (middle - state.x.col(tet[0]));
    }
    const std::unique_ptr<StepperOf<Dim>> stepper = make_stepper(method, scene);
    ImpulsesOf<Dim> impulses = make_impulses(scene);
    int done = 0;
    for (; done < few_steps(480); ++done) {
      const Termination termination = stepper->step(kDt, passive(scene.body), nullptr, state, impulses);
      ASSERT_TRUE(state.x.allFinite() && state.v.allFinite());
      if (termination == Termination::kDiverged) break;
    }
    if (method == Method::kSpring) continue;  // springs have no inside
    EXPECT_EQ(done, few_steps(480));
    if (kSanitized) continue;  // the rest is of the end
    EXPECT_GT(jacobians(scene.body, state.x).minCoeff(), 0.99);  // both find back to the rest shape
  }
}

}  // namespace
}  // namespace hydrostat::physics::stepper_test
