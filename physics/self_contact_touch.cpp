#include "physics/self_contact.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/coordinates_in.h"
#include "physics/nearest_on_face.h"

// How near a place of the body is to another, and along which normal.

namespace hydrostat::physics {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kDeepest = 0.5;  // of a tet's altitude [-]: a node deeper behind its face came in elsewhere
constexpr double kBeside = 0.25;  // of a tet's size [-]: a node farther beside it is not behind its face
// Of the shorter of two edges that cross [-]. Near a corner a pair may begin to cross that has a shorter way out: it is
// none.
constexpr double kDeepestEdge = 0.25;
constexpr double kDeepestNewEdge = 0.02;
constexpr double kLeastSine = 0.1;     // of the angle between two edges that cross
constexpr double kBeyond = 0.05;       // of a cosine [-]: how far their normal may be beyond those of the faces beside them
constexpr double kSame = 1e-9;         // of a distance [-]: faces as near share the edge or corner that is nearest
constexpr double kNoDirection = 1e-9;  // of a face's size [-]: what is nearer stands off along the face's normal

}  // namespace

template <int Dim>
void SelfContactSet<Dim>::update(const PointsOf<Dim>& x, ContactOf<Dim>& contact) const {
  if (static_cast<std::size_t>(contact.feature) < points_.size()) {
    face_node(x, contact);
  } else {
    face_edge(x, contact);
  }
}

template <int Dim>
void SelfContactSet<Dim>::face_node(const PointsOf<Dim>& x, ContactOf<Dim>& contact) const {
  const auto place = static_cast<std::size_t>(contact.feature);
  const int node = points_[place];
  const VectorOf<Dim> point = x.col(node);
  contact.gap = kInfinity;
  contact.nodes[0] = node;
  contact.weights[0] = 1;
  contact.node_count = 1;
  const Overlap& overlap = overlaps_[place];
  if (overlap.face >= 0) {
    const BlockOf<Dim> corners = corners_of_face<Dim>(x, faces_.col(overlap.face));
    contact.normal = face_normal<Dim>(corners).normalized();
    contact.gap = contact.normal.dot(point - corners * overlap.foot);
    press_against(x, overlap.tet, contact);
    return;
  }
  double nearest = kInfinity, along_nearest = 0;
  int tet = -1;
  for (int n = partner_begin_[place]; n < partner_end_[place]; ++n) {
    const int f = partners_[static_cast<std::size_t>(n)];
    const SurfaceFace& owner = owners_[static_cast<std::size_t>(f)];
    const BlockOf<Dim> corners = corners_of_face<Dim>(x, faces_.col(f));
    VectorOf<Dim> weights;
    const int feature = nearest_on_face<Dim>(point, corners, weights);
    const VectorOf<Dim> away = point - corners * weights;
    const double distance = away.norm();
    if (!(distance <= (1 + kSame) * nearest)) continue;
    const VectorOf<Dim> area = face_normal<Dim>(corners);
    const double size = area.norm();
    if (size == 0) continue;
    const double along = area.dot(away) / size;
    if (distance > (1 - kSame) * nearest && std::abs(along) <= along_nearest) continue;
    if (along < 0) {
      Eigen::Matrix<double, Dim + 1, 1> inside;
      if (!coordinates_in<Dim>(x, scene_.body.tets.col(owner.tet).data(), point, inside)) continue;
      const bool is_in_tet = inside.minCoeff() >= 0;
      if (!is_in_tet && (inside[owner.opposite] > kDeepest || inside.minCoeff() < -kBeside)) continue;
    }
    nearest = distance;
    along_nearest = std::abs(along);
    tet = owner.tet;
    contact.gap = along < 0 ? -distance : distance;
    const bool has_direction = feature != 0 && distance > kNoDirection * (corners.col(1) - corners.col(0)).norm();
    contact.normal = has_direction ? VectorOf<Dim>(away / contact.gap) : VectorOf<Dim>(area / size);
  }
  if (tet >= 0) press_against(x, tet, contact);
}

template <int Dim>
void SelfContactSet<Dim>::face_edge(const PointsOf<Dim>& x, ContactOf<Dim>& contact) const {
  contact.gap = kInfinity;
  if constexpr (Dim == 3) {
    const auto place = static_cast<std::size_t>(contact.feature);
    const Edge& edge = edges_[place - points_.size()];
    // The middle of the normals of the faces beside an edge, as long as the cosine between it and them.
    const auto outward = [&](const Edge& of) -> VectorOf<3> {
      VectorOf<3> sum = VectorOf<3>::Zero();
      for (const int f : of.faces) sum += face_normal<3>(corners_of_face<3>(x, faces_.col(f))).normalized();
      return sum / 2;
    };
    // Whether what touches the edge along `normal` touches neither face beside it first: all three are perpendicular to the
    // edge.
    const auto is_between = [](const VectorOf<3>& normal, const VectorOf<3>& out) {
      const double cosine = out.norm();
      return normal.dot(out) > (cosine - kBeyond) * cosine;
    };
    const VectorOf<3> a = x.col(edge.nodes[0]), u = x.col(edge.nodes[1]) - a, out = outward(edge);
    const double uu = u.squaredNorm();
    const int crossed = crossed_[place - points_.size()];
    int tet = -1;
    for (int n = partner_begin_[place]; n < partner_end_[place]; ++n) {
      const int partner = partners_[static_cast<std::size_t>(n)];
      const Edge& other = edges_[static_cast<std::size_t>(partner)];
      const VectorOf<3> c = x.col(other.nodes[0]), v = x.col(other.nodes[1]) - c, w = a - c;
      const double uv = u.dot(v), vv = v.squaredNorm(), uw = u.dot(w), vw = v.dot(w), squared_sine = uu * vv - uv * uv;
      if (!(squared_sine > kLeastSine * kLeastSine * uu * vv)) continue;
      const double s = (uv * vw - vv * uw) / squared_sine, t = (uu * vw - uv * uw) / squared_sine;
      if (s < 0 || s > 1 || t < 0 || t > 1) continue;
      VectorOf<3> normal = u.cross(v) / std::sqrt(squared_sine);
      const VectorOf<3> other_out = outward(other);
      if (normal.dot(other_out - out) < 0) normal = -normal;
      if (!is_between(normal, other_out) || !is_between(-normal, out)) continue;
      const double gap = normal.dot(w + s * u - t * v);
      const double deepest = partner == crossed ? kDeepestEdge : kDeepestNewEdge;
      if (gap < -deepest * std::sqrt(std::min(uu, vv)) || gap >= contact.gap) continue;
      contact.gap = gap;
      contact.normal = normal;
      contact.node_count = 2;
      contact.nodes[0] = edge.nodes[0];
      contact.nodes[1] = edge.nodes[1];
      contact.weights[0] = 1 - s;
      contact.weights[1] = s;
      contact.points[0] = partner;
      tet = owners_[static_cast<std::size_t>(other.faces[0])].tet;
    }
    if (tet >= 0) press_against(x, tet, contact);
  }
}

/// Adds the nodes of the tet that the place presses against.
template <int Dim>
void SelfContactSet<Dim>::press_against(const PointsOf<Dim>& x, int tet, ContactOf<Dim>& contact) const {
  for (int k = 0; k <= Dim; ++k) contact.nodes[static_cast<std::size_t>(contact.node_count++)] = scene_.body.tets(k, tet);
  carry(x, contact);
}

template <int Dim>
void SelfContactSet<Dim>::carry(const PointsOf<Dim>& x, ContactOf<Dim>& contact) const {
  const auto own = static_cast<std::size_t>(contact.node_count - Dim - 1);
  VectorOf<Dim> place = VectorOf<Dim>::Zero();
  for (std::size_t k = 0; k < own; ++k) place += contact.weights[k] * x.col(contact.nodes[k]);
  Eigen::Matrix<double, Dim + 1, 1> weights;
  contact.inverse_mass = 0;
  if (!coordinates_in<Dim>(x, contact.nodes.data() + own, place, weights)) {
    contact.gap = kInfinity;  // what is inside out has no outside
    return;
  }
  for (int k = 0; k <= Dim; ++k) contact.weights[own + static_cast<std::size_t>(k)] = -weights[k];
  for (std::size_t k = 0; k < own + Dim + 1; ++k) {
    contact.inverse_mass += contact.weights[k] * contact.weights[k] * inverse_mass_[contact.nodes[k]];
  }
}

#define HYDROSTAT_INSTANTIATE(Dim)                                                                                      \
  template void SelfContactSet<Dim>::update(const PointsOf<Dim>&, ContactOf<Dim>&) const;                               \
  template void SelfContactSet<Dim>::face_node(const PointsOf<Dim>&, ContactOf<Dim>&) const;                            \
  template void SelfContactSet<Dim>::face_edge(const PointsOf<Dim>&, ContactOf<Dim>&) const;                            \
  template void SelfContactSet<Dim>::press_against(const PointsOf<Dim>&, int, ContactOf<Dim>&) const;                   \
  template void SelfContactSet<Dim>::carry(const PointsOf<Dim>&, ContactOf<Dim>&) const;
HYDROSTAT_INSTANTIATE(2)
HYDROSTAT_INSTANTIATE(3)
#undef HYDROSTAT_INSTANTIATE

}  // namespace hydrostat::physics
