#include "physics/self_contact.h"

#include <gtest/gtest.h>

#include "physics/nearest_on_face.h"
#include "tests/physics/method_cases.h"

namespace hydrostat::physics::self_contact_test {
namespace {

constexpr double kDt = 1.0 / 240;  // [s]
constexpr double kCell = 0.1;      // [m]

//   +---+---+       +---+---+
//   |   |   |       |   |   |   two blocks of one body, a cell apart
//   +---+---+       +---+---+
//   |   |   |       |   |   |
//   +---+---+       +---+---+
template <int Dim>
SceneOf<Dim> two_blocks(bool with_gravity, const Material& material = {1000, 2e5, 4, 0.01}) {
  const auto keep = [](int i, int, int) { return i != 2; };
  SceneOf<Dim> scene = in_the_air(body_of(make_lattice<Dim>(5, 2, 2, kCell, keep), material), with_gravity);
  scene.self_contact.is_on = true;
  scene.self_contact.friction = 0.5;
  return scene;
}
template <int Dim>
bool is_second(const SceneOf<Dim>& scene, int node) {
  return scene.body.rest(0, node) > 2.5 * kCell;
}

/// The deepest that any place of the surface lies in an element that is no neighbour of its face [m]: looked for everywhere,
/// by distance to the nearest face that is none.
template <int Dim>
double deepest_inside_itself(const BodyOf<Dim>& body, const PointsOf<Dim>& x) {
  std::vector<std::set<int>> near(static_cast<std::size_t>(body.node_count()));
  for (int i = 0; i < body.node_count(); ++i) near[static_cast<std::size_t>(i)].insert(i);
  for (int e = 0; e < body.edge_count(); ++e) {
    near[static_cast<std::size_t>(body.edges(0, e))].insert(body.edges(1, e));
    near[static_cast<std::size_t>(body.edges(1, e))].insert(body.edges(0, e));
  }
  const auto are_near = [&](const auto& some, const auto& others) {
    for (const int a : some) {
      for (const int b : others) {
        for (const int c : near[static_cast<std::size_t>(a)]) {
          if (near[static_cast<std::size_t>(c)].count(b) > 0) return true;
        }
      }
    }
    return false;
  };
  constexpr int kParts = 4;
  double deepest = 0;
  const std::vector<SurfaceFace> faces = surface_faces(body);
  for (const SurfaceFace& face : faces) {
    const Eigen::Matrix<int, Dim, 1> nodes = nodes_of_face(body, face);
    for (int i = 0; i <= kParts; ++i) {
      for (int j = 0; j <= (Dim == 3 ? kParts - i : 0); ++j) {
        const double weights[3] = {1 - static_cast<double>(i + j) / kParts, static_cast<double>(i) / kParts,
                                   static_cast<double>(j) / kParts};
        VectorOf<Dim> place = VectorOf<Dim>::Zero();
        for (int k = 0; k < Dim; ++k) place += weights[k] * x.col(nodes[k]);
        for (int t = 0; t < body.tet_count(); ++t) {
          BlockOf<Dim> spans;
          for (int k = 0; k < Dim; ++k) spans.col(k) = x.col(body.tets(k + 1, t)) - x.col(body.tets(0, t));
          const VectorOf<Dim> inside = spans.inverse() * (place - x.col(body.tets(0, t)));
          if (!(inside.minCoeff() > 0) || !(inside.sum() < 1) || are_near(nodes, body.tets.col(t))) continue;
          double depth = 1e300;
          for (const SurfaceFace& other : faces) {
            const Eigen::Matrix<int, Dim, 1> corners = nodes_of_face(body, other);
            if (are_near(nodes, corners)) continue;
            VectorOf<Dim> foot;
            const BlockOf<Dim> at = corners_of_face<Dim>(x, corners);
            nearest_on_face<Dim>(place, at, foot);
            depth = std::min(depth, (place - at * foot).norm());
          }
          deepest = std::max(deepest, depth);
        }
      }
    }
  }
  return deepest;
}

/// By how much more the angular momentum changed in a step than gravity and contact with others say [kg m2/s].
template <int Dim>
double unexplained_turn(const SceneOf<Dim>& scene, const StateOf<Dim>& before, const StateOf<Dim>& after,
                        const ImpulsesOf<Dim>& impulses) {
  const VectorOf<Dim> origin = VectorOf<Dim>::Zero();
  return (angular_momentum(scene.body, after.x, after.v, origin) - angular_momentum(scene.body, before.x, before.v, origin) -
          impulses.gravity_moment - impulses.contact_moment)
      .norm();
}

template <typename Type>
class SelfContacts : public testing::Test {};
using SelfContactCases =
    std::conditional_t<kSanitized,
                       testing::Types<Case<2, Method::kExplicit>, Case<2, Method::kImplicit>, Case<2, Method::kEuler>>,
                       testing::Types<Case<2, Method::kExplicit>, Case<2, Method::kImplicit>, Case<2, Method::kEuler>,
                                      Case<2, Method::kXpbd>, Case<2, Method::kSpring>, Case<3, Method::kExplicit>,
                                      Case<3, Method::kImplicit>, Case<3, Method::kEuler>>>;
TYPED_TEST_SUITE(SelfContacts, SelfContactCases, CaseName);

METHOD_TEST(SelfContacts, LetTwoBlocksCollideWithoutAnyOneOutsideKnowing) {
  for (unsigned seed = 0; seed < trials(3u); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const SceneOf<Dim> scene = two_blocks<Dim>(false);
    StateOf<Dim> start{scene.body.rest, PointsOf<Dim>::Zero(Dim, scene.body.node_count())};
    const BlockOf<Dim> turn = random_rotation<Dim>(random);
    const VectorOf<Dim> middle = vec<Dim>(4 * kCell, kCell, kCell), aside = random_points<Dim>(random, 1, 0.05).col(0);
    for (int i = 0; i < scene.body.node_count(); ++i) {
      if (!is_second(scene, i)) continue;
      start.x.col(i) = middle + vec<Dim>(kCell, 0, 0) + aside + turn * (start.x.col(i) - middle);
      start.v.col(i) = vec<Dim>(-1.5, 0, 0);
    }
    const double mass = scene.body.mass.sum(), energy_at_first = kinetic_energy(scene.body, start.v);
    double touched = 0, deepest = 0;
    int steps = 0;
    const StateOf<Dim> end =
        simulate(method, scene, start, kDt, 120,
                 [&](const StateOf<Dim>& before, const StateOf<Dim>& after, const ImpulsesOf<Dim>& impulses) {
                   EXPECT_LT((momentum(scene.body, after.v) - momentum(scene.body, before.v)).norm(),
                             mass * linear_tolerance(method));
                   EXPECT_LT(unexplained_turn(scene, before, after, impulses), mass * angular_tolerance(method));
                   EXPECT_EQ(impulses.contact_nodes.norm(), 0);
                   EXPECT_LT(impulses.internal_nodes.rowwise().sum().norm(), 1e-12 * mass);
                   touched += impulses.internal_nodes.norm();
                   if (++steps % 4 == 0) deepest = std::max(deepest, deepest_inside_itself(scene.body, after.x));
                 });
    if (kSanitized) continue;  // the rest is of the end
    EXPECT_GT(touched, 0.5);
    EXPECT_LT(deepest, 0.02 * size_of(scene.body));
    EXPECT_LT(kinetic_energy(scene.body, end.v), energy_at_first);
    VectorOf<Dim> first = VectorOf<Dim>::Zero(), second = first;
    for (int i = 0; i < scene.body.node_count(); ++i)
      (is_second(scene, i) ? second : first) += scene.body.mass[i] * end.v.col(i);
    EXPECT_GT(second.x(), first.x() - 0.05 * mass);  // they part
  }
}

/// The second block laid on the first, which is held, both tilted against gravity.
template <int Dim>
StateOf<Dim> piled(SceneOf<Dim>& scene, double degrees, double overlap) {
  StateOf<Dim> start{scene.body.rest, PointsOf<Dim>::Zero(Dim, scene.body.node_count())};
  for (int i = 0; i < scene.body.node_count(); ++i) {
    if (is_second(scene, i)) {
      start.x.col(i) += vec<Dim>(-2.5 * kCell, 2 * kCell - overlap, 0.4 * kCell);  // no node on a node
    } else {
      scene.body.held.push_back(i);
    }
  }
  scene.gravity = 9.81 * (tilt<Dim>(degrees) * -VectorOf<Dim>::UnitY());
  return start;
}

template <int Dim>
double speed_of_second(const SceneOf<Dim>& scene, const StateOf<Dim>& state) {
  double momentum = 0, mass = 0;
  for (int i = 0; i < scene.body.node_count(); ++i) {
    if (!is_second(scene, i)) continue;
    momentum += scene.body.mass[i] * state.v(0, i);
    mass += scene.body.mass[i];
  }
  return momentum / mass;
}

METHOD_TEST(SelfContacts, HoldABlockOnABlockWithinTheConeAndLetItSlideBeyond) {
  if (is_draft(method)) GTEST_SKIP() << "a draft's friction is not to be trusted to a few percent";
  for (const double friction : {0.5, 0.3}) {
    SCOPED_TRACE(friction);
    SceneOf<Dim> scene = two_blocks<Dim>(true, {1000, 2e6, 4, 0.01});
    scene.self_contact.friction = friction;
    const StateOf<Dim> start = piled(scene, 20, 0);
    double speed = 0, held = 0;
    int steps = 0;
    const StateOf<Dim> end = simulate(method, scene, start, kDt, 96,
                                      [&](const StateOf<Dim>&, const StateOf<Dim>& after, const ImpulsesOf<Dim>& impulses) {
                                        if (++steps == 48) speed = speed_of_second(scene, after);
                                        if (steps > 48) held += impulses.hold.row(1).sum();
                                      });
    if (kSanitized) continue;  // the rest is of the end
    const double faster = speed_of_second(scene, end) - speed, angle = 20 * 3.14159265358979323846 / 180;
    const double expected = friction > std::tan(angle) ? 0 : 9.81 * (std::sin(angle) - friction * std::cos(angle));
    EXPECT_NEAR(faster / (48 * kDt), expected, 0.03 * 9.81);
    EXPECT_NEAR(held / (48 * kDt) / (scene.body.mass.sum() * 9.81 * std::cos(angle)), 1, 0.03);  // it bears both
    EXPECT_LT(deepest_inside_itself(scene.body, end.x), 0.005 * size_of(scene.body));
  }
}

METHOD_TEST(SelfContacts, PushApartWhatOverlapsAtTheStartWithoutThrowingIt) {
  for (const double overlap : {0.1 * kCell, 0.3 * kCell}) {
    SCOPED_TRACE(overlap);
    SceneOf<Dim> scene = two_blocks<Dim>(true, {1000, 2e6, 4, 0.01});
    const StateOf<Dim> start = piled(scene, 0, overlap);
    double fastest = 0;
    const StateOf<Dim> end = simulate(method, scene, start, kDt, 240,
                                      [&](const StateOf<Dim>&, const StateOf<Dim>& after, const ImpulsesOf<Dim>&) {
                                        fastest = std::max(fastest, after.v.colwise().norm().maxCoeff());
                                      });
    if (kSanitized) continue;  // the rest is of the end
    EXPECT_LT(deepest_inside_itself(scene.body, end.x), 0.005 * size_of(scene.body));
    EXPECT_LT(fastest, 4 * push_out_speed(scene));
    EXPECT_LT(end.v.colwise().norm().maxCoeff(), 0.05);
    for (int i = 0; i < scene.body.node_count(); ++i) {
      EXPECT_TRUE(!is_second(scene, i) || end.x(1, i) > 1.9 * kCell);  // it lies on the other
    }
  }
}

METHOD_TEST(SelfContacts, StopABarThatCurlsUp) {
  SceneOf<Dim> scene = in_the_air(bar<Dim>(20, 2, 1, kCell, {1000, 2e5, 4, 0.01}), false);
  scene.self_contact.is_on = true;
  Eigen::VectorXd curled = passive(scene.body);
  for (int e = 0; e < scene.body.edge_count(); ++e) {
    const VectorOf<Dim> span = scene.body.rest.col(scene.body.edges(1, e)) - scene.body.rest.col(scene.body.edges(0, e));
    // More at one end than at the other: a spiral, whose head meets the side.
    const double place = scene.body.rest(0, scene.body.edges(0, e)) / (20 * kCell);
    const double height = (scene.body.rest(1, scene.body.edges(0, e)) + scene.body.rest(1, scene.body.edges(1, e))) / 2;
    curled[e] += (0.65 - 0.3 * place) * (height / kCell - 1) * std::pow(span.normalized().x(), 2);
  }
  for (const bool on : {true, false}) {
    SCOPED_TRACE(on ? "on" : "off");
    scene.self_contact.is_on = on;
    const std::unique_ptr<StepperOf<Dim>> stepper = make_stepper(method, scene);
    ImpulsesOf<Dim> impulses = make_impulses(scene);
    StateOf<Dim> state{scene.body.rest, PointsOf<Dim>::Zero(Dim, scene.body.node_count())};
    double touched = 0, deepest = 0;
    const double mass = scene.body.mass.sum();
    for (int k = 0; k < few_steps(240); ++k) {
      const StateOf<Dim> before = state;
      const Eigen::VectorXd activation = passive(scene.body) + std::min(1.0, k / 200.0) * (curled - passive(scene.body));
      ASSERT_EQ(stepper->step(kDt, activation, nullptr, state, impulses), Termination::kDone) << k;
      EXPECT_LT((momentum(scene.body, state.v) - momentum(scene.body, before.v)).norm(), mass * linear_tolerance(method));
      if (stepper->guard_steps() == 0) {
        EXPECT_LT(unexplained_turn(scene, before, state, impulses), mass * angular_tolerance(method));
      }
      touched += impulses.internal_nodes.norm();
      if (k % 16 == 0) deepest = std::max(deepest, deepest_inside_itself(scene.body, state.x));
    }
    if (kSanitized) continue;  // the rest is of the end
    if (on) {
      EXPECT_GT(touched, 0);
      EXPECT_LT(deepest, (is_draft(method) ? 0.05 : 0.02) * size_of(scene.body));
    } else {
      EXPECT_GT(deepest, 0.05 * size_of(scene.body));  // it would go through itself
    }
  }
}

TEST(SelfContactSets, FindNothingInABodyThatIsOnlyStrained) {
  const auto expect_nothing = []<int Dim>(const SceneOf<Dim>& scene, std::mt19937& random) {
    for (int n = 0; n < trials(20); ++n) {
      SCOPED_TRACE(n);
      BlockOf<Dim> strain = BlockOf<Dim>::Identity() + random_points<Dim>(random, Dim, 0.6);
      if (n == 0) strain = vec<Dim>(1.5, 0.3, 1.5).asDiagonal();  // between two plates
      if (!(strain.determinant() > 0.1)) continue;
      SelfContactSet<Dim> set(scene);
      EXPECT_EQ(set.deepest(strain * scene.body.rest), 0);
    }
  };
  std::mt19937 random(3);
  SceneOf<2> flat = scene_of(four_legged<2>(), {});
  flat.self_contact.is_on = true;
  expect_nothing(flat, random);
  SceneOf<3> whole = scene_of(four_legged<3>(), {});
  whole.self_contact.is_on = true;
  expect_nothing(whole, random);
}

//   +---+ ... +---+      +---+  +---+
//   |    bends    |      |   held   |   a bar, and two cells of the same body that are held, a cell apart
//   +---+ ... +---+      +---+  +---+
constexpr double kExact = 0.125;  // [m], so that the held cells stand unstrained wherever they are
constexpr int kBar = 16;          // cells
template <int Dim>
SceneOf<Dim> bar_beside_two_cells() {
  const auto keep = [](int i, int j, int) { return i < kBar || (j == 0 && (i == kBar + 8 || i == kBar + 10)); };
  SceneOf<Dim> scene = in_the_air(body_of(make_lattice<Dim>(kBar + 11, 2, 1, kExact, keep), {1000, 2e5, 4, 0.01}), false);
  for (int i = 0; i < scene.body.node_count(); ++i) {
    if (scene.body.rest(0, i) > (kBar + 1) * kExact) scene.body.held.push_back(i);
  }
  scene.self_contact.is_on = true;
  return scene;
}
template <int Dim>
Eigen::VectorXd curl(const BodyOf<Dim>& body, double strength) {
  Eigen::VectorXd activation = passive(body);
  for (int e = 0; e < body.edge_count(); ++e) {
    const VectorOf<Dim> a = body.rest.col(body.edges(0, e)), b = body.rest.col(body.edges(1, e));
    if (a.x() > (kBar + 1) * kExact) continue;
    activation[e] += strength * (1 - a.x() / (2 * kBar * kExact)) * ((a + b).y() / (2 * kExact) - 1) * std::pow((b - a).normalized().x(), 2);
  }
  return activation;
}

METHOD_TEST(SelfContacts, MoveNoBitOtherwiseWhereSomethingElseIsNear) {
  const SceneOf<Dim> scene = bar_beside_two_cells<Dim>();
  double touched = 0;
  for (unsigned seed = 0; seed < trials(Dim == 3 ? 2u : 3u); ++seed) {
    std::mt19937 random(seed);
    StateOf<Dim> alone{scene.body.rest, random_points<Dim>(random, scene.body.node_count(), 0.5)};
    for (const int i : scene.body.held) alone.v.col(i).setZero();
    StateOf<Dim> beside = alone;  // here the two keep the body looking at itself in every step
    for (const int i : scene.body.held) {
      if (scene.body.rest(0, i) > (kBar + 9.5) * kExact) beside.x(0, i) -= 0.9375 * kExact;
    }
    const std::unique_ptr<StepperOf<Dim>> one = make_stepper(method, scene), other = make_stepper(method, scene);
    ImpulsesOf<Dim> impulses = make_impulses(scene), others = impulses;
    const Eigen::VectorXd whole = curl(scene.body, 0.6 + 0.1 * seed);
    for (int k = 0; k < few_steps(120); ++k) {
      const Eigen::VectorXd activation = passive(scene.body) + std::min(1.0, k / 40.0) * (whole - passive(scene.body));
      ASSERT_EQ(one->step(kDt, activation, nullptr, alone, impulses), Termination::kDone) << k;
      ASSERT_EQ(other->step(kDt, activation, nullptr, beside, others), Termination::kDone) << k;
      ASSERT_EQ(alone.v, beside.v) << k << " seed " << seed;
      for (int i = 0; i < scene.body.node_count(); ++i) {
        ASSERT_TRUE(scene.body.rest(0, i) > (kBar + 1) * kExact || alone.x.col(i) == beside.x.col(i)) << k << " node " << i;
      }
      touched += impulses.internal_nodes.norm();
    }
  }
  EXPECT_TRUE(kSanitized || touched > 0);
}

TEST(SelfContactSets, LookSeldomWhileNothingIsNear) {
  const auto expect_few = []<int Dim>(const BodyOf<Dim>& body, double speed) {
    SCOPED_TRACE(speed);
    SceneOf<Dim> scene = in_the_air(body, false);
    scene.self_contact.is_on = true;
    SelfContactSet<Dim> set(scene);
    std::vector<ContactOf<Dim>> found;
    const double reach = 0.15 * body.rest_length.minCoeff(), spare = 0.2 * body.rest_length.minCoeff();
    PointsOf<Dim> gathered_at = body.rest;
    int of_a_list = 0;  // how often one that is kept until a node has moved by what it spares is made
    for (int k = 0; k < 960; ++k) {
      PointsOf<Dim> x = body.rest;
      const double height = Dim == 3 ? 0.03 : 0.15;  // of a wave along it [-]
      x.row(1).array() += height * body.rest.row(0).array() * (4 * body.rest.row(0).array() - 6 * k * kDt).sin();
      x.row(0).array() += speed * k * kDt;
      found.clear();
      set.find(x, reach, 0, found);
      EXPECT_TRUE(k == 0 || found.empty());
      if (k > 0 && (x - gathered_at).colwise().norm().maxCoeff() <= spare) continue;
      gathered_at = x;
      ++of_a_list;
    }
    EXPECT_GT(set.searches(), 0);
    EXPECT_LT(4 * set.searches(), of_a_list);
  };
  for (const double speed : {0.5, 5.0}) {
    expect_few(bar<2>(20, 2, 1, 0.05), speed);
    expect_few(bar<3>(20, 2, 2, 0.05), speed);
  }
}

TEST(SelfContactSets, FindWhatOnesThatNeverLookedFind) {
  const auto expect_same = []<int Dim>(unsigned seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const SceneOf<Dim> scene = two_blocks<Dim>(false);
    const double reach = 0.1 * kCell;
    SelfContactSet<Dim> kept(scene);
    std::uniform_real_distribution<double> uniform(0.5, 2);
    const double turn = uniform(random), pace = uniform(random), first = uniform(random);
    const VectorOf<Dim> travel = random_points<Dim>(random, 1, 3).col(0);
    const auto near = [&](auto&& set, const PointsOf<Dim>& x) {
      std::vector<ContactOf<Dim>> found;
      set.find(x, reach, 0, found);
      std::erase_if(found, [&](const ContactOf<Dim>& contact) { return !(contact.gap < 2 * reach); });
      return found;
    };
    std::size_t in_reach = 0;
    for (int k = 0; k < 240; ++k) {
      const double time = k * kDt, angle = turn * time, away = 0.1 * kCell + 5 * kCell * std::pow(std::sin(first + 4 * pace * time), 2);
      PointsOf<Dim> x = scene.body.rest;
      for (int i = 0; i < scene.body.node_count(); ++i) {
        if (is_second(scene, i)) x(0, i) += away - kCell;
      }
      BlockOf<Dim> turned = BlockOf<Dim>::Identity();
      turned.template topLeftCorner<2, 2>() << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
      x = (turned * x).colwise() + time * travel;
      const std::vector<ContactOf<Dim>> found = near(kept, x), expected = near(SelfContactSet<Dim>(scene), x);
      const auto is_same = [](const ContactOf<Dim>& a, const ContactOf<Dim>& b) {
        return a.slot == b.slot && a.gap == b.gap && a.normal == b.normal;
      };
      ASSERT_TRUE(std::equal(found.begin(), found.end(), expected.begin(), expected.end(), is_same)) << k;
      in_reach += found.size();
    }
    EXPECT_GT(in_reach, 0u);
    EXPECT_LT(kept.searches(), 120);
  };
  for (unsigned seed = 0; seed < 5; ++seed) {
    expect_same.template operator()<2>(seed);
    if (seed < 2) expect_same.template operator()<3>(seed);
  }
}

}  // namespace
}  // namespace hydrostat::physics::self_contact_test
