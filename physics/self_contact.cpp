#include "physics/self_contact.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "physics/nearest_on_face.h"

namespace hydrostat::physics {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kRings = 2;         // of neighbours along the mesh that never touch
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
constexpr double kSpareReach = 0.2;    // of the shortest edge [-]
constexpr int kUsualPartners = 24;     // of a place

/// Barycentric coordinates of a point in a tet; false where that is flat or inverted.
template <int Dim>
bool coordinates_in(const PointsOf<Dim>& x, const int* nodes, const VectorOf<Dim>& point,
                    Eigen::Matrix<double, Dim + 1, 1>& weights) {
  BlockOf<Dim> spans;
  for (int k = 0; k < Dim; ++k) spans.col(k) = x.col(nodes[k + 1]) - x.col(nodes[0]);
  if (!(spans.determinant() > 0)) return false;
  weights.template tail<Dim>() = spans.inverse() * (point - x.col(nodes[0]));
  weights[0] = 1 - weights.template tail<Dim>().sum();
  return weights.allFinite();
}

}  // namespace

template <int Dim>
SelfContactSet<Dim>::SelfContactSet(const SceneOf<Dim>& scene) : scene_(scene) {
  if (!scene.self_contact.is_on) return;
  inverse_mass_ = inverse_masses(scene.body);
  find_surface();
  find_neighbours();
  if (Dim == 3) find_edges();
  if (faces_.cols() == 0) return;
  const std::size_t places = points_.size() + edges_.size();
  slot_count_ = static_cast<int>(places);
  face_low_.resize(Dim, faces_.cols());
  face_high_.resize(Dim, faces_.cols());
  tet_low_.resize(Dim, scene.body.tet_count());
  tet_high_.resize(Dim, scene.body.tet_count());
  const auto bound = [&](const auto& of, Eigen::Index k, PointsOf<Dim>& low, PointsOf<Dim>& high) {
    low.col(k) = scene.body.rest(Eigen::all, of.col(k)).rowwise().minCoeff();
    high.col(k) = scene.body.rest(Eigen::all, of.col(k)).rowwise().maxCoeff();
  };
  for (Eigen::Index f = 0; f < faces_.cols(); ++f) bound(faces_, f, face_low_, face_high_);
  for (int t = 0; t < scene.body.tet_count(); ++t) bound(scene.body.tets, t, tet_low_, tet_high_);
  face_tree_.grow(face_low_, face_high_);
  tet_tree_.grow(tet_low_, tet_high_);
  partner_begin_.assign(places, 0);
  partner_end_.assign(places, 0);
  partners_.reserve(kUsualPartners * places);
  spare_reach_ = kSpareReach * scene.body.rest_length.minCoeff();
  overlaps_.resize(points_.size());
  crossed_.assign(edges_.size(), -1);
}

/// What is within two edges of a node, and, where the scene says so, what is near it in the rest shape.
template <int Dim>
void SelfContactSet<Dim>::find_neighbours() {
  const BodyOf<Dim>& body = scene_.body;
  const auto count = static_cast<std::size_t>(body.node_count());
  std::vector<std::vector<int>> linked(count);
  for (int e = 0; e < body.edge_count(); ++e) {
    linked[static_cast<std::size_t>(body.edges(0, e))].push_back(body.edges(1, e));
    linked[static_cast<std::size_t>(body.edges(1, e))].push_back(body.edges(0, e));
  }
  piece_.assign(count, -1);
  std::vector<int> reached;
  for (std::size_t n = 0; n < count; ++n) {
    if (piece_[n] >= 0) continue;
    piece_[n] = static_cast<int>(n);
    reached.assign(1, static_cast<int>(n));
    while (!reached.empty()) {
      const auto from = static_cast<std::size_t>(reached.back());
      reached.pop_back();
      for (const int to : linked[from]) {
        if (piece_[static_cast<std::size_t>(to)] >= 0) continue;
        piece_[static_cast<std::size_t>(to)] = static_cast<int>(n);
        reached.push_back(to);
      }
    }
  }
  near_.assign(points_.size() * count, false);
  const double near_at_rest = scene_.self_contact.near_at_rest;
  for (std::size_t p = 0; p < points_.size(); ++p) {
    const int node = points_[p];
    std::vector<int> near{node};
    for (int ring = 0; ring < kRings; ++ring) {
      for (std::size_t k = 0, known = near.size(); k < known; ++k) {
        const std::vector<int>& next = linked[static_cast<std::size_t>(near[k])];
        near.insert(near.end(), next.begin(), next.end());
      }
      std::sort(near.begin(), near.end());
      near.erase(std::unique(near.begin(), near.end()), near.end());
    }
    for (const int other : near) near_[p * count + static_cast<std::size_t>(other)] = true;
    for (int other = 0; near_at_rest > 0 && other < body.node_count(); ++other) {
      if ((body.rest.col(other) - body.rest.col(node)).norm() < near_at_rest)
        near_[p * count + static_cast<std::size_t>(other)] = true;
    }
  }
}

/// Nodes and faces of the surface that may meet any other.
template <int Dim>
void SelfContactSet<Dim>::find_surface() {
  const BodyOf<Dim>& body = scene_.body;
  const SelfContact& settings = scene_.self_contact;
  const auto meets_any = [&](int node) {
    return settings.region.size() == 0 || settings.meet.size() == 0 || settings.meet.col(settings.region[node]).any();
  };
  const std::vector<SurfaceFace> all = surface_faces(body);
  std::vector<char> is_point(static_cast<std::size_t>(body.node_count()), 0);
  faces_.resize(Dim, static_cast<Eigen::Index>(all.size()));
  for (const SurfaceFace& face : all) {
    const Eigen::Matrix<int, Dim, 1> nodes = nodes_of_face(body, face);
    if (std::none_of(nodes.begin(), nodes.end(), meets_any)) continue;
    for (const int node : nodes) is_point[static_cast<std::size_t>(node)] = 1;
    faces_.col(static_cast<Eigen::Index>(owners_.size())) = nodes;
    owners_.push_back(face);
  }
  faces_.conservativeResize(Dim, static_cast<Eigen::Index>(owners_.size()));
  point_of_.assign(static_cast<std::size_t>(body.node_count()), -1);
  for (int n = 0; n < body.node_count(); ++n) {
    if (!is_point[static_cast<std::size_t>(n)]) continue;
    point_of_[static_cast<std::size_t>(n)] = static_cast<int>(points_.size());
    points_.push_back(n);
  }
}

template <int Dim>
void SelfContactSet<Dim>::find_edges() {
  std::map<std::pair<int, int>, int> first_face;
  edge_begin_.assign(1, 0);
  for (Eigen::Index f = 0; f < faces_.cols(); ++f) {
    for (int k = 0; k < Dim; ++k) {
      const int a = faces_(k, f), b = faces_((k + 1) % Dim, f);
      const auto [entry, is_new] = first_face.try_emplace(std::minmax(a, b), static_cast<int>(f));
      if (is_new) continue;
      edges_.push_back({{a, b}, {entry->second, static_cast<int>(f)}});
    }
    edge_begin_.push_back(static_cast<int>(edges_.size()));
  }
}

template <int Dim>
bool SelfContactSet<Dim>::is_near(int a, int b) const {
  const auto point = static_cast<std::size_t>(point_of_[static_cast<std::size_t>(a)]);
  return near_[point * piece_.size() + static_cast<std::size_t>(b)];
}

template <int Dim>
bool SelfContactSet<Dim>::may_meet(int a, int b) const {
  const SelfContact& settings = scene_.self_contact;
  return settings.region.size() == 0 || settings.meet.size() == 0 || settings.meet(settings.region[a], settings.region[b]);
}

template <int Dim>
bool SelfContactSet<Dim>::may_touch(int node, const int* nodes, int count) const {
  bool meets = false;
  for (int k = 0; k < count; ++k) {
    if (is_near(node, nodes[k])) return false;
    meets = meets || may_meet(node, nodes[k]);
  }
  return meets;
}

/// Of a place: what stands within `distance` of it.
template <int Dim>
void SelfContactSet<Dim>::gather_partners(const PointsOf<Dim>& x, int place, double distance) {
  const auto p = static_cast<std::size_t>(place), points = points_.size();
  partner_begin_[p] = static_cast<int>(partners_.size());
  if (p < points) {
    const int node = points_[p];
    const VectorOf<Dim> low = x.col(node).array() - distance, high = x.col(node).array() + distance;
    face_tree_.visit(low, high, [&](int f) {
      if ((face_low_.col(f).array() > high.array()).any() || (face_high_.col(f).array() < low.array()).any()) return;
      if (may_touch(node, faces_.col(f).data(), Dim)) partners_.push_back(f);
    });
  } else {
    const auto e = static_cast<int>(p - points);
    const Eigen::Vector2i ends = edges_[static_cast<std::size_t>(e)].nodes;
    const VectorOf<Dim> low = x.col(ends[0]).cwiseMin(x.col(ends[1])).array() - distance;
    const VectorOf<Dim> high = x.col(ends[0]).cwiseMax(x.col(ends[1])).array() + distance;
    face_tree_.visit(low, high, [&](int f) {
      for (int o = std::max(e + 1, edge_begin_[static_cast<std::size_t>(f)]);
           o < edge_begin_[static_cast<std::size_t>(f) + 1]; ++o) {
        const Eigen::Vector2i other = edges_[static_cast<std::size_t>(o)].nodes;
        if ((x.col(other[0]).cwiseMin(x.col(other[1])).array() > high.array()).any() ||
            (x.col(other[0]).cwiseMax(x.col(other[1])).array() < low.array()).any()) {
          continue;
        }
        if (may_touch(ends[0], other.data(), 2) && may_touch(ends[1], other.data(), 2)) partners_.push_back(o);
      }
    });
  }
  partner_end_[p] = static_cast<int>(partners_.size());
}

template <int Dim>
void SelfContactSet<Dim>::gather(const PointsOf<Dim>& x, double reach) {
  for (Eigen::Index f = 0; f < faces_.cols(); ++f) {
    const BlockOf<Dim> corners = corners_of_face<Dim>(x, faces_.col(f));
    face_low_.col(f) = corners.rowwise().minCoeff();
    face_high_.col(f) = corners.rowwise().maxCoeff();
  }
  face_tree_.follow(face_low_, face_high_);
  partners_.clear();
  for (int place = 0; place < slot_count_; ++place) gather_partners(x, place, 2 * reach);
  gathered_at_ = x;
  gathered_reach_ = reach;
}

template <int Dim>
void SelfContactSet<Dim>::find(const PointsOf<Dim>& x, double reach, int first_slot,
                               std::vector<ContactOf<Dim>>& candidates) {
  double moved = 0;
  if (gathered_reach_ >= 0) moved = std::sqrt((x - gathered_at_).colwise().squaredNorm().maxCoeff());
  if (!(moved + reach <= gathered_reach_)) gather(x, reach + spare_reach_);
  tets_follow_ = false;
  ContactOf<Dim> contact{};
  contact.surface = ContactOf<Dim>::kItself;
  for (int place = 0; place < slot_count_; ++place) {
    const auto p = static_cast<std::size_t>(place);
    const bool is_point = p < points_.size(), has_partners = partner_begin_[p] < partner_end_[p];
    const bool may_overlap = is_point && (starts_unknown_ || overlaps_[p].face >= 0);
    if (!has_partners && !may_overlap) continue;
    contact.slot = first_slot + place;
    contact.feature = place;
    update(x, contact);
    if (may_overlap || (is_point && contact.gap < 0)) {
      find_overlap(x, place);
      update(x, contact);
    }
    if (!is_point) crossed_[p - points_.size()] = contact.gap < kInfinity ? contact.points[0] : -1;
    // What faces nothing now may do so after a turn.
    if (contact.gap < 2 * reach || contact.gap == kInfinity || !is_point) candidates.push_back(contact);
  }
  starts_unknown_ = false;
}

/// Looks for a tet, no neighbour, that the node is in.
template <int Dim>
void SelfContactSet<Dim>::find_overlap(const PointsOf<Dim>& x, int place) {
  const BodyOf<Dim>& body = scene_.body;
  if (!tets_follow_) {
    for (int t = 0; t < body.tet_count(); ++t) {
      tet_low_.col(t) = tet_high_.col(t) = x.col(body.tets(0, t));
      for (int k = 1; k <= Dim; ++k) {
        tet_low_.col(t) = tet_low_.col(t).cwiseMin(x.col(body.tets(k, t)));
        tet_high_.col(t) = tet_high_.col(t).cwiseMax(x.col(body.tets(k, t)));
      }
    }
    tet_tree_.follow(tet_low_, tet_high_);
    tets_follow_ = true;
  }
  const int node = points_[static_cast<std::size_t>(place)];
  const VectorOf<Dim> point = x.col(node);
  Overlap& overlap = overlaps_[static_cast<std::size_t>(place)];
  overlap.face = overlap.tet = -1;
  VectorOf<Dim> at_rest;
  double deepest = 0;
  tet_tree_.visit(point, point, [&](int t) {
    Eigen::Matrix<double, Dim + 1, 1> weights;
    const int* const nodes = body.tets.col(t).data();
    if (!may_touch(node, nodes, Dim + 1) || !coordinates_in<Dim>(x, nodes, point, weights)) return;
    if (!(weights.minCoeff() > deepest)) return;
    deepest = weights.minCoeff();
    overlap.tet = t;
    at_rest = VectorOf<Dim>::Zero();
    for (int k = 0; k <= Dim; ++k) at_rest += weights[k] * body.rest.col(nodes[k]);
  });
  if (overlap.tet < 0) return;
  const int piece = piece_[static_cast<std::size_t>(body.tets(0, overlap.tet))];
  double nearest = kInfinity;
  for (Eigen::Index f = 0; f < faces_.cols(); ++f) {
    if (piece_[static_cast<std::size_t>(faces_(0, f))] != piece || !may_touch(node, faces_.col(f).data(), Dim)) continue;
    const BlockOf<Dim> corners = corners_of_face<Dim>(body.rest, faces_.col(f));
    VectorOf<Dim> weights;
    nearest_on_face<Dim>(at_rest, corners, weights);
    const double squared = (at_rest - corners * weights).squaredNorm();
    if (!(squared < nearest)) continue;
    nearest = squared;
    overlap.face = static_cast<int>(f);
    overlap.foot = weights;
  }
}

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

template <int Dim>
double SelfContactSet<Dim>::deepest(const PointsOf<Dim>& x) {
  double deepest = 0;
  if (is_empty()) return deepest;
  looked_at_.clear();
  find(x, kDeepest / 2 * scene_.body.rest_length.minCoeff(), 0, looked_at_);
  for (ContactOf<Dim>& contact : looked_at_) {
    update(x, contact);
    deepest = std::max(deepest, -contact.gap);
  }
  return deepest;
}

template class SelfContactSet<2>;
template class SelfContactSet<3>;

}  // namespace hydrostat::physics
