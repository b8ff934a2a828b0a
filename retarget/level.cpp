#include "retarget/level.h"

#include "retarget/level_signals.h"
#include "retarget/level_target.h"
#include "retarget/mesh_places.h"
#include "retarget/rest_lengths.h"
#include "retarget/sag.h"
#include "retarget/self_contact_plan.h"

namespace hydrostat::retarget {
namespace {

/// The nominal path on the level: of its nodes as of what lies there in the solved creature.
Motion carried_offset(const Motion& solved, const Places& places) {
  Motion carried = solved;
  carried.frames.resize(places.nodes.cols() * 3, solved.count());
  for (Eigen::Index f = 0; f < solved.count(); ++f) {
    const Eigen::Map<const Eigen::Matrix3Xd> from = solved.at(f);
    for (Eigen::Index i = 0; i < places.nodes.cols(); ++i) carried.at(f).col(i) = from(Eigen::all, places.nodes.col(i)) * places.weights.col(i);
  }
  return carried;
}

NominalPath carried_path(const Performer& solved, const Rig& rig, const Performer& level, const Eigen::MatrixXd& bone_weights) {
  if (solved.path.is_empty()) return {};
  const Places places = locate(solved.mesh, rig.bone_weights, level.mesh.nodes, bone_weights);
  return {carried_offset(solved.path.place, places), carried_offset(solved.path.velocity, places)};
}

/// What of their mass the solved creature's nodes have kept, on the level's.
void carry_mass(const Performer& solved, const Rig& rig, Creature& level) {
  const Eigen::VectorXd& shares = solved.prepared.mass_shares;
  if (shares.size() == 0) return;
  const Places places = locate(solved.mesh, rig.bone_weights, level.mesh.nodes, level.mesh.bone_weights);
  for (Eigen::Index i = 0; i < level.scene.body.mass.size(); ++i)
    level.scene.body.mass[i] *= shares(places.nodes.col(i)).dot(places.weights.col(i));
}

}  // namespace

Creature level_body(const Rig& rig, const CreatureOptions& options, int nodes) {
  CreatureOptions wished = options;
  wished.nodes = nodes;
  wished.height_m = rig.skin.vertices.row(1).maxCoeff() - rig.skin.vertices.row(1).minCoeff();  // as it is
  return make_creature({rig.skeleton, rig.skin, {}}, wished);
}

Level at_level(const Performer& solved, const SignalSet& signals, const Rig& rig, const CreatureOptions& options) {
  Creature creature = level_body(rig, options, options.nodes);
  carry_mass(solved, rig, creature);
  creature.scene.ground = solved.scene.ground;
  creature.scene.gravity = solved.scene.gravity;
  Level level;
  Performer& performer = level.performer;
  performer = solved;
  performer.embedding = creature.skin;
  performer.mesh = creature.mesh;
  performer.contacts = creature.contacts;
  performer.scene = creature.scene;
  performer.muscles = make_muscles(creature.scene.body, rig.skeleton, creature.mesh.bone_weights);
  performer.prepared = carried_target(solved, rig, creature);
  stiffen(performer.prepared.stiffness, performer.scene.body);
  if (has_fitted_rest_lengths(solved.scene.body)) fit_rest_lengths(performer.prepared.target, performer.scene.body);
  performer.path = carried_path(solved, rig, performer, creature.mesh.bone_weights);
  performer.clip_points = carried_clip_points(solved, creature.contacts);
  SelfContactPlan plan = plan_self_contact(performer);
  performer.scene.self_contact = std::move(plan.settings);
  performer.self_contact_reason = std::move(plan.reason);
  const std::string wobble = solved.wobble.is_on() ? "not planned on this level" : solved.wobble.reason;
  performer.wobble = {};  // its modes are of the solved mesh
  performer.wobble.reason = wobble;
  level.signals = level_signals(solved, signals, rig, performer);
  return level;
}

}  // namespace hydrostat::retarget
