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
constexpr int kUsualPartners = 24;   // of a place

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
