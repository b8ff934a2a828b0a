#include "physics/contact.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/physics/method_cases.h"
#include "tests/physics/obstacle_shapes.h"

namespace hydrostat::physics::contact_test {
namespace {

constexpr double kDt = 1.0 / 240;  // [s]
constexpr double kGravity = 9.81;

template <typename Case>
class Contact : public testing::Test {};
TYPED_TEST_SUITE(Contact, Cases, CaseName);

enum class Slope { kHalfSpace, kBox, kMesh };
constexpr Slope kSlopes[] = {Slope::kHalfSpace, Slope::kBox, Slope::kMesh};

/// A slope through the origin, rising with x.
template <int Dim>
ObstacleOf<Dim> slope_obstacle(Slope kind, double degrees, double friction) {
  ObstacleOf<Dim> obstacle;
  const VectorOf<Dim> half_extents = vec<Dim>(40, 2, 2);
  if (kind == Slope::kBox) obstacle.shape = BoxOf<Dim>{half_extents};
  if (kind == Slope::kMesh) obstacle.shape = box_mesh<Dim>(half_extents);
  obstacle.turn = tilt<Dim>(degrees);
  if (kind != Slope::kHalfSpace) obstacle.place = -half_extents.y() * obstacle.turn.col(1);
  obstacle.friction = friction;
  return obstacle;
}

/// The body on top of its slope, at rest, felt all around.
template <int Dim>
SceneOf<Dim> on_slope(const BodyOf<Dim>& body, Slope kind, double degrees, double friction) {
  SceneOf<Dim> scene = scene_of(body, {});
  scene.has_ground = false;
  scene.obstacles = {slope_obstacle<Dim>(kind, degrees, friction)};
  touch_with_whole_surface(scene);
  return scene;
}

template <int Dim>
StateOf<Dim> laid_on(const SceneOf<Dim>& scene, double gap) {
  const ObstacleOf<Dim>& slope = scene.obstacles.front();
  StateOf<Dim> state{slope.turn * scene.body.rest, PointsOf<Dim>::Zero(Dim, scene.body.node_count())};
  const double lowest = (slope.turn.col(1).transpose() * state.x).minCoeff();
  state.x.colwise() += (gap - lowest) * slope.turn.col(1);
  return state;
}

template <int Dim>
void look_at_nothing(const StateOf<Dim>&, const StateOf<Dim>&, const ImpulsesOf<Dim>&) {}

template <int Dim>
ContactWork contact_work(Method method, const SceneOf<Dim>& scene, StateOf<Dim> state, int steps) {
  const auto stepper = make_stepper<Dim>(method, scene);
  ImpulsesOf<Dim> impulses = make_impulses(scene);
  const Eigen::VectorXd passive = Eigen::VectorXd::Ones(scene.body.edge_count());
  for (int s = 0; s < steps; ++s) EXPECT_EQ(stepper->step(kDt, passive, nullptr, state, impulses), Termination::kDone);
  ContactWork work = stepper->work().by_impulses;
  return work += stepper->work().by_potential;
}

METHOD_TEST(Contact, IsCountedAsOftenAsItSearchesLooksAndPushes) {
  constexpr int kSteps = 12;
  const BodyOf<Dim> body = bar<Dim>(3, 2, 2, 0.1);
  SceneOf<Dim> alone = on_slope(body, Slope::kHalfSpace, 0, 0.5);
  const StateOf<Dim> lying = laid_on(alone, -1e-4), far = laid_on(alone, 3);
  const double places = alone.contact_points.count();
  const ContactWork above = contact_work(method, alone, far, kSteps), on_plane = contact_work(method, alone, lying, kSteps);
  alone.obstacles.clear();
  const ContactWork nothing = contact_work(method, alone, lying, kSteps);
  EXPECT_EQ(nothing.searched + nothing.looks + nothing.wide_looks + nothing.pushes, 0);
  EXPECT_EQ(above.searched, kSteps * places);
  EXPECT_EQ(above.looks + above.wide_looks + above.pushes, 0);
  EXPECT_GE(on_plane.searched, kSteps * places);
  EXPECT_GT(on_plane.looks, 0);
  EXPECT_GT(on_plane.pushes, 0);
  EXPECT_EQ(on_plane.wide_looks, 0);  // a plane is felt by places alone
  const SceneOf<Dim> on_box = on_slope(body, Slope::kBox, 0, 0.5);
  const ContactWork box = contact_work(method, on_box, lying, kSteps);
  EXPECT_GT(box.searched, on_plane.searched);
  EXPECT_GT(box.wide_looks, 0);
  for (const ContactWork& work : {above, on_plane, box}) EXPECT_EQ(work.own_searched, 0);
}

METHOD_TEST(Contact, OfABodyWithItselfIsCounted) {
  const BodyOf<Dim> body = bar<Dim>(8, 1, 1, 0.1);
  SceneOf<Dim> scene = on_slope(body, Slope::kHalfSpace, 0, 0.5);
  const StateOf<Dim> lying = laid_on(scene, -1e-4);
  EXPECT_EQ(contact_work(method, scene, lying, 4).own_searched, 0);
  scene.self_contact.is_on = true;
  EXPECT_GT(contact_work(method, scene, lying, 4).own_searched, 0);
}

METHOD_TEST(Contact, HoldsABlockOnASlopeOfAnyKindWithinTheCone) {
  for (const Slope kind : kSlopes) {
    if (is_draft(method) && kind != Slope::kHalfSpace) continue;  // contact is the explicit method's
    SCOPED_TRACE(static_cast<int>(kind));
    const SceneOf<Dim> scene = on_slope(bar<Dim>(4, 2, 2, 0.1), kind, 20, 0.5);
    VectorOf<Dim> settled = VectorOf<Dim>::Zero();
    int steps = 0;
    double residual = 0;
    const StateOf<Dim> end =
        simulate<Dim>(method, scene, laid_on(scene, 0), kDt, 480,
                      [&](const StateOf<Dim>& before, const StateOf<Dim>& after, const ImpulsesOf<Dim>& impulses) {
                        if (++steps == 240) settled = centre_of_mass(scene.body, after.x);
                        residual = std::max(residual, momentum_residual(scene, before, after, impulses, kDt));
                      });
    EXPECT_LT(residual, 1e-6);
    if (kSanitized) continue;  // the rest is of the end
    EXPECT_LT((centre_of_mass(scene.body, end.x) - settled).norm(), 0.0005);  // [m] in one second
  }
}

METHOD_TEST(Contact, LetsABlockSlideDownASlopeOfAnyKindBeyondTheCone) {
  for (const Slope kind : kSlopes) {
    if (is_draft(method) && kind != Slope::kHalfSpace) continue;  // contact is the explicit method's
    SCOPED_TRACE(static_cast<int>(kind));
    const BodyOf<Dim> brick = bar<Dim>(6, 2, 4, 0.1);
    const SceneOf<Dim> scene = on_slope(brick, kind, 20, 0.3);
    const VectorOf<Dim> downhill = -scene.obstacles.front().turn.col(0);
    double speed = 0, faster = 0;
    int steps = 0;
    simulate<Dim>(method, scene, laid_on(scene, 0), kDt, 480,
                  [&](const StateOf<Dim>&, const StateOf<Dim>& after, const ImpulsesOf<Dim>&) {
                    const double along = downhill.dot(momentum(brick, after.v)) / brick.mass.sum();
                    if (++steps == 240) speed = along;
                    faster = along - speed;
                  });
    if (kSanitized) continue;  // the rest is of the end
    const double angle = 20 * 3.14159265358979323846 / 180;
    EXPECT_NEAR(faster / (kGravity * (std::sin(angle) - 0.3 * std::cos(angle))), 1, 0.02);  // in the second second
  }
}

METHOD_TEST(Contact, GivesEachObstacleItsOwnFriction) {
  // Rough to the left of the origin, without friction to the right: two blocks' worth of floor.
  const BodyOf<Dim> brick = bar<Dim>(4, 2, 2, 0.1);
  for (const bool starts_on_ice : {false, true}) {
    SceneOf<Dim> scene = scene_of(brick, {});
    scene.has_ground = false;
    scene.obstacles.resize(2);
    for (std::size_t n = 0; n < 2; ++n) {
      scene.obstacles[n].shape = BoxOf<Dim>{vec<Dim>(5, 1, 5)};
      scene.obstacles[n].place = vec<Dim>(n == 0 ? -5 : 5, -1, 0);
    }
    scene.obstacles[0].friction = 0.4;
    scene.obstacles[1].friction = 0;
    touch_with_whole_surface(scene);
    StateOf<Dim> state{scene.body.rest, PointsOf<Dim>::Zero(Dim, scene.body.node_count())};
    state.x.row(0).array() += starts_on_ice ? 1 : -3;
    state.v.row(0).setConstant(1);
    const StateOf<Dim> end = simulate<Dim>(method, scene, state, kDt, 48, look_at_nothing<Dim>);
    if (kSanitized) continue;  // the rest is of the end
    const double speed = momentum(brick, end.v).x() / brick.mass.sum();
    EXPECT_NEAR(speed, starts_on_ice ? 1 : 1 - 0.4 * kGravity * 0.2, starts_on_ice ? 1e-9 : 0.03);
  }
}

METHOD_TEST(Contact, RollsABallDownASlopeAsItsInertiaSays) {
  constexpr double kRadius = 0.25, kDegrees = 8;
  Material material;
  material.youngs_modulus = 1e6;
  material.damping_time = 0.0005;
  const SceneOf<Dim> scene = on_slope(ball<Dim>(Dim == 2 ? 16 : 6, kRadius, material), Slope::kBox, kDegrees, 1.0);
  const BodyOf<Dim>& body = scene.body;
  const double mass = body.mass.sum(), turning_inertia = inertia(body, body.rest, centre_of_mass(body, body.rest))(0, 0);
  const VectorOf<Dim> downhill = -scene.obstacles.front().turn.col(0);
  double speed = 0, turns = 0, way = 0;
  int steps = 0;
  simulate<Dim>(method, scene, laid_on(scene, 0.0), kDt, 240,
                [&](const StateOf<Dim>&, const StateOf<Dim>& after, const ImpulsesOf<Dim>&) {
                  speed = downhill.dot(momentum(body, after.v)) / mass;
                  if (++steps <= 80) return;
                  way += speed;
                  turns += angular_momentum(body, after.x, after.v, centre_of_mass(body, after.x)).norm() / turning_inertia;
                });
  if (kSanitized) return;  // the rest is of the end
  const double expected =
      kGravity * std::sin(kDegrees * 3.14159265358979323846 / 180) / (1 + turning_inertia / (mass * kRadius * kRadius));
  // After a second; the corners of the mesh take a little, of a softer ball more.
  EXPECT_NEAR(speed / expected, 1, is_draft(method) ? 0.15 : 0.05);
  EXPECT_NEAR(turns * kRadius / way, 1, 0.03);  // it does not slip
}

METHOD_TEST(Contact, ThrowsAFallingBarBackAsItsWavesSay) {
  if (method == Method::kEuler) GTEST_SKIP() << "backward Euler damps the waves";
  constexpr double kLength = 1.6, kSpeed = 0.1;
  Material material;
  material.damping_time = 0;
  material.bulk_factor = 0;
  SceneOf<Dim> scene = scene_of(bar<Dim>(1, 16, 1, 0.1, material), {});
  scene.gravity.setZero();
  touch_with_whole_surface(scene);
  StateOf<Dim> state{scene.body.rest, PointsOf<Dim>::Zero(Dim, scene.body.node_count())};
  state.v.row(1).setConstant(-kSpeed);
  const double wave_speed = std::sqrt(material.youngs_modulus / material.density);
  double touched = 0;
  const double dt = kLength / wave_speed / 100;
  const StateOf<Dim> end = simulate<Dim>(method, scene, state, dt, 400,
                                         [&](const StateOf<Dim>&, const StateOf<Dim>&, const ImpulsesOf<Dim>& impulses) {
                                           if (impulses.contact.norm() > 0) touched += dt;
                                         });
  if (kSanitized) return;  // the rest is of the end
  EXPECT_NEAR(touched / (2 * kLength / wave_speed), 1, 0.2);  // the wave runs up and down once
  const double back = momentum(scene.body, end.v).y() / scene.body.mass.sum() / kSpeed;
  EXPECT_GT(back, 0.8);
  EXPECT_LE(back, 1);
}

METHOD_TEST(Contact, StopsAFallOnAnythingWithinTwoPercentOfTheBodysSize) {
  for (int kind = 0; kind < 5; ++kind) {
    SCOPED_TRACE(kind);
    SceneOf<Dim> scene = scene_of(bar<Dim>(5, 3, 3, 0.1), {});
    scene.has_ground = false;
    scene.obstacles.resize(1);
    ObstacleOf<Dim>& obstacle = scene.obstacles.front();
    obstacle.place = vec<Dim>(0.26, -0.5, 0.14);
    if (kind == 0) obstacle.shape = Ball{0.5};
    if (kind == 1) obstacle.shape = Ball{0.06}, obstacle.place.y() = -0.06;
    if (kind == 2) obstacle.shape = BoxOf<Dim>{vec<Dim>(0.5, 0.5, 0.5)};
    if (kind == 3) obstacle.shape = ball_mesh<Dim>(8, 0.5);
    if (kind == 4) {  // an edge inside one element
      obstacle.shape = BoxOf<Dim>{vec<Dim>(0.3, 0.3, 2)};
      obstacle.turn = tilt<Dim>(45);
      obstacle.place.y() = -0.3 * std::sqrt(2);
    }
    touch_with_whole_surface(scene);
    StateOf<Dim> state{scene.body.rest, PointsOf<Dim>::Zero(Dim, scene.body.node_count())};
    state.x.row(1).array() += 0.02;
    state.v.row(1).setConstant(-1);  // [m/s]
    double deepest = 0, residual = 0;
    int steps = 0;
    VectorOf<Dim> carried = VectorOf<Dim>::Zero();
    simulate<Dim>(method, scene, state, kDt, 120,
                  [&](const StateOf<Dim>& before, const StateOf<Dim>& after, const ImpulsesOf<Dim>& impulses) {
                    if (++steps % 4 == 0) deepest = std::max(deepest, deepest_place(scene, after));
                    residual = std::max(residual, momentum_residual(scene, before, after, impulses, kDt));
                    carried += impulses.contact.rowwise().sum();
                  });
    EXPECT_LT(deepest, 0.02 * size_of(scene.body));
    EXPECT_LT(residual, 1e-6);
    if (kSanitized) continue;  // the rest is of the end
    EXPECT_GT(carried.y(), 0.5 * scene.body.mass.sum());  // [N s]: it has met it
  }
}

METHOD_TEST(Contact, BooksTheWorkOfAPlateThatLifts) {
  constexpr double kSpeed = 0.2;
  SceneOf<Dim> scene = scene_of(bar<Dim>(4, 2, 2, 0.1), {});
  scene.has_ground = false;
  scene.obstacles.resize(1);
  scene.obstacles.front().shape = BoxOf<Dim>{vec<Dim>(1, 0.1, 1)};
  scene.obstacles.front().place = vec<Dim>(0, -0.1, 0);
  touch_with_whole_surface(scene);
  StateOf<Dim> state{scene.body.rest, PointsOf<Dim>::Zero(Dim, scene.body.node_count())};
  // Settle first, then lift for a second.
  state = simulate<Dim>(method, scene, state, kDt, 240, look_at_nothing<Dim>);
  state.v.row(1).array() += kSpeed;
  scene.obstacles.front().velocity = vec<Dim>(0, kSpeed, 0);
  const double at_first = energy(scene, state, passive(scene.body));
  double work = 0;
  const StateOf<Dim> end = simulate<Dim>(
      method, scene, state, kDt, 240,
      [&](const StateOf<Dim>&, const StateOf<Dim>&, const ImpulsesOf<Dim>& impulses) { work += impulses.obstacle_work; });
  if (kSanitized) return;  // the rest is of the end
  const double weight = scene.body.mass.sum() * kGravity;
  EXPECT_NEAR(work / (weight * kSpeed), 1, 0.01);  // [J] in one second
  EXPECT_NEAR((energy(scene, end, passive(scene.body)) - at_first) / work, 1, 0.01);
  EXPECT_NEAR(end.obstacle_travel(1, 0), kSpeed, 1e-12);
}

METHOD_TEST(Contact, CarriesABlockAlongOnAPlateThatMovesSideways) {
  SceneOf<Dim> scene = scene_of(bar<Dim>(4, 2, 2, 0.1), {});
  scene.has_ground = false;
  scene.obstacles.resize(1);
  scene.obstacles.front().velocity = vec<Dim>(0.5, 0, 0);
  scene.obstacles.front().friction = 0.5;
  touch_with_whole_surface(scene);
  const StateOf<Dim> state{scene.body.rest, PointsOf<Dim>::Zero(Dim, scene.body.node_count())};
  double work = 0;
  const StateOf<Dim> end = simulate<Dim>(
      method, scene, state, kDt, 240,
      [&](const StateOf<Dim>&, const StateOf<Dim>&, const ImpulsesOf<Dim>& impulses) { work += impulses.obstacle_work; });
  if (kSanitized) return;  // the rest is of the end
  const double mass = scene.body.mass.sum();
  EXPECT_NEAR(momentum(scene.body, end.v).x() / mass, 0.5, 0.01);
  EXPECT_NEAR(work / (mass * 0.5 * 0.5), 1, 0.03);  // half of it went into heat while it slipped
}

METHOD_TEST(Contact, LiftsABodyOutOfWhatItStartsInWithoutThrowingIt) {
  for (const bool is_ball : {false, true}) {
    SceneOf<Dim> scene = scene_of(bar<Dim>(4, 3, 3, 0.1), {});
    scene.has_ground = false;
    scene.obstacles.resize(1);
    if (is_ball) {
      scene.obstacles.front().shape = Ball{1};
      scene.obstacles.front().place = vec<Dim>(0.2, -0.9, 0.15);
    } else {
      scene.obstacles.front().shape = BoxOf<Dim>{vec<Dim>(2, 1, 2)};
      scene.obstacles.front().place = vec<Dim>(0, -0.9, 0);
    }
    touch_with_whole_surface(scene);
    StateOf<Dim> state{scene.body.rest, PointsOf<Dim>::Zero(Dim, scene.body.node_count())};
    const double at_first = energy(scene, state, passive(scene.body)), height = centre_of_mass(scene.body, state.x).y();
    double work = 0, excess = -1e9, highest = 0;
    const double scale = scene.body.mass.sum() * kGravity * size_of(scene.body);
    const StateOf<Dim> end =
        simulate<Dim>(method, scene, state, kDt, 240,
                      [&](const StateOf<Dim>&, const StateOf<Dim>& after, const ImpulsesOf<Dim>& impulses) {
                        work += impulses.obstacle_work;
                        excess = std::max(excess, energy(scene, after, passive(scene.body)) - at_first - work);
                        highest = std::max(highest, centre_of_mass(scene.body, after.x).y() - height);
                      });
    EXPECT_LT(excess, is_draft(method) ? 0.2 * scale : 0.01 * scale);  // drafts leave some energy uncounted
    EXPECT_LT(highest, 0.1 + 0.1 * size_of(scene.body));
    if (kSanitized) continue;  // the rest is of the end
    EXPECT_LT(deepest_place(scene, end), 0.02 * size_of(scene.body));
    EXPECT_GT(jacobians(scene.body, end.x).minCoeff(), 0.5);
  }
}

}  // namespace
}  // namespace hydrostat::physics::contact_test
