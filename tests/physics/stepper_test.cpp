#include "physics/stepper.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstring>

#include "tests/physics/lattice_scene.h"

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

namespace hydrostat::physics {
namespace {

constexpr double kDt = 1.0 / 240;  // [s]
constexpr double kGravity = 9.81;

Eigen::VectorXd passive(const Body& body) { return Eigen::VectorXd::Ones(body.edge_count()); }

double size_of(const Body& body) { return std::cbrt(body.rest_volume.sum()); }

double deepest(const Scene& scene, const State& state) {
  double depth = 0;
  for (int p = 0; p < scene.contact_points.count(); ++p) {
    depth = std::max(depth, scene.ground.offset - scene.ground.normal.dot(scene.contact_points.of(state.x, p)));
  }
  return depth;
}

/// What both methods have to keep, whatever the scene.
class Steppers : public testing::TestWithParam<Method> {
 protected:
  /// Runs `steps` and gives each to `look(before, after, impulses)`.
  template <typename Look>
  State run(const Scene& scene, State state, int steps, const Look& look, double activation_amplitude = 0,
            unsigned seed = 0) {
    std::mt19937 random(seed);
    const std::unique_ptr<Stepper> stepper = make_stepper(GetParam(), scene);
    Impulses impulses = make_impulses(scene);
    Eigen::VectorXd activation = passive(scene.body);
    for (int k = 0; k < steps; ++k) {
      if (activation_amplitude > 0 && k % 12 == 0) activation = random_activation(random, scene.body, activation_amplitude);
      const State before = state;
      EXPECT_EQ(stepper->step(kDt, activation, nullptr, state, impulses), Termination::kDone) << "step " << k;
      look(before, state, impulses);
    }
    return state;
  }
  State run(const Scene& scene, State state, int steps) {
    return run(scene, std::move(state), steps, [](const State&, const State&, const Impulses&) {});
  }
};

TEST_P(Steppers, StayAtRestInTheRestShape) {
  Scene scene = scene_of(random_body(4), {});
  scene.gravity.setZero();
  scene.has_ground = false;
  const State end = run(scene, {scene.body.rest, 0 * scene.body.rest}, 24);
  EXPECT_LT((end.x - scene.body.rest).cwiseAbs().maxCoeff(), 1e-12);
}

TEST_P(Steppers, MoveTheCentreOfMassOnAParabolaInFreeFlightWhateverTheActivation) {
  for (unsigned seed = 0; seed < 4; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    Scene scene = scene_of(random_body(seed), {});
    if (seed % 2 == 1) scene.gravity.setZero();
    scene.has_ground = false;
    const Body& body = scene.body;
    State start{body.rest, random_points(random, body.node_count(), 1)};
    const Eigen::Vector3d from = momentum(body, start.v) / body.mass.sum(), place = centre_of_mass(body, start.x);
    const State end = run(
        scene, start, 240, [](const State&, const State&, const Impulses&) {}, 0.2, seed);
    EXPECT_LT((momentum(body, end.v) / body.mass.sum() - from - scene.gravity).norm(), 1e-9);
    // Semi-implicit steps of h fall g h t / 2 farther than the parabola.
    const double h = make_stepper(GetParam(), scene)->substep(kDt);
    const Eigen::Vector3d parabola = place + from + 0.5 * (1 + h) * scene.gravity;
    EXPECT_LT((centre_of_mass(body, end.x) - parabola).norm(), GetParam() == Method::kExplicit ? 1e-9 : 1e-5);
  }
}

TEST_P(Steppers, BalanceMomentumWithTheBookedImpulsesInContact) {
  const Scene scene = scene_of(four_legged(), soles(four_legged()), slope(8, 0.6));
  const Body& body = scene.body;
  State start = laid_down(scene, 0.05);
  for (int i = 0; i < body.node_count(); ++i) start.v.col(i) = Eigen::Vector3d(0.7, 0, 0.3);
  double worst = 0, worst_moment = 0;
  run(
      scene, start, 240,
      [&](const State& before, const State& after, const Impulses& impulses) {
        const Eigen::Vector3d change = momentum(body, after.v) - momentum(body, before.v);
        const Eigen::Vector3d contact = impulses.contact_nodes.rowwise().sum();
        EXPECT_LT((contact - impulses.contact.rowwise().sum()).norm(), 1e-9);
        worst = std::max(
            worst, (change - contact - kDt * body.mass.sum() * scene.gravity).norm() / (body.mass.sum() * kGravity * kDt));
        const Eigen::Vector3d turned = angular_momentum(body, after.x, after.v, Eigen::Vector3d::Zero()) -
                                       angular_momentum(body, before.x, before.v, Eigen::Vector3d::Zero());
        const double scale = body.mass.sum() * kGravity * kDt;  // L is 1 m
        worst_moment = std::max(worst_moment, (turned - impulses.contact_moment - impulses.gravity_moment).norm() / scale);
      },
      0.1);
  EXPECT_LT(worst, 1e-6);
  EXPECT_LT(worst_moment, GetParam() == Method::kExplicit ? 1e-9 : 1.0);  // mg L: backward Euler's own loss at touchdown
}

TEST_P(Steppers, BookDeclaredEffectsAndNothingElse) {
  Scene scene = scene_of(random_body(3), {});
  scene.has_ground = false;
  const Body& body = scene.body;
  std::mt19937 random(3);
  const Eigen::Matrix3Xd push = random_points(random, body.node_count(), 20);
  const std::unique_ptr<Stepper> stepper = make_stepper(GetParam(), scene);
  Impulses impulses = make_impulses(scene);
  State state{body.rest, Eigen::Matrix3Xd::Zero(3, body.node_count())};
  for (int k = 0; k < 24; ++k) {
    const State before = state;
    ASSERT_EQ(stepper->step(kDt, passive(body), &push, state, impulses), Termination::kDone);
    EXPECT_LT((impulses.effect_nodes - kDt * push).norm(), 1e-12);
    const Eigen::Vector3d change = momentum(body, state.v) - momentum(body, before.v);
    EXPECT_LT((change - kDt * (push.rowwise().sum() + body.mass.sum() * scene.gravity)).norm(), 1e-12);
    const Eigen::Vector3d turned = angular_momentum(body, state.x, state.v, Eigen::Vector3d::Zero()) -
                                   angular_momentum(body, before.x, before.v, Eigen::Vector3d::Zero());
    if (GetParam() == Method::kExplicit) {
      EXPECT_LT((turned - impulses.effect_moment - impulses.gravity_moment).norm(), 1e-12);
    }
  }
}

TEST_P(Steppers, PushFromTheGroundInsideTheConeWhereItIsTouched) {
  for (unsigned seed = 0; seed < 3; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Scene scene = scene_of(bar(4, 2, 2, 0.1), soles(bar(4, 2, 2, 0.1)), slope(5.0 * seed, 0.5));
    add_skin_points(scene, 2, seed);
    State start = laid_down(scene, 0.02);
    for (int i = 0; i < scene.body.node_count(); ++i) start.v.col(i) = Eigen::Vector3d(1, -0.5, 0.5);
    const Eigen::Vector3d normal = scene.ground.normal;
    int pushes = 0;
    run(
        scene, start, 240,
        [&](const State& before, const State& after, const Impulses& impulses) {
          for (int p = 0; p < scene.contact_points.count(); ++p) {
            const Eigen::Vector3d impulse = impulses.contact.col(p);
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
    EXPECT_GT(pushes, 200);
  }
}

TEST_P(Steppers, LetABodyComeToRestOnFlatGroundThatCarriesItsWeight) {
  Scene scene = scene_of(four_legged(), soles(four_legged()));
  add_skin_points(scene, 2, 1);
  const Body& body = scene.body;
  Eigen::Vector3d carried = Eigen::Vector3d::Zero();
  int steps = 0;
  const State end = run(scene, laid_down(scene, 0.02), 720, [&](const State&, const State& after, const Impulses& impulses) {
    if (++steps > 600) carried += impulses.contact.rowwise().sum();
    EXPECT_LT(deepest(scene, after), 0.005 * size_of(body));
  });
  EXPECT_LT(end.v.colwise().norm().maxCoeff(), 1e-4);  // [m/s]
  EXPECT_LT((carried / (120 * kDt) + body.mass.sum() * scene.gravity).norm(), 1e-3 * body.mass.sum() * kGravity);
  EXPECT_LT(deepest(scene, end), 0.0005 * size_of(body));
  EXPECT_GT(jacobians(body, end.x).minCoeff(), 0.8);
}

TEST_P(Steppers, HoldABodyOnASlopeWithinTheConeOfFriction) {
  const Scene scene = scene_of(four_legged(), soles(four_legged()), slope(20, 0.5));
  Eigen::Vector3d settled = Eigen::Vector3d::Zero();
  int steps = 0;
  const State end = run(scene, laid_down(scene), 720, [&](const State&, const State& after, const Impulses&) {
    if (++steps == 480) settled = centre_of_mass(scene.body, after.x);
  });
  EXPECT_LT((centre_of_mass(scene.body, end.x) - settled).norm(), 0.0005);  // [m] in one second
}

TEST_P(Steppers, LetABodySlideDownASlopeBeyondTheConeOfFriction) {
  const Body brick = bar(6, 2, 4, 0.1);
  const Scene scene = scene_of(brick, soles(brick), slope(20, 0.3));
  const Eigen::Vector3d downhill(-scene.ground.normal.y(), scene.ground.normal.x(), 0);
  double speed = 0, faster = 0;
  int steps = 0;
  run(scene, laid_down(scene), 480, [&](const State&, const State& after, const Impulses&) {
    const double along = downhill.dot(momentum(brick, after.v)) / brick.mass.sum();
    if (++steps == 240) speed = along;
    faster = along - speed;
  });
  const double angle = std::asin(-scene.ground.normal.x());
  EXPECT_NEAR(faster / (kGravity * (std::sin(angle) - 0.3 * std::cos(angle))), 1, 0.02);  // in the second second
}

TEST_P(Steppers, GainNoEnergyFromADropOfABodysHeight) {
  const Body body = four_legged();
  const Scene scene = scene_of(body, soles(body));
  State start = laid_down(scene, 0.4);
  const double at_first = energy(scene, start, passive(body));
  double highest = 0;
  run(scene, start, 480, [&](const State&, const State& after, const Impulses&) {
    highest = std::max(highest, energy(scene, after, passive(body)) - at_first);
  });
  EXPECT_LT(highest, 1e-3 * body.mass.sum() * kGravity * 0.4);
}

TEST_P(Steppers, LiftAPointThatStartsBelowTheGroundWithoutThrowingIt) {
  const Body body = bar(3, 2, 3, 0.1);
  const Scene scene = scene_of(body, soles(body));
  State start = laid_down(scene, -0.01);
  double fastest = 0;
  const State end = run(scene, start, 480, [&](const State&, const State& after, const Impulses&) {
    fastest = std::max(fastest, (momentum(body, after.v) / body.mass.sum()).norm());
  });
  EXPECT_LT(deepest(scene, end), 0.0005 * size_of(body));
  EXPECT_LT(end.v.norm(), 1e-3);
  EXPECT_LT(fastest, GetParam() == Method::kExplicit ? 0.6 : 3);  // [m/s]; a spring gives back what the start put into it
}

TEST_P(Steppers, GiveTheSameBytesTwice) {
  const Scene scene = scene_of(four_legged(), soles(four_legged()), slope(10, 0.4));
  const auto nothing = [](const State&, const State&, const Impulses&) {};
  const State one = run(scene, laid_down(scene, 0.02), 120, nothing, 0.2, 7),
              two = run(scene, laid_down(scene, 0.02), 120, nothing, 0.2, 7);
  EXPECT_EQ(std::memcmp(one.x.data(), two.x.data(), sizeof(double) * static_cast<std::size_t>(one.x.size())), 0);
  EXPECT_EQ(std::memcmp(one.v.data(), two.v.data(), sizeof(double) * static_cast<std::size_t>(one.v.size())), 0);
}

TEST_P(Steppers, AllocateNothingInTheStepLoop) {
  Scene scene = scene_of(four_legged(), soles(four_legged()));
  add_skin_points(scene, 2, 1);
  const std::unique_ptr<Stepper> stepper = make_stepper(GetParam(), scene);
  Impulses impulses = make_impulses(scene);
  State state = laid_down(scene, 0.01);
  std::mt19937 random(1);
  const Eigen::VectorXd activation = random_activation(random, scene.body, 0.1);
  const Eigen::Matrix3Xd push = Eigen::Matrix3Xd::Ones(3, scene.body.node_count());
  const long at_first = allocations;
  const Eigen::VectorXd one(5);
  const std::vector<int> two(5);
  EXPECT_EQ(allocations - at_first, 2);  // the count counts
  stepper->step(kDt, activation, &push, state, impulses);
  const long before = allocations;
  for (int k = 0; k < 48; ++k) stepper->step(kDt, activation, &push, state, impulses);
  EXPECT_EQ(allocations - before, 0);
}

TEST_P(Steppers, SayThatTheyDivergedAndLeaveTheStartState) {
  const Body body = random_body(2);
  const Scene scene = scene_of(body, soles(body));
  const std::unique_ptr<Stepper> stepper = make_stepper(GetParam(), scene);
  Impulses impulses = make_impulses(scene);
  const double nan = std::nan("");
  for (const double bad : {1e12, nan}) {
    State state = laid_down(scene, 0.1);
    const State start = state;
    EXPECT_EQ(stepper->step(kDt, Eigen::VectorXd::Constant(body.edge_count(), bad), nullptr, state, impulses),
              Termination::kDiverged);
    EXPECT_EQ(state.x, start.x);
    EXPECT_EQ(state.v, start.v);
  }
  State state = laid_down(scene, 0.1);
  EXPECT_EQ(stepper->step(kDt, passive(body), nullptr, state, impulses), Termination::kDone);  // and go on afterwards
}

TEST_P(Steppers, NeverCallAStateThatIsNoNumberDone) {
  for (const bool flat : {true, false}) {
    SCOPED_TRACE(flat ? "flattened to y = 0" : "one tet inverted");
    Body body = bar(4, 2, 2, 0.1);
    Scene scene = scene_of(std::move(body), {});
    scene.has_ground = false;
    scene.gravity.setZero();
    State state{scene.body.rest, Eigen::Matrix3Xd::Zero(3, scene.body.node_count())};
    if (flat) {
      state.x.row(1).setZero();
    } else {
      const Eigen::Vector4i tet = scene.body.tets.col(0);
      const Eigen::Vector3d middle = (state.x.col(tet[1]) + state.x.col(tet[2]) + state.x.col(tet[3])) / 3;
      state.x.col(tet[0]) += 1.5 * (middle - state.x.col(tet[0]));
    }
    const std::unique_ptr<Stepper> stepper = make_stepper(GetParam(), scene);
    Impulses impulses = make_impulses(scene);
    int done = 0;
    for (; done < 480; ++done) {
      const Termination termination = stepper->step(kDt, passive(scene.body), nullptr, state, impulses);
      ASSERT_TRUE(state.x.allFinite() && state.v.allFinite());
      if (termination == Termination::kDiverged) break;
    }
    EXPECT_EQ(done, 480);
    EXPECT_GT(jacobians(scene.body, state.x).minCoeff(), 0.99);  // both find back to the rest shape
  }
}

INSTANTIATE_TEST_SUITE_P(EachMethod, Steppers, testing::Values(Method::kExplicit, Method::kEuler),
                         [](const testing::TestParamInfo<Method>& method) { return name_of(method.param); });

}  // namespace
}  // namespace hydrostat::physics
