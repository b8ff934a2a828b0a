#include "retarget/self_contact_plan.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <queue>

#include "physics/self_contact.h"
#include "retarget/sentence.h"

namespace hydrostat::retarget {
namespace {

constexpr double kNearCells = 2;  // edges of the mesh [-]: parts as near may come to touch
constexpr double kTargetCells = 1;   // parts of a creature that its target brings as near
constexpr double kFarCells = 4;   // parts of a creature that are nearer in the bind pose never touch
constexpr double kDetour = 3;     // way along the body over the gap [-] from which parts are far from each other
constexpr double kRing = 2 * std::numbers::pi;  // length over width of a bar that as a ring is strained by 1
constexpr double kMuchEnergy = 4;  // of what it takes [-]: methods of few iterations are softer than the material
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The shortest way along edges from a node to every other [m], infinite to those of other pieces. Source: Dijkstra 1959.
template <int Dim>
Eigen::VectorXd ways_from(const physics::BodyOf<Dim>& body, int node) {
  std::vector<std::vector<int>> edges_at(static_cast<std::size_t>(body.node_count()));
  for (int e = 0; e < body.edge_count(); ++e) {
    for (int end = 0; end < 2; ++end) edges_at[static_cast<std::size_t>(body.edges(end, e))].push_back(e);
  }
  Eigen::VectorXd way = Eigen::VectorXd::Constant(body.node_count(), kInfinity);
  std::priority_queue<std::pair<double, int>, std::vector<std::pair<double, int>>, std::greater<>> waiting;
  way[node] = 0;
  waiting.push({0, node});
  while (!waiting.empty()) {
    const auto [length, from] = waiting.top();
    waiting.pop();
    if (length > way[from]) continue;
    for (const int e : edges_at[static_cast<std::size_t>(from)]) {
      const int to = body.edges(0, e) == from ? body.edges(1, e) : body.edges(0, e);
      if (length + body.rest_length[e] >= way[to]) continue;
      way[to] = length + body.rest_length[e];
      waiting.push({way[to], to});
    }
  }
  return way;
}

/// What of the body faces what within `distance` [m] in a shape: the place's node and one of the tet across.
template <int Dim>
struct Facing {
  int node, across;
  double gap;  // [m]
  physics::ContactOf<Dim> contact;
};
template <int Dim>
std::vector<Facing<Dim>> facing_parts(physics::SelfContactSet<Dim>& set, const physics::PointsOf<Dim>& x, double distance) {
  std::vector<physics::ContactOf<Dim>> contacts;
  set.find(x, distance / 2, 0, contacts);
  std::vector<Facing<Dim>> parts;
  for (physics::ContactOf<Dim>& contact : contacts) {
    set.update(x, contact);
    if (!(contact.gap < distance)) continue;
    parts.push_back(
        {contact.nodes[0], contact.nodes[static_cast<std::size_t>(contact.node_count - 1)], contact.gap, contact});
  }
  return parts;
}

template <int Dim>
SelfContactPlan chosen(bool is_on, double friction, std::string reason) {
  SelfContactPlan plan;
  plan.settings.is_on = is_on;
  plan.settings.friction = friction;
  plan.reason = std::move(reason);
  return plan;
}

/// Whether two parts that are far from each other along the body are near each other in the rest shape.
template <int Dim>
bool has_near_parts(const physics::SceneOf<Dim>& scene, double cell) {
  physics::SceneOf<Dim> trial = scene;
  trial.self_contact = {};
  trial.self_contact.is_on = true;
  physics::SelfContactSet<Dim> set(trial);
  for (const Facing<Dim>& part : facing_parts<Dim>(set, scene.body.rest, kNearCells * cell)) {
    const double way = ways_from(scene.body, part.node)[part.across];
    if (way > kDetour * std::max(part.gap, cell)) return true;
  }
  return false;
}

}  // namespace

template <int Dim>
SelfContactPlan plan_self_contact(const ScenarioOf<Dim>& scenario, StartShape start, Wish wish, double friction, const Bar& bar,
                                  double duration_s) {
  const physics::SceneOf<Dim>& scene = scenario.scene;
  const physics::BodyOf<Dim>& body = scene.body;
  const auto plan = [&](bool is_on, std::string reason) { return chosen<Dim>(is_on, friction, std::move(reason)); };
  if (wish == Wish::kOn) return plan(true, "asked for by the scene");
  if (wish == Wish::kOff) return plan(false, "turned off by the scene: parts of the body pass through each other");
  if (start != StartShape::kRest) return plan(false, "a body that starts out of shape finds back through itself");
  const Eigen::VectorXd ways = ways_from(body, 0);
  if (!ways.allFinite()) return plan(true, "there are several pieces, which may meet");
  if (scenario.waves.empty() && !scene.has_ground && scene.obstacles.empty() && scenario.clamps.empty()) {
    return plan(false, "nothing bends the body: no activation, ground, obstacle or clamp");
  }
  Eigen::Index end;
  ways.maxCoeff(&end);
  const double length = ways_from(body, static_cast<int>(end)).maxCoeff(), section = body.rest_volume.sum() / length;
  const double slenderness = length / (Dim == 3 ? std::sqrt(section) : section);
  if (slenderness >= kRing) {
    const double energies = energies_to_fold(scenario, bar, duration_s);
    if (energies > kMuchEnergy && std::isfinite(energies))
      return plan(false, sentence("to fold this bar takes %.0f times the energy that fall, speed and pushes can give it", energies));
    if (energies > kMuchEnergy) return plan(false, "nothing gives this bar energy to fold");
    return plan(true, sentence("the longest way through the body is %.1f times its mean width: it may come round to itself", slenderness));
  }
  if (has_near_parts(scene, body.rest_length.mean())) {
    return plan(true, "parts that are far from each other along the body stand within two cells");
  }
  return plan(false, sentence("the longest way through the body is %.1f times its mean width: a ring of it would be strained by %.0f %%",
                              slenderness, 100 * kRing / slenderness));
}

template <int Dim>
void plan_parts_contact(StartShape start, Wish wish, double friction, ScenarioOf<Dim>& scenario, SelfContactPlan& plan) {
  if (!scenario.fracture) return;
  scenario.fracture->self_contact = plan.settings;
  if (plan.settings.is_on || wish == Wish::kOff || start != StartShape::kRest) return;
  scenario.fracture->self_contact.is_on = true;
  scenario.fracture->self_contact.friction = friction;
  plan.reason += "; once it breaks its parts touch each other";
}

SelfContactPlan plan_self_contact(const Performer& performer) {
  const physics::Body& body = performer.scene.body;
  const double cell = body.rest_length.mean();
  physics::Scene trial = performer.scene;
  trial.self_contact = {};
  trial.self_contact.is_on = true;
  trial.self_contact.near_at_rest = kFarCells * cell;
  physics::SelfContactSet<3> set(trial);
  const int count = body.node_count();
  Eigen::MatrixX<bool> meet = Eigen::MatrixX<bool>::Constant(count, count, false);
  const Motion& target = performer.prepared.target;
  for (Eigen::Index f = 0; f < target.count(); ++f) {
    const physics::PointsOf<3> x = target.at(f);
    for (const Facing<3>& part : facing_parts<3>(set, x, kTargetCells * cell)) {
      for (int k = 0; k < part.contact.node_count; ++k) {
        for (int l = 0; l < part.contact.node_count; ++l) {
          if (part.contact.weights[static_cast<std::size_t>(k)] > 0 && k < part.contact.node_count - 4 &&
              l >= part.contact.node_count - 4) {
            meet(part.contact.nodes[static_cast<std::size_t>(k)], part.contact.nodes[static_cast<std::size_t>(l)]) = true;
          }
        }
      }
    }
  }
  SelfContactPlan plan;
  plan.settings.friction = performer.scene.ground.friction;
  const Eigen::Index meeting = (meet.rowwise().any()).count();
  if (meeting == 0) {
    plan.reason =
        sentence("in the target no two parts that are four cells apart at rest come within one (%.3g m)", kTargetCells * cell);
    return plan;
  }
  // What comes near may come nearer beside it.
  for (const bool by_columns : {false, true}) {
    Eigen::MatrixX<bool> wider = meet;
    for (int e = 0; e < body.edge_count(); ++e) {
      const int a = body.edges(0, e), b = body.edges(1, e);
      for (int n = 0; n < count; ++n) {
        if (by_columns) {
          wider(n, a) = wider(n, a) || meet(n, b);
          wider(n, b) = wider(n, b) || meet(n, a);
        } else {
          wider(a, n) = wider(a, n) || meet(b, n);
          wider(b, n) = wider(b, n) || meet(a, n);
        }
      }
    }
    meet = wider;
  }
  plan.settings.is_on = true;
  plan.settings.near_at_rest = trial.self_contact.near_at_rest;
  plan.settings.region.setLinSpaced(count, 0, count - 1);
  plan.settings.meet = meet || meet.transpose();
  plan.reason =
      sentence("in the target %ld nodes of the surface come within a cell (%.3g m) of parts that are four away at rest",
               static_cast<long>(meeting), kTargetCells * cell);
  return plan;
}

template void plan_parts_contact<2>(StartShape, Wish, double, ScenarioOf<2>&, SelfContactPlan&);
template void plan_parts_contact<3>(StartShape, Wish, double, ScenarioOf<3>&, SelfContactPlan&);
template SelfContactPlan plan_self_contact<2>(const ScenarioOf<2>&, StartShape, Wish, double, const Bar&, double);
template SelfContactPlan plan_self_contact<3>(const ScenarioOf<3>&, StartShape, Wish, double, const Bar&, double);

}  // namespace hydrostat::retarget
