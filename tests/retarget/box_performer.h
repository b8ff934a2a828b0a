#pragma once

#include "retarget/inverse_dynamics.h"
#include "retarget/performance.h"
#include "tests/retarget/box_creature.h"

namespace hydrostat::retarget {

/// The box as its replays need it, bobbing on its soles by a share of its height; its skin is two triangles in the first tets.
inline Performer make_box_performer(Eigen::Index frames = 12, const BoxCreature& creature = make_box_creature(), double amplitude = 0.03) {
  const physics::Body& body = creature.scene.body;
  Performer performer;
  performer.scene = creature.scene;
  performer.mesh.nodes = body.rest;
  performer.mesh.tets = body.tets;
  performer.mesh.edges = body.edges;
  performer.embedding.nodes = body.tets.leftCols(4);
  performer.embedding.weights = Eigen::Matrix4Xd::Constant(4, 4, 0.25);
  performer.embedding.tets = Eigen::VectorXi::LinSpaced(4, 0, 3);
  performer.skin.vertices = embedded_positions(performer.embedding, body.rest);
  performer.skin.triangles.resize(3, 2);
  performer.skin.triangles << 0, 1, 1, 2, 2, 3;
  const Eigen::Index points = creature.scene.contact_points.count();
  performer.contacts.vertices = Eigen::VectorXi::Zero(points);
  performer.contacts.bones = Eigen::Map<const Eigen::VectorXi>(creature.patch_bone.data(), points);
  performer.contacts.embedding.nodes = creature.scene.contact_points.nodes;
  performer.contacts.embedding.weights = creature.scene.contact_points.weights;
  performer.contacts.embedding.tets = Eigen::VectorXi::Zero(points);
  performer.muscles = make_muscles(body, creature.skeleton, creature.bone_weights);
  performer.prepared = as_prepared(bobbing(creature, frames, amplitude), always_standing(creature, frames));
  performer.prepared.missing_wrench = Eigen::MatrixXd::Zero(6, frames);
  performer.clip_points = point_motion(creature.scene.contact_points, performer.prepared.target);
  performer.clip_skin = performer.prepared.target;
  performer.clip_skin.frames.resize(performer.skin.vertices.size(), frames);
  for (Eigen::Index f = 0; f < frames; ++f) {
    performer.clip_skin.at(f) = embedded_positions(performer.embedding, performer.prepared.target.at(f));
  }
  performer.length = BoxCreature::kLength;
  performer.size = creature.size();
  return performer;
}

inline SignalSet signals_of(const Performer& performer) {
  const InverseDynamics inverse = solve_inverse_dynamics(performer.prepared, performer.scene, performer.length, {});
  const physics::Body& body = performer.scene.body;
  return analyse_signals({signal::Kind::loop, performer.prepared.target.duration_s(), inverse.report.limit, inverse.activation.transpose(),
                          inverse.penalty_force.transpose(), performer.muscles.edge_bone, body.edges, body.rest_length, body.edge_stiffness},
                         {});
}

}  // namespace hydrostat::retarget
