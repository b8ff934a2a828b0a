#include "physics/self_contact.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/coordinates_in.h"
#include "physics/nearest_on_face.h"

namespace hydrostat::physics {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kLookedFor = 0.25;  // of the shortest edge [-]: how near to its faces depth is asked for
constexpr double kSpareReach = 0.2;  // of the shortest edge [-]
constexpr double kFarthestApart = 3;  // shortest edges [-]
constexpr int kUsualPartners = 24;   // of a place

/// The farthest that two nodes have moved against each other along one axis [m].
template <int Dim>
double spread(const PointsOf<Dim>& x, const PointsOf<Dim>& from) {
  constexpr int kWide = 4;
  Eigen::Array<double, Dim, kWide> low, high;
  low.setConstant(kInfinity);
  high = -low;
  Eigen::Index i = 0;
  for (; i + kWide <= x.cols(); i += kWide) {
    const Eigen::Array<double, Dim, kWide> moved = x.template middleCols<kWide>(i) - from.template middleCols<kWide>(i);
    low = low.min(moved);
    high = high.max(moved);
  }
  for (; i < x.cols(); ++i) {
    low.col(0) = low.col(0).min((x.col(i) - from.col(i)).array());
    high.col(0) = high.col(0).max((x.col(i) - from.col(i)).array());
  }
  return (high.rowwise().maxCoeff() - low.rowwise().minCoeff()).maxCoeff();
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
  farthest_apart_ = kFarthestApart * scene.body.rest_length.minCoeff();
  overlaps_.resize(points_.size());
  crossed_.assign(edges_.size(), -1);
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

/// Calls use(partner, gap) for what may touch a place and whose box is within `distance` of its own; gap [m] is how far apart
/// they are along the axis on which that is most.
template <int Dim>
template <typename Use>
void SelfContactSet<Dim>::visit_partners(const PointsOf<Dim>& x, int place, double distance, const Use& use) const {
  const auto p = static_cast<std::size_t>(place), points = points_.size();
  VectorOf<Dim> low, high;
  const auto gap = [&](const auto& other_low, const auto& other_high) {
    return distance + (other_low - high).cwiseMax(low - other_high).maxCoeff();
  };
  if (p < points) {
    const int node = points_[p];
    low = x.col(node).array() - distance;
    high = x.col(node).array() + distance;
    face_tree_.visit(low, high, [&](int f) {
      if ((face_low_.col(f).array() > high.array()).any() || (face_high_.col(f).array() < low.array()).any()) return;
      if (may_touch(node, faces_.col(f).data(), Dim)) use(f, gap(face_low_.col(f), face_high_.col(f)));
    });
    return;
  }
  const auto e = static_cast<int>(p - points);
  const Eigen::Vector2i ends = edges_[static_cast<std::size_t>(e)].nodes;
  low = x.col(ends[0]).cwiseMin(x.col(ends[1])).array() - distance;
  high = x.col(ends[0]).cwiseMax(x.col(ends[1])).array() + distance;
  face_tree_.visit(low, high, [&](int f) {
    for (int o = std::max(e + 1, edge_begin_[static_cast<std::size_t>(f)]); o < edge_begin_[static_cast<std::size_t>(f) + 1]; ++o) {
      const Eigen::Vector2i other = edges_[static_cast<std::size_t>(o)].nodes;
      const VectorOf<Dim> other_low = x.col(other[0]).cwiseMin(x.col(other[1]));
      const VectorOf<Dim> other_high = x.col(other[0]).cwiseMax(x.col(other[1]));
      if ((other_low.array() > high.array()).any() || (other_high.array() < low.array()).any()) continue;
      if (may_touch(ends[0], other.data(), 2) && may_touch(ends[1], other.data(), 2)) use(o, gap(other_low, other_high));
    }
  });
}

template <int Dim>
void SelfContactSet<Dim>::gather(const PointsOf<Dim>& x, double reach) {
  ++searches_;
  for (Eigen::Index f = 0; f < faces_.cols(); ++f) {
    const BlockOf<Dim> corners = corners_of_face<Dim>(x, faces_.col(f));
    face_low_.col(f) = corners.rowwise().minCoeff();
    face_high_.col(f) = corners.rowwise().maxCoeff();
  }
  face_tree_.follow(face_low_, face_high_);
  const bool stood_apart = apart_ > 0;
  gathered_at_ = x;
  gathered_reach_ = reach;
  if (stood_apart) measure_apart(x);
  if (stood_apart && apart_ > 2 * reach) return;  // the partners are none as before
  partners_.clear();
  work_.own_searched += slot_count_;
  for (int place = 0; place < slot_count_; ++place) {
    const auto p = static_cast<std::size_t>(place);
    partner_begin_[p] = static_cast<int>(partners_.size());
    visit_partners(x, place, 2 * reach, [&](int partner, double) { partners_.push_back(partner); });
    partner_end_[p] = static_cast<int>(partners_.size());
  }
  if (!partners_.empty()) {
    apart_ = 0;
  } else if (!stood_apart) {
    measure_apart(x);
  }
}

template <int Dim>
void SelfContactSet<Dim>::measure_apart(const PointsOf<Dim>& x) {
  apart_ = farthest_apart_;
  work_.own_searched += slot_count_;
  for (int place = 0; place < slot_count_; ++place) {
    visit_partners(x, place, apart_, [&](int, double gap) { apart_ = std::min(apart_, gap); });
  }
}

/// Whether the body touches nothing of itself, and gathering for `reach` would bring no partners: boxes that stand apart along
/// an axis come nearer to each other along it by no more than nodes move against each other.
template <int Dim>
bool SelfContactSet<Dim>::stands_apart(const PointsOf<Dim>& x, double reach) const {
  const double spare = apart_ - 2 * (reach + spare_reach_);
  return spare > 0 && !starts_unknown_ && !overlaps_itself_ && spread<Dim>(x, gathered_at_) <= spare;
}

template <int Dim>
void SelfContactSet<Dim>::find(const PointsOf<Dim>& x, double reach, int first_slot,
                               std::vector<ContactOf<Dim>>& candidates) {
  if (stands_apart(x, reach)) return;
  double moved = 0;
  if (gathered_reach_ >= 0) moved = std::sqrt((x - gathered_at_).colwise().squaredNorm().maxCoeff());
  if (!(moved + reach <= gathered_reach_)) gather(x, reach + spare_reach_);
  tets_follow_ = overlaps_itself_ = false;
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
    ++work_.wide_looks;
    if (may_overlap || (is_point && contact.gap < 0)) {
      find_overlap(x, place);
      update(x, contact);
      overlaps_itself_ = overlaps_itself_ || overlaps_[p].face >= 0;
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
  VectorOf<Dim> at_rest = VectorOf<Dim>::Zero();
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
double SelfContactSet<Dim>::deepest(const PointsOf<Dim>& x) {
  double deepest = 0;
  if (is_empty()) return deepest;
  looked_at_.clear();
  find(x, kLookedFor * scene_.body.rest_length.minCoeff(), 0, looked_at_);
  for (ContactOf<Dim>& contact : looked_at_) {
    update(x, contact);
    deepest = std::max(deepest, -contact.gap);
  }
  return deepest;
}

template class SelfContactSet<2>;
template class SelfContactSet<3>;

}  // namespace hydrostat::physics
