#include "physics/scene.h"

#include <cmath>

namespace hydrostat::physics {

template <int Dim>
ImpulsesOf<Dim> make_impulses(const SceneOf<Dim>& scene) {
  ImpulsesOf<Dim> impulses;
  impulses.contact.resize(Dim, scene.contact_points.count());
  impulses.contact_nodes.resize(Dim, scene.body.node_count());
  impulses.effect_nodes.resize(Dim, scene.body.node_count());
  impulses.hold.resize(Dim, static_cast<Eigen::Index>(scene.body.held.size()));
  impulses.internal_nodes.resize(Dim, scene.self_contact.is_on ? scene.body.node_count() : 0);
  impulses.correction_nodes.resize(Dim, scene.body.node_count());
  clear(impulses);
  return impulses;
}

template <int Dim>
void clear(ImpulsesOf<Dim>& impulses) {
  impulses.contact.setZero();
  impulses.contact_nodes.setZero();
  impulses.contact_moment.setZero();
  impulses.effect_nodes.setZero();
  impulses.effect_moment.setZero();
  impulses.gravity_moment.setZero();
  impulses.hold.setZero();
  impulses.internal_nodes.setZero();
  impulses.correction_nodes.setZero();
  impulses.obstacle_work = 0;
}

template <int Dim>
void add(const ImpulsesOf<Dim>& part, ImpulsesOf<Dim>& sum) {
  sum.contact += part.contact;
  sum.contact_nodes += part.contact_nodes;
  sum.contact_moment += part.contact_moment;
  sum.effect_nodes += part.effect_nodes;
  sum.effect_moment += part.effect_moment;
  sum.gravity_moment += part.gravity_moment;
  sum.hold += part.hold;
  sum.internal_nodes += part.internal_nodes;
  sum.correction_nodes += part.correction_nodes;
  sum.obstacle_work += part.obstacle_work;
}

template <int Dim>
double push_out_speed(const SceneOf<Dim>& scene) {
  const double gravity = scene.gravity.norm();
  return 0.25 * std::sqrt((gravity > 0 ? gravity : 9.81) * size_of_volume<Dim>(scene.body.rest_volume.sum()));
}

template <int Dim>
void touch_with_whole_surface(SceneOf<Dim>& scene) {
  const BodyOf<Dim>& body = scene.body;
  const std::vector<SurfaceFace> faces = surface_faces(body);
  std::vector<int> point_of(static_cast<std::size_t>(body.node_count()), -1);
  ContactPointsOf<Dim>& points = scene.contact_points;
  points.nodes.resize(Dim + 1, body.node_count());
  points.weights.setZero(Dim + 1, body.node_count());
  scene.contact_faces.resize(Dim, static_cast<Eigen::Index>(faces.size()));
  int point_count = 0, face_count = 0;
  for (const SurfaceFace& face : faces) {
    for (int k = 0; k <= Dim; ++k) {
      if (k == face.opposite) continue;
      int& point = point_of[static_cast<std::size_t>(body.tets(k, face.tet))];
      if (point >= 0) continue;
      point = point_count++;
      points.nodes.col(point) = body.tets.col(face.tet);
      points.weights(k, point) = 1;
    }
    const Eigen::Matrix<int, Dim, 1> nodes = nodes_of_face(body, face);
    for (int k = 0; k < Dim; ++k) scene.contact_faces(k, face_count) = point_of[static_cast<std::size_t>(nodes[k])];
    ++face_count;
  }
  points.nodes.conservativeResize(Dim + 1, point_count);
  points.weights.conservativeResize(Dim + 1, point_count);
  scene.contact_faces.conservativeResize(Dim, face_count);
}

#define HYDROSTAT_INSTANTIATE(Dim)                                  \
  template ImpulsesOf<Dim> make_impulses<Dim>(const SceneOf<Dim>&); \
  template void clear<Dim>(ImpulsesOf<Dim>&);                       \
  template void add<Dim>(const ImpulsesOf<Dim>&, ImpulsesOf<Dim>&); \
  template double push_out_speed<Dim>(const SceneOf<Dim>&);         \
  template void touch_with_whole_surface<Dim>(SceneOf<Dim>&);
HYDROSTAT_INSTANTIATE(2)
HYDROSTAT_INSTANTIATE(3)
#undef HYDROSTAT_INSTANTIATE

}  // namespace hydrostat::physics
