#include "physics/contact_set.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

namespace hydrostat::physics {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kCuts = 12;               // of the search along an edge
constexpr double kCutTolerance = 1e-6;  // of the edge's length [-]
constexpr double kPoke = 1e-3;          // of the edge's length [-]: what lies deeper than both ends by less is left to them
constexpr double kLeastOpening = 0.1;   // of the normals on both sides of a deepest place: sharper wedges have no direction
constexpr double kDeepestCorner = 0.5;  // of the face's size [-]: what is deeper came in elsewhere

}  // namespace

template <int Dim>
ContactSet<Dim>::ContactSet(const SceneOf<Dim>& scene)
    : scene_(scene), first_obstacle_(scene.has_ground ? 1 : 0), itself_(scene), way_out_(scene) {
  const ContactPointsOf<Dim>& points = scene.contact_points;
  candidates_.reserve(static_cast<std::size_t>(itself_.slot_count()));
  if (points.count() == 0 || (!scene.has_ground && scene.obstacles.empty())) return;
  inverse_mass_ = inverse_masses(scene.body);
  for (int p = 0; p < points.count(); ++p) features_.push_back({1, {p}});
  const bool seeks_between =
      std::any_of(scene.obstacles.begin(), scene.obstacles.end(),
                  [](const ObstacleOf<Dim>& obstacle) { return !std::holds_alternative<HalfSpace>(obstacle.shape); });
  if (seeks_between) {
    std::set<std::pair<int, int>> edges;
    for (Eigen::Index f = 0; f < scene.contact_faces.cols(); ++f) {
      for (int k = 0; k < Dim; ++k)
        edges.insert(std::minmax(scene.contact_faces(k, f), scene.contact_faces((k + 1) % Dim, f)));
    }
    for (const auto& [low, high] : edges) features_.push_back({2, {low, high}});
    if constexpr (Dim == 3) {
      for (Eigen::Index f = 0; f < scene.contact_faces.cols(); ++f) {
        features_.push_back({3, {scene.contact_faces(0, f), scene.contact_faces(1, f), scene.contact_faces(2, f)}});
      }
    }
  }
  const auto surfaces = static_cast<int>(scene.obstacles.size()) + first_obstacle_;
  for (int s = 0; s < surfaces; ++s) {
    const bool is_flat = s < first_obstacle_ || std::holds_alternative<HalfSpace>(
                                                    scene.obstacles[static_cast<std::size_t>(s - first_obstacle_)].shape);
    slot_begin_.push_back(slot_count_);
    feature_count_.push_back(is_flat ? points.count() : static_cast<int>(features_.size()));
    corners_.push_back(is_flat ? CornersOf<Dim>{}
                               : corners_of(scene.obstacles[static_cast<std::size_t>(s - first_obstacle_)]));
    slot_count_ += feature_count_.back();
  }
  candidates_.reserve(static_cast<std::size_t>(slot_count()));
  for (int p = 0; p < points.count(); ++p) {
    ContactOf<Dim> contact{};
    contact.feature = p;
    contact.point_count = 1;
    contact.points[0] = p;
    contact.shares[0] = 1;
    take_shares(contact);
    point_contacts_.push_back(contact);
  }
}

template <int Dim>
VectorOf<Dim> ContactSet<Dim>::travel_of(const PointsOf<Dim>& travel, int surface) const {
  if (surface < first_obstacle_ || travel.cols() == 0) return VectorOf<Dim>::Zero();
  return travel.col(surface - first_obstacle_);
}

template <int Dim>
double ContactSet<Dim>::distance(const PointsOf<Dim>& travel, int surface, const VectorOf<Dim>& point,
                                 VectorOf<Dim>& normal) const {
  if (surface < first_obstacle_) {
    normal = scene_.ground.normal;
    return scene_.ground.normal.dot(point) - scene_.ground.offset;
  }
  return signed_distance<Dim>(scene_.obstacles[static_cast<std::size_t>(surface - first_obstacle_)],
                              travel_of(travel, surface), point, normal);
}

template <int Dim>
bool ContactSet<Dim>::is_led(const ContactOf<Dim>& contact) const {
  if (contact.surface < first_obstacle_) return false;
  const auto leads = [&](int point) { return way_out_.leads(contact.surface - first_obstacle_, point); };
  return std::any_of(contact.points.begin(), contact.points.begin() + contact.point_count, leads);
}

template <int Dim>
double ContactSet<Dim>::distance_of_point(const PointsOf<Dim>& x, const PointsOf<Dim>& travel, const ContactOf<Dim>& contact,
                                          VectorOf<Dim>& normal) const {
  const VectorOf<Dim> place = contact.of(x);
  const double nearest = distance(travel, contact.surface, place, normal);
  if (!is_led(contact)) return nearest;
  return way_out_.gap(contact.surface - first_obstacle_, travel_of(travel, contact.surface), place, nearest, normal);
}

template <int Dim>
double ContactSet<Dim>::friction(const ContactOf<Dim>& contact) const {
  if (contact.is_internal()) return scene_.self_contact.friction;
  if (contact.surface < first_obstacle_) return scene_.ground.friction;
  return scene_.obstacles[static_cast<std::size_t>(contact.surface - first_obstacle_)].friction;
}

template <int Dim>
VectorOf<Dim> ContactSet<Dim>::velocity(const ContactOf<Dim>& contact) const {
  if (contact.surface < first_obstacle_) return VectorOf<Dim>::Zero();  // the body itself, too: of() is what moves there
  return scene_.obstacles[static_cast<std::size_t>(contact.surface - first_obstacle_)].velocity;
}

template <int Dim>
double ContactSet<Dim>::fastest_obstacle() const {
  double fastest = 0;
  for (const ObstacleOf<Dim>& obstacle : scene_.obstacles) fastest = std::max(fastest, obstacle.velocity.norm());
  return fastest;
}

template <int Dim>
void ContactSet<Dim>::move_obstacles(double h, PointsOf<Dim>& travel) const {
  if (fastest_obstacle() == 0) return;
  if (travel.cols() == 0) travel.setZero(Dim, static_cast<Eigen::Index>(scene_.obstacles.size()));
  for (std::size_t n = 0; n < scene_.obstacles.size(); ++n) {
    travel.col(static_cast<Eigen::Index>(n)) += h * scene_.obstacles[n].velocity;
  }
}

template <int Dim>
void ContactSet<Dim>::take_shares(ContactOf<Dim>& contact) const {
  const ContactPointsOf<Dim>& points = scene_.contact_points;
  contact.node_count = 0;
  for (int p = 0; p < contact.point_count; ++p) {
    const auto point = static_cast<std::size_t>(p);
    for (int k = 0; k <= Dim; ++k) {
      const double weight = contact.shares[point] * points.weights(k, contact.points[point]);
      if (weight == 0) continue;
      const int node = points.nodes(k, contact.points[point]);
      const auto end = contact.nodes.begin() + contact.node_count;
      const auto at = std::find(contact.nodes.begin(), end, node);
      const auto n = static_cast<std::size_t>(at - contact.nodes.begin());
      if (at == end) {
        contact.nodes[n] = node;
        contact.weights[n] = 0;
        ++contact.node_count;
      }
      contact.weights[n] += weight;
    }
  }
  contact.inverse_mass = 0;
  for (int k = 0; k < contact.node_count; ++k) {
    const auto n = static_cast<std::size_t>(k);
    contact.inverse_mass += contact.weights[n] * contact.weights[n] * inverse_mass_[contact.nodes[n]];
  }
}

template <int Dim>
bool ContactSet<Dim>::is_near(const StateOf<Dim>& state, int surface, const Feature& feature, double reach) const {
  VectorOf<Dim> middle = VectorOf<Dim>::Zero(), normal;
  std::array<VectorOf<Dim>, Dim> corners;
  for (int k = 0; k < feature.point_count; ++k) {
    const auto n = static_cast<std::size_t>(k);
    corners[n] = scene_.contact_points.of(state.x, feature.points[n]);
    middle += corners[n] / feature.point_count;
  }
  double radius = 0;
  for (int k = 0; k < feature.point_count; ++k)
    radius = std::max(radius, (corners[static_cast<std::size_t>(k)] - middle).norm());
  if (surface < first_obstacle_) return distance(state.obstacle_travel, surface, middle, normal) < reach;
  const ObstacleOf<Dim>& obstacle = scene_.obstacles[static_cast<std::size_t>(surface - first_obstacle_)];
  return distance_at_least<Dim>(obstacle, travel_of(state.obstacle_travel, surface), middle) - radius < reach;
}

template <int Dim>
ContactWork ContactSet<Dim>::work() const {
  ContactWork work = work_;
  return work += itself_.work();
}

template <int Dim>
void ContactSet<Dim>::find(const StateOf<Dim>& state, double reach, double own_reach) {
  candidates_.clear();
  work_.searched += slot_count_;
  if (starts_unknown_) {
    way_out_.choose(state);
  } else {
    way_out_.let_go(state);
  }
  starts_unknown_ = false;
  for (std::size_t s = 0; s < slot_begin_.size(); ++s) {
    for (int f = 0; f < feature_count_[s]; ++f) {
      const Feature& feature = features_[static_cast<std::size_t>(f)];
      if (!is_near(state, static_cast<int>(s), feature, reach)) continue;
      if (feature.point_count == 1) {
        candidates_.push_back(point_contacts_[static_cast<std::size_t>(f)]);
      } else {
        candidates_.emplace_back();
        candidates_.back().feature = f;
        candidates_.back().point_count = feature.point_count;
        candidates_.back().points = feature.points;
      }
      candidates_.back().slot = slot_begin_[s] + f;
      candidates_.back().surface = static_cast<int>(s);
    }
  }
  if (has_internal()) itself_.find(state.x, own_reach, slot_count_, candidates_);
}

template <int Dim>
void ContactSet<Dim>::update(const PointsOf<Dim>& x, const PointsOf<Dim>& travel, ContactOf<Dim>& contact) {
  ++(contact.is_internal() || contact.point_count > 1 ? work_.wide_looks : work_.looks);
  if (contact.is_internal()) {
    itself_.update(x, contact);
  } else if (contact.point_count == 1) {
    contact.gap = distance_of_point(x, travel, contact, contact.normal);
  } else if (is_led(contact)) {
    contact.gap = kInfinity;  // its ends and corners lead out
  } else if (contact.point_count == 2) {
    find_deepest_of_edge(x, travel, contact);
  } else {
    find_deepest_corner(x, travel, contact);
  }
}

template <int Dim>
double ContactSet<Dim>::gap(const PointsOf<Dim>& x, const PointsOf<Dim>& travel, const ContactOf<Dim>& contact,
                            VectorOf<Dim>& normal) const {
  return contact.point_count == 1 ? distance_of_point(x, travel, contact, normal)
                                  : distance(travel, contact.surface, contact.of(x), normal);
}

/// The least distance along an edge, which is convex in the place on it for convex obstacles: the tangents at both ends of
/// what is left meet in the next place to look at (Kelley's cutting planes in one dimension). Where two faces of the
/// obstacle meet there, the normal is the mean of theirs that is perpendicular to the edge.
template <int Dim>
void ContactSet<Dim>::find_deepest_of_edge(const PointsOf<Dim>& x, const PointsOf<Dim>& travel,
                                           ContactOf<Dim>& contact) const {
  struct Cut {
    double place, distance, slope;
    VectorOf<Dim> normal;
  };
  const VectorOf<Dim> from = scene_.contact_points.of(x, contact.points[0]);
  const VectorOf<Dim> along = scene_.contact_points.of(x, contact.points[1]) - from;
  const double length = along.norm();
  const auto cut_at = [&](double place) {
    Cut cut{place, 0, 0, {}};
    cut.distance = distance(travel, contact.surface, from + place * along, cut.normal);
    cut.slope = cut.normal.dot(along);
    return cut;
  };
  contact.gap = kInfinity;
  Cut low = cut_at(0), high = cut_at(1);
  if (!(low.slope < 0 && high.slope > 0)) return;
  const double at_ends = std::min(low.distance, high.distance);
  double place = 0, least = 0;
  VectorOf<Dim> normal;
  for (int k = 0; k < kCuts; ++k) {
    place = (high.distance - low.distance + low.slope * low.place - high.slope * high.place) / (low.slope - high.slope);
    least = low.distance + low.slope * (place - low.place);
    normal = (high.slope * low.normal - low.slope * high.normal) / (high.slope - low.slope);
    if (!(place > low.place && place < high.place)) break;
    const Cut cut = cut_at(place);
    if (cut.distance - least < kCutTolerance * length) break;
    (cut.slope < 0 ? low : high) = cut;
  }
  const double opening = normal.norm();
  if (!(least < at_ends - kPoke * length) || opening < kLeastOpening) return;
  contact.normal = normal / opening;
  contact.gap = least / opening;
  contact.shares[0] = 1 - place;
  contact.shares[1] = place;
  take_shares(contact);
}

/// The corner or ball of the obstacle that stands deepest behind the face, or nearest before it, with its foot inside.
template <int Dim>
void ContactSet<Dim>::find_deepest_corner(const PointsOf<Dim>& x, const PointsOf<Dim>& travel,
                                          ContactOf<Dim>& contact) const {
  contact.gap = kInfinity;
  if constexpr (Dim == 3) {
    const CornersOf<3>& corners = corners_[static_cast<std::size_t>(contact.surface)];
    const Eigen::Vector3d a = scene_.contact_points.of(x, contact.points[0]);
    const Eigen::Vector3d ab = scene_.contact_points.of(x, contact.points[1]) - a;
    const Eigen::Vector3d ac = scene_.contact_points.of(x, contact.points[2]) - a;
    const Eigen::Vector3d area = ab.cross(ac);
    const double squared_area = area.squaredNorm();
    if (squared_area == 0) return;
    const Eigen::Vector3d outward = area / std::sqrt(squared_area), shift = travel_of(travel, contact.surface);
    const double deepest = -kDeepestCorner * std::sqrt(std::sqrt(squared_area));
    for (Eigen::Index c = 0; c < corners.places.cols(); ++c) {
      if (corners.radius == 0 && corners.normals.col(c).dot(outward) > -kLeastOpening) continue;
      const Eigen::Vector3d arm = corners.places.col(c) + shift - a;
      const double distance = outward.dot(arm) - corners.radius;
      const double b = arm.cross(ac).dot(area) / squared_area, d = ab.cross(arm).dot(area) / squared_area;
      if (b < 0 || d < 0 || b + d > 1 || distance >= contact.gap || distance < deepest) continue;
      contact.gap = distance;
      contact.normal = -outward;
      contact.shares = {1 - b - d, b, d};
    }
    if (contact.gap < kInfinity) take_shares(contact);
  }
}

template class ContactSet<2>;
template class ContactSet<3>;

}  // namespace hydrostat::physics
