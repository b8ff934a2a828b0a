#include "retarget/effect_plan.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "retarget/gravity.h"
#include "retarget/reach.h"

namespace hydrostat::retarget {
namespace {

using physics::VectorOf;

constexpr double kLeastResistance = 0.005;  // of the weight [-]: less is not seen
constexpr double kLeastSpeed = 1e-9;        // beside that of the whole body, over it [-]: less is rounding

std::string number(double value, int digits = 2) {
  char text[40];
  std::snprintf(text, sizeof text, "%.*g", digits, value);
  return text;
}

std::string many(std::size_t count, const char* one) { return std::to_string(count) + " " + one + (count == 1 ? "" : "s"); }

/// One scenario's effects, asked one after the other.
template <int Dim>
class Planner {
 public:
  Planner(const std::map<std::string, Wish>& wishes, ScenarioOf<Dim>& scenario, double duration_s)
      : wishes_(wishes),
        scenario_(scenario),
        scene_(scenario.scene),
        duration_s_(duration_s),
        centre_(physics::centre_of_mass(scene_.body, scenario.start.x)),
        velocity_(physics::momentum(scene_.body, scenario.start.v) / scene_.body.mass.sum()) {}

  std::string plan() {
    const bool has_gravity = scene_.gravity.norm() > 0;
    decide("gravity", has_gravity, has_gravity, number(scene_.gravity.norm(), 3) + " m/s2", "the scene has none");
    if (!is_on("gravity")) scene_.gravity.setZero();
    reach_ = reach_of(scenario_, duration_s_);
    decide_surroundings();
    decide_fluids();
    const bool rubs = scene_.ground.friction > 0 || std::any_of(scene_.obstacles.begin(), scene_.obstacles.end(),
                                                                [](const auto& o) { return o.friction > 0; });
    const bool touches = is_on("ground") || is_on("obstacles");
    decide("friction", touches && rubs, touches && rubs, "what the body touches rubs",
           touches ? "nothing rubs" : "there is nothing to rub against");
    if (!is_on("friction")) {
      scene_.ground.friction = 0;
      for (auto& obstacle : scene_.obstacles) obstacle.friction = 0;
    }
    decide_body();
    decide_pushes();
    decide_fracture();
    return broken_;
  }

 private:
  Wish wish_for(const std::string& name) const {
    const auto found = wishes_.find(name);
    return found == wishes_.end() ? Wish::kAuto : found->second;
  }

  bool is_on(const std::string& name) const {
    return std::any_of(scenario_.decisions.begin(), scenario_.decisions.end(),
                       [&](const EffectDecision& d) { return d.name == name && d.is_on; });
  }

  /// `can_be`: the scene has what it needs; `is_wanted`: by itself it is on.
  void decide(const std::string& name, bool can_be, bool is_wanted, const std::string& why, const std::string& why_not) {
    EffectDecision decision{name, is_wanted, is_wanted ? why : why_not};
    switch (wish_for(name)) {
      case Wish::kAuto:
        break;
      case Wish::kOn:
        if (!can_be && broken_.empty()) broken_ = "'" + name + "' is asked for, but " + why_not;
        decision.is_on = can_be;
        decision.reason = "asked for by the scene";
        break;
      case Wish::kOff:
        decision.is_on = false;
        decision.reason = "turned off by the scene";
        break;
    }
    scenario_.decisions.push_back(std::move(decision));
  }

  std::string unreached() const {
    return duration_s_ < kUnending ? "the body cannot come there within " + number(duration_s_, 4) + " s" : "nothing can bring the body there";
  }

  void decide_pushes() {
    double first_s = kUnending;
    for (const PushOf<Dim>& push : scenario_.pushes) first_s = std::min(first_s, push.time_s);
    const bool has_any = !scenario_.pushes.empty();
    decide("pushes", has_any, has_any && first_s < duration_s_, std::to_string(scenario_.pushes.size()) + " in the scene",
           has_any ? "the first begins at " + number(first_s, 4) + " s, and the end is at " + number(duration_s_, 4) + " s"
                   : "the scene has none");
    if (!is_on("pushes")) scenario_.pushes.clear();
  }

  void decide_surroundings() {
    decide("ground", scene_.has_ground, scene_.has_ground && reach_.ground, "the body stands, lands or can land on it",
           scene_.has_ground ? unreached() : "the scene has none");
    scene_.has_ground = is_on("ground");
    const bool has_any = !scene_.obstacles.empty();
    decide("obstacles", has_any, has_any && reach_.obstacles, many(scene_.obstacles.size(), "obstacle") + " in the scene",
           has_any ? unreached() : "the scene has none");
    if (!is_on("obstacles")) {
      scene_.obstacles.clear();
      scenario_.moves.clear();
      scenario_.start.obstacle_travel.resize(Dim, 0);
    }
  }

  void decide_fluids() {
    std::string why = "it is everywhere", why_not = "there is no water";
    bool reached = scene_.water.has_value();
    if (scene_.water && std::isfinite(scene_.water->level)) {
      const bool is_wet = scenario_.start.x.row(1).minCoeff() < scene_.water->level;
      const bool falls = scene_.gravity.norm() > 0 || velocity_.norm() > 0 || !scenario_.pushes.empty();
      reached = is_wet || (falls && reach_.water);
      why = is_wet ? "the body starts in it" : "the body can fall into it";
      why_not = falls ? unreached() : "nothing can bring the body to its surface";
    }
    decide("water", scene_.water.has_value(), reached, why, why_not);
    if (!is_on("water")) scene_.water.reset();

    const bool was_given = scene_.air.has_value();
    if (!was_given) scene_.air.emplace().density = 1.2;
    const double share = resistance_share();
    const std::string text = "at its fastest it would be " + number(100 * share) + " % of the weight";
    const bool is_deep = scene_.water && !std::isfinite(scene_.water->level);
    decide("air_drag", !is_deep, was_given && !is_deep && share >= kLeastResistance, text,
           is_deep     ? "there is water everywhere"
           : was_given ? text
                       : "the scene tells of no air; " + text);
    if (!is_on("air_drag")) scene_.air.reset();
  }

  /// Of the air, at the speed that start, wind, pushes and a fall to the ground or of ten lengths give, to the weight.
  double resistance_share() const {
    double speed_squared = (scenario_.start.v.colwise() - scene_.air->velocity).colwise().squaredNorm().maxCoeff();
    const double fall =
        scene_.has_ground ? std::max(0.0, scene_.ground.normal.dot(centre_) - scene_.ground.offset) : 10 * scenario_.length;
    speed_squared += 2 * scene_.gravity.norm() * fall;
    for (const PushOf<Dim>& push : scenario_.pushes) speed_squared += push.delta_v.squaredNorm();
    const VectorOf<Dim> extent = scene_.body.rest.rowwise().maxCoeff() - scene_.body.rest.rowwise().minCoeff();
    const double area = Dim == 3 ? extent.prod() / extent.minCoeff() : extent.maxCoeff();
    return 0.5 * scene_.air->density * scene_.air->drag * area * speed_squared / (kGravity * scene_.body.mass.sum());
  }

  void decide_body() {
    physics::BodyOf<Dim>& body = scene_.body;
    const bool has_springs = body.volume_stiffness.size() > 0;
    if (!has_springs && wish_for("volume") == Wish::kOff && broken_.empty()) {
      broken_ = "'volume' cannot be off, for it is a part of the elements' law";
    }
    decide("volume", true, true,
           has_springs ? "every element keeps its volume by a spring"
                       : "a part of the elements' law, as far as Poisson's ratio says; counted there",
           "");
    if (!is_on("volume")) body.volume_stiffness.resize(0);
    const bool has_dashpots = body.edge_damping.size() > 0 && body.edge_damping.maxCoeff() > 0;
    decide("damping", has_dashpots, has_dashpots, "a dashpot along every constraint", "damping_time_s is 0");
    if (!is_on("damping")) body.edge_damping.setZero();
  }

  void decide_fracture() {
    const std::string load = load_of_seams();
    std::string why_not = "no seam is marked", why;
    if (scenario_.fracture) {
      why = many(scenario_.fracture->seams.size(), "seam") + " of " + std::to_string(scenario_.fracture->faces.size()) + " faces, which " + load +
            " can load";
      why_not = "nothing can load the seams";
    }
    decide("fracture", scenario_.fracture.has_value(), scenario_.fracture && !load.empty(), why, why_not);
    if (!is_on("fracture")) scenario_.fracture.reset();
  }

  /// What can pull at the body's inside; empty: nothing.
  std::string load_of_seams() const {
    const bool meets = is_on("ground") || is_on("obstacles") || !scenario_.clamps.empty();
    if (!scenario_.waves.empty() || scenario_.drive) return "activations";
    if (is_on("gravity") && meets) return "the weight";
    if (is_on("pushes") && meets) return "pushes";
    if (!scenario_.moves.empty()) return "moving obstacles";
    if (is_on("water")) return "water";
    if (is_on("air_drag")) return "air";
    if ((scenario_.start.v.colwise() - velocity_).norm() > kLeastSpeed * scenario_.start.v.norm()) return "what moves at the start";
    if (meets && velocity_.norm() > 0) return "an impact";
    const bool is_in_shape = scenario_.start.x == scene_.body.rest;
    return is_in_shape ? "" : "the start out of shape";
  }

  const std::map<std::string, Wish>& wishes_;
  ScenarioOf<Dim>& scenario_;
  physics::SceneOf<Dim>& scene_;
  const double duration_s_;
  const VectorOf<Dim> centre_, velocity_;
  Reach reach_;
  std::string broken_;
};

}  // namespace

const std::vector<std::string>& switchable_effects() {
  static const std::vector<std::string> names{"gravity", "ground",   "friction", "obstacles", "volume",
                                              "damping", "air_drag", "water",    "pushes",   "fracture"};
  return names;
}

template <int Dim>
std::string plan_effects(const std::map<std::string, Wish>& wishes, ScenarioOf<Dim>& scenario, double duration_s) {
  scenario.decisions.clear();
  return Planner<Dim>(wishes, scenario, duration_s).plan();
}
template std::string plan_effects<2>(const std::map<std::string, Wish>&, ScenarioOf<2>&, double);
template std::string plan_effects<3>(const std::map<std::string, Wish>&, ScenarioOf<3>&, double);

}  // namespace hydrostat::retarget
