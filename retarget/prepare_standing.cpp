#include "retarget/prepare_standing.h"

#include <cstdio>

#include "retarget/sag.h"
#include "retarget/static_balance.h"

namespace hydrostat::retarget {
namespace {

constexpr double kLess = 0.5;      // of the shift: so much less is worth the mass
constexpr double kMissing = 0.01;  // [m g] of missing force that does not count

PreparedTarget prepare_with(const Eigen::VectorXd& mass, const Creature& creature, const ImportedMotion& imported,
                            const CreatureOptions& wished) {
  PrepareOptions options = prepare_options(imported);
  options.firmness = wished.firmness;
  options.spread_load = wished.spread_load;
  physics::Scene scene = preparation_scene(creature);
  scene.body.mass = mass;
  return prepare(imported.nodes, scene, bones_of(creature.contacts), creature.character.skeleton.names, creature.mesh.bone_weights,
                 creature.length, creature.size, options);
}

std::string told(const StaticBalance& balance, const Creature& creature) {
  const Eigen::VectorXd& mass = creature.scene.body.mass;
  Eigen::Index lightest = 0, bone = 0;
  const double least = balance.mass_shares.minCoeff(&lightest);
  creature.mesh.bone_weights.col(lightest).maxCoeff(&bone);
  char text[300];
  std::snprintf(text, sizeof text,
                "of one density the body would tip over its feet, outside which its centre of mass is by %.3g m: it keeps %.0f %% of its mass, "
                "least of all at '%.60s', %.0f %%",
                balance.overhang, 100 * mass.dot(balance.mass_shares) / mass.sum(),
                creature.character.skeleton.names[static_cast<std::size_t>(bone)].c_str(), 100 * least);
  return text;
}

/// `usual` is the sag of the usual body.
std::string told(double usual, double stiffness) {
  char text[300];
  const int size = std::snprintf(text, sizeof text, "the body is made %.2f times as stiff as usual, for by its weight it would sink by %.1f %% L", stiffness,
                                 100 * usual);
  const double left = usual / stiffness;
  if (left > 1.001 * kMostSag) {
    std::snprintf(text + size, sizeof text - static_cast<std::size_t>(size),
                  "; stiffer it is not made, and it still sinks by %.1f %%: what bears it may buckle; fewer --nodes make thin legs stouter",
                  100 * left);
  }
  return text;
}

PreparedTarget prepare_balanced(const Creature& creature, const ImportedMotion& imported, const CreatureOptions& options) {
  const Eigen::VectorXd& mass = creature.scene.body.mass;
  PreparedTarget prepared = prepare_with(mass, creature, imported, options);
  if (prepared.report.total_shift_rms_length <= kMostShift) return prepared;
  const StaticBalance balance =
      balance_statically(imported.nodes, imported.skin_points, mass, ContactOptions().height * creature.size);
  if (balance.overhang == 0 || !balance.stands) return prepared;
  PreparedTarget lighter = prepare_with(mass.cwiseProduct(balance.mass_shares), creature, imported, options);
  const bool is_better = lighter.report.total_shift_rms_length < kLess * prepared.report.total_shift_rms_length &&
                         lighter.report.missing_wrench_rms_mg < prepared.report.missing_wrench_rms_mg + kMissing;
  if (!is_better) return prepared;
  lighter.mass_shares = balance.mass_shares;
  lighter.warnings.push_back(told(balance, creature));
  return lighter;
}

}  // namespace

PreparedTarget prepare_standing(const Creature& creature, const ImportedMotion& imported, const CreatureOptions& options) {
  PreparedTarget prepared = prepare_balanced(creature, imported, options);
  physics::Scene scene = preparation_scene(creature);
  fit_body(prepared, scene.body);
  const double usual = sag(scene, prepared, creature.length);
  prepared.stiffness = stiffness_to_bear(usual);
  if (prepared.stiffness > 1) prepared.warnings.push_back(told(usual, prepared.stiffness));
  return prepared;
}

void fit_body(const PreparedTarget& prepared, physics::Body& body) {
  if (prepared.mass_shares.size() > 0) body.mass = body.mass.cwiseProduct(prepared.mass_shares).eval();
  if (prepared.stiffness != 1) stiffen(prepared.stiffness, body);
}

}  // namespace hydrostat::retarget
