#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "physics/element_body.h"
#include "retarget/clip.h"
#include "retarget/prepare.h"
#include "tests/physics/lattice_scene.h"

namespace hydrostat::retarget {

//     +-----------+       z
//    /           /|      /
//   +-----------+ +     +--> x      5 x 2 x 4 cells of 0.1 m on four legs of one cell: 106 nodes, L = 0.5 m, its own mirror image in z
//   |   trunk   |/
//   +-+-------+-+
//   |_|       |_|
struct BoxCreature {
  static constexpr double kLength = 0.5;  // [m] L
  physics::Scene scene;
  Skeleton skeleton;             // trunk and four legs
  Eigen::MatrixXd bone_weights;  // 5 x N
  std::vector<int> patch_bone;   // of each contact point

  double mass() const { return scene.body.mass.sum(); }
  double size() const { return std::cbrt(mass() / 1000); }
  double height() const { return scene.body.rest.row(1).maxCoeff(); }
};

inline BoxCreature make_box_creature() {
  BoxCreature creature;
  const auto keep = [](int i, int j, int k) { return j >= 1 || ((i == 0 || i == 4) && (k == 0 || k == 3)); };
  physics::Material material;
  material.youngs_modulus = material.density * 9.81 * BoxCreature::kLength / 0.005;
  const physics::Body body = physics::body_of(physics::make_lattice(5, 3, 4, 0.1, keep), material);
  creature.scene = physics::scene_of(body, physics::soles(body));
  creature.skeleton.names = {"trunk", "back_right", "back_left", "front_right", "front_left"};
  creature.skeleton.parents = {-1, 0, 0, 0, 0};
  creature.skeleton.weighted.assign(5, true);
  creature.skeleton.bind_pose.assign(5, Eigen::Affine3d::Identity());
  creature.skeleton.bind_pose[0].translation() << 0, 0.2, 0.2;
  const auto leg_of = [](double x, double z) { return 1 + (x > 0.25 ? 2 : 0) + (z > 0.2 ? 1 : 0); };
  for (int leg = 1; leg < 5; ++leg) {
    creature.skeleton.bind_pose[static_cast<std::size_t>(leg)].translation() << (leg > 2 ? 0.45 : 0.05), 0.15, (leg % 2 == 0 ? 0.35 : 0.05);
  }
  creature.bone_weights = Eigen::MatrixXd::Zero(5, body.node_count());
  for (int i = 0; i < body.node_count(); ++i) {
    const Eigen::Vector3d place = body.rest.col(i);
    const bool over_a_leg = (place.x() < 0.15 || place.x() > 0.35) && std::abs(place.z() - 0.2) > 0.05;
    const double share = place.y() < 0.05 ? 1 : place.y() < 0.15 && over_a_leg ? 0.5 : 0;
    creature.bone_weights(leg_of(place.x(), place.z()), i) = share;
    creature.bone_weights(0, i) += 1 - share;
  }
  for (int p = 0; p < creature.scene.contact_points.count(); ++p) {
    const Eigen::Vector3d place = creature.scene.contact_points.of(body.rest, p);
    creature.patch_bone.push_back(leg_of(place.x(), place.z()));
  }
  return creature;
}

/// The box on its two outermost points that lie across: on a line, over which it tips.
inline BoxCreature make_tiptoe_box() {
  BoxCreature creature = make_box_creature();
  physics::ContactPoints& points = creature.scene.contact_points;
  std::vector<int> kept, bones;
  for (int p = 0; p < points.count(); ++p) {
    const Eigen::Vector3d place = points.of(creature.scene.body.rest, p);
    const bool is_back_right = place.x() < 0.05 && place.z() < 0.05, is_front_left = place.x() > 0.45 && place.z() > 0.35;
    if (!is_back_right && !is_front_left) continue;
    kept.push_back(p);
    bones.push_back(creature.patch_bone[static_cast<std::size_t>(p)]);
  }
  points = {points.nodes(Eigen::all, kept).eval(), points.weights(Eigen::all, kept).eval()};
  creature.patch_bone = bones;
  return creature;
}

/// The box of finite elements in the place of springs: its tets, or the cells that they cut.
inline BoxCreature make_element_box_creature(bool hexahedra,
                                             physics::ElasticLaw law = physics::ElasticLaw::kStableNeoHookean) {
  BoxCreature creature = make_box_creature();
  const physics::Body springs = creature.scene.body;
  physics::ElementMesh<3> mesh;
  mesh.rest = springs.rest;
  mesh.nodes = springs.tets;
  if (hexahedra) {  // five tets a cell, which lie between its corners
    mesh.nodes.resize(8, springs.tet_count() / 5);
    for (int c = 0; c < mesh.nodes.cols(); ++c) {
      const auto nodes = springs.tets.middleCols<5>(5 * c).reshaped();
      const Eigen::Vector3d low = springs.rest(Eigen::all, nodes).rowwise().minCoeff();
      for (const int n : nodes) {
        const Eigen::Array3i corner = ((springs.rest.col(n) - low).array() > 0.05).cast<int>();
        mesh.nodes(corner[0] + 2 * corner[1] + 4 * corner[2], c) = n;
      }
    }
  }
  mesh.materials = {{1000, 1000 * 9.81 * BoxCreature::kLength / 0.005, 0.4}};
  mesh.fill = Eigen::VectorXd::Ones(mesh.nodes.cols());
  creature.scene.body = physics::make_body<3>(mesh, springs.tets, physics::ElementBodyOptions{law, 0, 0.01});
  return creature;
}

/// Both kinds of elements, each under a law.
inline std::vector<BoxCreature> element_box_creatures() {
  return {make_element_box_creature(true), make_element_box_creature(false, physics::ElasticLaw::kCorotatedLinear)};
}

/// A motion of `frames` frames at 60 Hz: place(x, f) is where the rest place x [m] is in frame f.
template <typename Place>
Motion played(const BoxCreature& creature, Eigen::Index frames, bool loop, const Place& place) {
  const Eigen::Matrix3Xd& rest = creature.scene.body.rest;
  Motion motion;
  motion.loop = loop;
  motion.frames.resize(rest.size(), frames);
  for (Eigen::Index f = 0; f < frames; ++f) {
    for (Eigen::Index i = 0; i < rest.cols(); ++i) motion.at(f).col(i) = place(Eigen::Vector3d(rest.col(i)), f);
  }
  return motion;
}

inline Motion standing(const BoxCreature& creature, Eigen::Index frames, bool loop = true) {
  return played(creature, frames, loop, [](const Eigen::Vector3d& x, Eigen::Index) { return x; });
}

/// Stretches and squats on standing feet: nothing but the height changes, so its volume does.
inline Motion bobbing(const BoxCreature& creature, Eigen::Index frames, double amplitude) {
  return played(creature, frames, true, [&](const Eigen::Vector3d& x, Eigen::Index f) {
    const double phase = 2 * M_PI * static_cast<double>(f) / static_cast<double>(frames);
    return Eigen::Vector3d(x.x(), x.y() * (1 + amplitude * std::sin(phase)), x.z());
  });
}

/// All soles stand in every frame.
inline ContactSchedule always_standing(const BoxCreature& creature, Eigen::Index frames) {
  ContactSchedule contacts;
  for (int leg = 1; leg < 5; ++leg) {
    Patch patch{creature.skeleton.names[static_cast<std::size_t>(leg)], {}};
    for (std::size_t p = 0; p < creature.patch_bone.size(); ++p) {
      if (creature.patch_bone[p] == leg) patch.points.push_back(static_cast<int>(p));
    }
    if (patch.points.empty()) continue;
    contacts.patches.push_back(patch);
    contacts.state.emplace_back(static_cast<std::size_t>(frames), ContactState::kStick);
  }
  contacts.touching = Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic>::Constant(creature.scene.contact_points.count(), frames, true);
  contacts.sliding_x = contacts.sliding_z = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(contacts.patches.size()), frames);
  return contacts;
}

inline PreparedTarget as_prepared(const Motion& target, const ContactSchedule& contacts) {
  PreparedTarget prepared;
  prepared.target = target;
  prepared.contacts = contacts;
  return prepared;
}

inline PreparedTarget prepared(const BoxCreature& creature, const Motion& motion, const PrepareOptions& options = {}) {
  return prepare(motion, creature.scene, creature.patch_bone, creature.skeleton.names, creature.bone_weights, BoxCreature::kLength,
                 creature.size(), options);
}

}  // namespace hydrostat::retarget
