#include "retarget/wobble.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "retarget/effect_bench.h"
#include "retarget/effect_plan.h"
#include "retarget/performed_scenario.h"
#include "retarget/picture_effects.h"
#include "retarget/wobble_plan.h"
#include "tests/retarget/shapes.h"

namespace hydrostat::retarget::wobble_test {
namespace {

constexpr double kRate = 60;  // [Hz]

/*   +-------------+    A barrel of flesh, 1 x 0.5 x 0.5 m, about a straight bone, a metre over the ground, or, `lying`,
 *   |  o-------o  |    on it.
 *   +-------------+                                                                                              */
struct Barrel {
  Performer performer;
  Rig rig;
};

template <typename Place>
Motion moved(const Eigen::Matrix3Xd& points, Eigen::Index frames, const Place& place) {
  Motion motion;
  motion.rate_hz = kRate;
  motion.frames.resize(points.size(), frames);
  for (Eigen::Index f = 0; f < frames; ++f) {
    for (Eigen::Index i = 0; i < points.cols(); ++i)
      motion.at(f).col(i) = place(static_cast<double>(f) / kRate) * Eigen::Vector3d(points.col(i));
  }
  return motion;
}

/// place(t): the rigid move of the whole at time t [s].
template <typename Place>
Barrel barrel(Eigen::Index frames, bool loop, const Place& place, double height = 1) {
  Barrel made;
  made.rig.skeleton = skeleton_of({-1, 0}, {{0.2, 0.25, 0.25}, {0.8, 0.25, 0.25}});
  made.rig.skin = box_skin({0, 0, 0}, {1, 0.5, 0.5}, 0, 10);
  for (auto& weights : made.rig.skin.skin_weights) weights = {{0, 0.5}, {1, 0.5}};
  CreatureOptions options;
  options.nodes = 60;
  const Creature creature = make_creature({made.rig.skeleton, made.rig.skin, {}}, options);
  made.rig.bone_weights = creature.mesh.bone_weights;
  Performer& performer = made.performer;
  performer.skin = made.rig.skin;
  performer.embedding = creature.skin;
  performer.mesh = creature.mesh;
  performer.contacts = creature.contacts;
  performer.scene = creature.scene;
  performer.length = creature.length;
  performer.size = creature.size;
  const auto lifted = [&](double t) { return place(t) * Eigen::Isometry3d(Eigen::Translation3d(0, height, 0)); };
  performer.prepared.target = moved(creature.mesh.nodes, frames, lifted);
  performer.clip_skin = moved(made.rig.skin.vertices, frames, lifted);
  performer.prepared.target.loop = performer.clip_skin.loop = loop;
  return made;
}

Eigen::Isometry3d up(double height) { return Eigen::Isometry3d(Eigen::Translation3d(0, height, 0)); }

/// Bobs by an amplitude [m] twice a second.
Barrel bobbing(double amplitude, Wish wish = Wish::kAuto) {
  Barrel made = barrel(30, true, [&](double t) { return up(amplitude * std::sin(4 * M_PI * t)); });
  made.performer.wobble = plan_wobble(made.performer, made.rig, wish);
  return made;
}

/// Shared, for it takes a while to make.
const Barrel& shaken() {
  static const Barrel made = bobbing(0.1);
  return made;
}

/// A motion of shaken()'s control nodes.
template <typename Place>
Motion nodes_moved(Eigen::Index frames, const Place& place) {
  return moved(shaken().performer.mesh.nodes, frames, place);
}

TEST(Oscillated, GoesTheSameWayInOneStepAsInMany) {
  std::mt19937 random(7);
  const auto draw = [&](double low, double high) { return low + (high - low) * static_cast<double>(random()) / 4294967295.0; };
  for (int trial = 0; trial < 50; ++trial) {
    const double w = draw(1, 80), d = draw(0.01, 0.9), h = draw(0.001, 0.5), a0 = draw(-9, 9), a1 = draw(-9, 9);
    const Eigen::Vector2d start(draw(-1, 1), draw(-9, 9));
    Eigen::Vector2d many = start;
    for (int k = 0; k < 5; ++k) many = oscillated(many, w, d, h / 5, a0 + k * (a1 - a0) / 5, a0 + (k + 1) * (a1 - a0) / 5);
    EXPECT_LT((many - oscillated(start, w, d, h, a0, a1)).norm(), 1e-10) << trial;
  }
}

TEST(Oscillated, ObeysItsEquation) {
  const double w = 30, d = 0.15, h = 1e-4;
  const Eigen::Vector2d now(0.02, -0.4), next = oscillated(now, w, d, h, 5, 5), after = oscillated(next, w, d, h, 5, 5);
  const double second = (after[0] - 2 * next[0] + now[0]) / (h * h);
  EXPECT_NEAR(second, 5 - 2 * d * w * next[1] - w * w * next[0], 1e-3);
}

TEST(Wobble, OfABodyAtRestIsNone) {
  for (const double angle : {0.0, 0.8}) {
    const Motion still = nodes_moved(20, [&](double) { return up(2) * Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()); });
    Wobble wobble = shaken().performer.wobble;
    wobble.start.setZero();
    EXPECT_LT(swung(wobble, wobble_loads(wobble, shaken().performer, still), kRate).cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(Wobble, IsWhereABodyRestsInAnotherPoseThanItsTarget) {
  const Motion upside_down = nodes_moved(90, [](double) { return up(2) * Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()); });
  const Eigen::MatrixXd amplitudes = wobble_of(shaken().performer, upside_down);
  EXPECT_GT(amplitudes.rightCols(1).cwiseAbs().maxCoeff(), 1e-3) << "flesh hangs the other way";
}

TEST(Wobble, HasNothingToPullItInFreeFall) {
  const Motion falling = nodes_moved(20, [](double t) { return Eigen::Isometry3d(Eigen::Translation3d(t, 9 - 0.5 * 9.81 * t * t, 0)); });
  const Eigen::MatrixXd loads = wobble_loads(shaken().performer.wobble, shaken().performer, falling);
  EXPECT_LT(loads.middleCols(1, 18).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(Wobble, RingsAtItsFrequenciesWithItsDampingAfterAJolt) {
  const Motion jolt = nodes_moved(120, [](double t) { return Eigen::Isometry3d(Eigen::Translation3d(0.3 * std::max(0.0, t - 0.1), 2, 0.1 * t)); });
  Wobble wobble = shaken().performer.wobble;
  wobble.start.setZero();
  const Eigen::MatrixXd amplitudes = swung(wobble, wobble_loads(wobble, shaken().performer, jolt), kRate);
  ASSERT_GT(amplitudes.cwiseAbs().maxCoeff(), 1e-4);
  for (Eigen::Index k = 0; k < wobble.count(); ++k) {
    const double w = 2 * M_PI * wobble.frequency_hz[k], decay = std::exp(-kWobbleDamping * w / kRate);
    const double turn = w * std::sqrt(1 - kWobbleDamping * kWobbleDamping) / kRate;
    for (Eigen::Index f = 20; f < 119; ++f)  // what any sampled free oscillation obeys
      EXPECT_NEAR(amplitudes(k, f + 1), 2 * decay * std::cos(turn) * amplitudes(k, f) - decay * decay * amplitudes(k, f - 1), 1e-9);
  }
}

TEST(Wobble, TurnsWithTheBody) {
  const auto shaking = [](double t) { return Eigen::Translation3d(0.02 * std::sin(20 * t), 2 + 0.03 * std::sin(13 * t), 0.01 * t); };
  const Motion motion = nodes_moved(60, [&](double t) { return Eigen::Isometry3d(shaking(t)); });
  const Eigen::MatrixXd amplitudes = wobble_of(shaken().performer, motion);
  for (const double angle : {0.5, 2.5}) {
    const Eigen::AngleAxisd turn(angle, Eigen::Vector3d::UnitY());
    const Motion turned = nodes_moved(60, [&](double t) { return turn * Eigen::Isometry3d(shaking(t)); });
    EXPECT_LT((wobble_of(shaken().performer, turned) - amplitudes).cwiseAbs().maxCoeff(), 1e-9);
  }
  EXPECT_EQ(wobble_of(shaken().performer, motion), amplitudes) << "the same bits again";
}

TEST(Wobble, OfALoopBeginsAsItGoesOn) {
  const Performer& performer = shaken().performer;
  Motion cycles = performer.prepared.target;
  cycles.loop = false;
  cycles.frames = performer.prepared.target.frames.replicate(1, 4);
  const Eigen::MatrixXd amplitudes = wobble_of(performer, cycles);
  const Eigen::Index frames = performer.prepared.target.count();
  // But for the first frame, whose acceleration a motion that is no loop does not tell.
  EXPECT_LT((amplitudes.middleCols(frames, frames) - amplitudes.middleCols(2 * frames, frames)).cwiseAbs().maxCoeff(),
            0.1 * amplitudes.cwiseAbs().maxCoeff());
  EXPECT_LT((amplitudes.col(0) - amplitudes.col(frames)).cwiseAbs().maxCoeff(), 0.1 * amplitudes.cwiseAbs().maxCoeff());
}

TEST(LimitWobble, LeavesWhatIsSmallAndTurnsNoSkinInsideOut) {
  const Performer& performer = shaken().performer;
  const Wobble& wobble = performer.wobble;
  std::mt19937 random(3);
  for (int seed = 0; seed < 30; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Eigen::VectorXd direction = Eigen::VectorXd::NullaryExpr(
        wobble.count(), [&] { return static_cast<double>(random()) / 2147483647.5 - 1; });
    Eigen::VectorXd small = 1e-3 * wobble.most.cwiseProduct(direction), large = 1e3 * direction;
    const Eigen::VectorXd before = small;
    limit_wobble(wobble, small);
    EXPECT_LT((small - before).norm(), 1e-9 * before.norm());
    limit_wobble(wobble, large);
    const Eigen::Matrix3Xd swollen = performer.skin.vertices + (wobble.shapes * large).reshaped(3, performer.skin.vertices.cols());
    EXPECT_GT((swollen - performer.skin.vertices).cwiseAbs().maxCoeff(), 1e-3 * performer.length);
    double volume = 0, moved_volume = 0;
    for (const auto corners : performer.skin.triangles.colwise()) {
      const Eigen::Matrix3d at = performer.skin.vertices(Eigen::all, corners), to = swollen(Eigen::all, corners);
      const Eigen::Vector3d area = (at.col(1) - at.col(0)).cross(at.col(2) - at.col(0));
      EXPECT_GT(area.dot((to.col(1) - to.col(0)).cross(to.col(2) - to.col(0))), 0);
      volume += at.determinant();
      moved_volume += to.determinant();
    }
    EXPECT_NEAR(moved_volume / volume, 1, 0.03);
  }
}

TEST(Wobble, SparesSkinThatComesToTheGround) {
  Barrel lying = barrel(30, true, [](double t) { return Eigen::Isometry3d(Eigen::Translation3d(0.05 * std::sin(4 * M_PI * t), 0, 0)); }, 0);
  lying.performer.wobble = plan_wobble(lying.performer, lying.rig, Wish::kOn);
  const Wobble& wobble = lying.performer.wobble;
  ASSERT_TRUE(wobble.is_on());
  int touching = 0;
  for (Eigen::Index v = 0; v < lying.performer.skin.vertices.cols(); ++v) {
    if (lying.performer.skin.vertices(1, v) > 1e-9) continue;
    ++touching;
    EXPECT_TRUE(wobble.shapes.middleRows<3>(3 * v).isZero(0));
  }
  EXPECT_GT(touching, 100);
  EXPECT_GT(wobble.shapes.cwiseAbs().maxCoeff(), 0.5);
}

TEST(Wobble, PushesNoSkinUnderTheGround) {
  const Performer& performer = shaken().performer;
  const Motion low = nodes_moved(90, [](double t) { return up(0.002 + 0.05 * std::abs(std::sin(6 * t))); });
  const Eigen::MatrixXd amplitudes = wobble_of(performer, low);
  double lowest = 1, free_lowest = 1;
  for (Eigen::Index f = 0; f < low.count(); ++f) {
    const Eigen::Matrix3Xd skin = embedded_positions(performer.embedding, low.at(f));
    const auto lowest_with = [&](const Eigen::VectorXd& with) {
      return (skin + (performer.wobble.shapes * with).reshaped(3, skin.cols())).row(1).minCoeff();
    };
    lowest = std::min(lowest, lowest_with(amplitudes.col(f)));
    free_lowest = std::min(free_lowest, lowest_with(swung(performer.wobble, wobble_loads(performer.wobble, performer, low), kRate).col(f)));
  }
  EXPECT_GE(lowest, -1e-9);
  EXPECT_LT(free_lowest, -1e-3) << "or nothing was put to the test";
}

TEST(MakeFlesh, HoldsBonesAndLetsSkinGo) {
  const Flesh flesh = make_flesh(shaken().performer, shaken().rig);
  int held = 0;
  for (Eigen::Index n = 0; n < flesh.mesh.nodes.cols(); ++n) {
    const Eigen::Vector3d place = flesh.mesh.nodes.col(n);
    const double from_bone = std::hypot(place.y() - 0.25, place.z() - 0.25, std::max({0.0, 0.2 - place.x(), place.x() - 0.8}));
    const bool is_held = flesh.held[static_cast<std::size_t>(n)] != 0;
    EXPECT_TRUE(is_held || from_bone >= 0.1) << place.transpose();
    EXPECT_TRUE(!is_held || from_bone <= 0.2) << place.transpose();
    held += is_held ? 1 : 0;
  }
  EXPECT_GT(held, 0);
}

TEST(FleshModes, OfALayerOnTheGroundAreThoseOfTheBook) {
  // Nothing holds it but its sole: it sways as a layer does, at a quarter of a wave of shear.
  Barrel layer = barrel(4, true, [](double) { return up(0); }, 0);
  layer.rig.skeleton.weighted.assign(2, false);
  const Flesh flesh = make_flesh(layer.performer, layer.rig);
  const Wobble wobble = flesh_modes(layer.performer, layer.rig, flesh, 4);
  const double shear_modulus = 1000 * 9.81 * layer.performer.length / kFleshSoftness / (2 * 1.45);
  const double expected = std::sqrt(shear_modulus / 1000) / (4 * 0.5);  // of a layer of 0.5 m, if it went on for ever
  EXPECT_NEAR(wobble.frequency_hz[0], expected, 0.28 * expected);
  EXPECT_LT(wobble.frequency_hz[0], wobble.frequency_hz[3]);
}

TEST(PlanWobble, IsOnWhereTheTargetMovesSkinSoThatItIsSeen) {
  EXPECT_TRUE(shaken().performer.wobble.is_on());
  EXPECT_LE(shaken().performer.wobble.count(), 8);
  EXPECT_NE(shaken().performer.wobble.reason.find("% L"), std::string::npos);
  const Wobble calm = bobbing(0.0002).performer.wobble;
  EXPECT_FALSE(calm.is_on());
  EXPECT_NE(calm.reason.find("not seen"), std::string::npos) << calm.reason;
}

TEST(PlanWobble, DoesAsItIsAsked) {
  EXPECT_FALSE(bobbing(0.1, Wish::kOff).performer.wobble.is_on());
  const Barrel asked = bobbing(0.002, Wish::kOn);
  EXPECT_TRUE(asked.performer.wobble.is_on());
  EXPECT_EQ(asked.performer.wobble.reason.substr(0, 9), "asked for");
}

/// The body moves the same; what wobble does is seen on the skin alone.
TEST(MeasureEffects, OfACreatureHaveWobbleAndEmbeddingOnItsSkin) {
  Performer performer = shaken().performer;
  ScenarioOf<3> scenario = undriven_scenario(performer);
  plan_effects<3>({}, scenario);
  SimulationOptions options;
  options.duration_s = 0.1;
  const auto row = [&](const std::vector<EffectRow>& rows, const std::string& name) {
    const auto found = std::find_if(rows.begin(), rows.end(), [&](const EffectRow& one) { return one.effect == name; });
    return found == rows.end() ? EffectRow{} : *found;
  };
  const std::vector<EffectRow> rows = measure_effects(performer, scenario, options);
  const EffectRow wobble = row(rows, "wobble"), embedding = row(rows, "embedding");
  EXPECT_GT(wobble.difference_length, 1e-5);
  EXPECT_GT(wobble.without_difference_length, 1e-5);
  EXPECT_GT(wobble.ms_per_sim_s, rows.front().ms_per_sim_s);
  EXPECT_GT(embedding.difference_length, 0);
  EXPECT_GT(row(rows, "gravity").without_difference_length, 1e-3);
  const Motion all = simulate(scenario, options).motion;
  const Eigen::MatrixXd offsets = wobbled_motion(performer, all) - embedded_motion(performer, all);
  EXPECT_NEAR(wobble.without_difference_length, std::sqrt(3 * offsets.squaredNorm() / static_cast<double>(offsets.size())) / performer.length, 1e-12);
  performer.wobble = {};
  EXPECT_EQ(row(measure_effects(performer, scenario, options), "wobble").effect, "");
}

TEST(WobbleMorphs, AreTheModesWithTheirAmplitudes) {
  const Performer& performer = shaken().performer;
  const Motion motion = nodes_moved(40, [](double t) { return up(2 + 0.05 * std::sin(11 * t)); });
  const MovingMorphs morphs = wobble_morphs(performer, motion);
  ASSERT_EQ(static_cast<Eigen::Index>(morphs.targets.size()), performer.wobble.count());
  EXPECT_LE(morphs.weights.cwiseAbs().maxCoeff(), 1 + 1e-12);
  const Eigen::MatrixXd amplitudes = wobble_of(performer, motion);
  for (const Eigen::Index f : {0, 17, 39}) {
    const Eigen::Matrix3Xd worn = morphed(Eigen::Matrix3Xd::Zero(3, performer.skin.vertices.cols()), morphs.targets, morphs.weights.col(f));
    const Eigen::VectorXd expected = performer.wobble.shapes * amplitudes.col(f);
    EXPECT_LT((worn.reshaped() - expected).cwiseAbs().maxCoeff(), 3e-3 * amplitudes.cwiseAbs().maxCoeff());
  }
}

TEST(WornWith, PutsTheCreaturesOwnMorphTargetsFirst) {
  MovingMorphs own{{{"smile", Eigen::VectorXi::Constant(1, 3), Eigen::Vector3d::Ones()}}, Eigen::RowVector2d(0, 1), 30, true};
  MovingMorphs wobble{{{"wobble 1", Eigen::VectorXi::Constant(1, 5), Eigen::Vector3d::Ones()}}, Eigen::RowVectorXd::LinSpaced(6, 0, 1), 60, false};
  const MovingMorphs both = worn_with(own, wobble);
  ASSERT_EQ(both.targets.size(), 2u);
  EXPECT_EQ(both.targets[0].name, "smile");
  EXPECT_EQ(both.weights.row(1), wobble.weights);
  for (Eigen::Index f = 0; f < 6; ++f) EXPECT_EQ(both.weights(0, f), own.at(static_cast<double>(f) / 60)[0]);
  EXPECT_EQ(worn_with(own, {}).weights, own.weights);
  EXPECT_EQ(worn_with({}, wobble).weights, wobble.weights);
}

}  // namespace
}  // namespace hydrostat::retarget::wobble_test
