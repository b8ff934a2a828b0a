#include "cli/make_performer.h"

#include "retarget/com_path.h"
#include "retarget/error.h"
#include "retarget/flight.h"
#include "retarget/limbs.h"
#include "retarget/prepare_standing.h"
#include "retarget/self_contact_plan.h"

namespace hydrostat::cli {

retarget::PreparedTarget prepared_target(const retarget::Creature& creature, const retarget::ImportedMotion& motion,
                                         const retarget::CreatureOptions& options) {
  retarget::PreparedTarget prepared = retarget::prepare_standing(creature, motion, options);
  retarget::find_legs(creature.character.skeleton, prepared.contacts);
  return prepared;
}

retarget::Performer make_performer(const retarget::Creature& creature, const retarget::ImportedMotion& motion,
                                   retarget::PreparedTarget prepared) {
  retarget::Performer performer;
  performer.skin.vertices = creature.character.skin.vertices;
  performer.skin.triangles = creature.character.skin.triangles;
  performer.embedding = creature.skin;
  performer.mesh = creature.mesh;
  performer.contacts = creature.contacts;
  performer.scene = creature.scene;
  performer.muscles = retarget::make_muscles(creature.scene.body, creature.character.skeleton, creature.mesh.bone_weights);
  performer.prepared = std::move(prepared);
  performer.clip_points = motion.skin_points;
  performer.clip_skin = motion.skin;
  performer.morphs = motion.morphs;
  performer.clip_rise = retarget::apex_rise(retarget::com_path(motion.nodes, creature.scene.body.mass));
  performer.length = creature.length;
  performer.size = creature.size;
  retarget::SelfContactPlan plan = retarget::plan_self_contact(performer);
  performer.scene.self_contact = std::move(plan.settings);
  performer.self_contact_reason = std::move(plan.reason);
  return performer;
}

retarget::SignalSet solved_signals(const retarget::InverseDynamics& inverse, const retarget::Performer& performer,
                                   const std::string& file, const std::string& clip) {
  const physics::Body& body = performer.scene.body;
  const retarget::Motion& target = performer.prepared.target;
  const retarget::SolvedSignals solved{target.loop ? signal::Kind::loop : signal::Kind::one_shot,
                                       target.duration_s(),
                                       inverse.report.limit,
                                       inverse.activation.transpose(),
                                       inverse.penalty_force.transpose(),
                                       performer.muscles.edge_bone,
                                       body.edges,
                                       body.rest_length,
                                       body.edge_stiffness};
  const std::string broken = retarget::broken_rule({}, solved.kind, static_cast<int>(solved.activation.rows()));
  if (!broken.empty()) throw Error(file, "clip '" + clip + "'", broken, "Give a longer clip.");
  return retarget::analyse_signals(solved, {});
}

}  // namespace hydrostat::cli
