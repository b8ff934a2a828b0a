#include "physics/way_out.h"

#include <algorithm>
#include <limits>

namespace hydrostat::physics {
namespace {

constexpr double kDeep = 0.05;  // of D [-]: what is less deep is contact, on whichever side

/// The box around an obstacle in its own frame.
template <int Dim>
void bounds_of(const ObstacleOf<Dim>& obstacle, VectorOf<Dim>& low, VectorOf<Dim>& high) {
  if (const auto* const mesh = std::get_if<ClosedMeshOf<Dim>>(&obstacle.shape)) {
    low = mesh->low();
    high = mesh->high();
    return;
  }
  const auto* const box = std::get_if<BoxOf<Dim>>(&obstacle.shape);
  high = box != nullptr ? box->half_extents : VectorOf<Dim>::Constant(std::get<Ball>(obstacle.shape).radius);
  low = -high;
}

}  // namespace

template <int Dim>
WayOut<Dim>::WayOut(const SceneOf<Dim>& scene)
    : scene_(scene),
      deep_(kDeep * size_of_volume<Dim>(scene.body.rest_volume.sum())),
      led_(scene.obstacles.size() * static_cast<std::size_t>(scene.contact_points.count()), 0),
      sides_(scene.obstacles.size()) {}

template <int Dim>
VectorOf<Dim> WayOut<Dim>::travel_of(const StateOf<Dim>& state, int obstacle) const {
  return state.obstacle_travel.cols() == 0 ? VectorOf<Dim>::Zero() : VectorOf<Dim>(state.obstacle_travel.col(obstacle));
}

template <int Dim>
bool WayOut<Dim>::leaves_by_opposite_sides(const StateOf<Dim>& state, int obstacle) const {
  const ObstacleOf<Dim>& from = scene_.obstacles[static_cast<std::size_t>(obstacle)];
  const VectorOf<Dim> travel = travel_of(state, obstacle);
  bool is_wanted[Dim][2] = {};
  for (int p = 0; p < scene_.contact_points.count(); ++p) {
    const VectorOf<Dim> place = scene_.contact_points.of(state.x, p);
    if (!(distance_at_least<Dim>(from, travel, place) < -deep_)) continue;
    VectorOf<Dim> normal;
    if (!(signed_distance<Dim>(from, travel, place, normal) < -deep_)) continue;
    const VectorOf<Dim> local = from.turn.transpose() * normal;
    Eigen::Index axis;
    local.cwiseAbs().maxCoeff(&axis);
    is_wanted[axis][local[axis] > 0] = true;
  }
  return std::any_of(is_wanted, is_wanted + Dim, [](const bool* sides) { return sides[0] && sides[1]; });
}

template <int Dim>
void WayOut<Dim>::mark_inside(const StateOf<Dim>& state, int obstacle) {
  VectorOf<Dim> normal;
  const ObstacleOf<Dim>& from = scene_.obstacles[static_cast<std::size_t>(obstacle)];
  const VectorOf<Dim> travel = travel_of(state, obstacle);
  for (int p = 0; p < scene_.contact_points.count(); ++p) {
    led_[place_of(obstacle, p)] = signed_distance<Dim>(from, travel, scene_.contact_points.of(state.x, p), normal) < 0;
  }
}

/// Of the deepest place that is led [m].
template <int Dim>
double WayOut<Dim>::depth_below(const StateOf<Dim>& state, int obstacle, const Side& side) const {
  double depth = 0;
  for (int p = 0; p < scene_.contact_points.count(); ++p) {
    if (led_[place_of(obstacle, p)] == 0) continue;
    const VectorOf<Dim> place = scene_.contact_points.of(state.x, p) - travel_of(state, obstacle);
    depth = std::max(depth, side.offset - side.normal.dot(place));
  }
  return depth;
}

/// Whether the body, moved that way [m], would be deep in something else where it is not now.
template <int Dim>
bool WayOut<Dim>::is_barred(const StateOf<Dim>& state, int obstacle, const VectorOf<Dim>& way) const {
  VectorOf<Dim> normal;
  for (int p = 0; p < scene_.contact_points.count(); ++p) {
    const VectorOf<Dim> from = scene_.contact_points.of(state.x, p), to = from + way;
    const double height = scene_.ground.normal.dot(to) - scene_.ground.offset;
    if (scene_.has_ground && height < -deep_ && scene_.ground.normal.dot(way) < 0) return true;
    for (std::size_t o = 0; o < scene_.obstacles.size(); ++o) {
      if (static_cast<int>(o) == obstacle) continue;
      const VectorOf<Dim> travel = travel_of(state, static_cast<int>(o));
      const double there = signed_distance<Dim>(scene_.obstacles[o], travel, to, normal);
      if (there < -deep_ && there < signed_distance<Dim>(scene_.obstacles[o], travel, from, normal)) return true;
    }
  }
  return false;
}

/// A way aside counts twice, a way down three times: what goes up is borne by what it leaves.
template <int Dim>
typename WayOut<Dim>::Side WayOut<Dim>::best_side(const StateOf<Dim>& state, int obstacle) const {
  const ObstacleOf<Dim>& from = scene_.obstacles[static_cast<std::size_t>(obstacle)];
  VectorOf<Dim> low, high;
  bounds_of(from, low, high);
  const VectorOf<Dim> down = scene_.gravity.norm() > 0 ? VectorOf<Dim>(scene_.gravity.normalized()) : VectorOf<Dim>::Zero();
  constexpr double kBarred = 1e9;  // a way that is barred counts as so much longer
  Side best;
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 2 * Dim; ++k) {
    Side side;
    side.normal = (k % 2 == 0 ? 1 : -1) * from.turn.col(k / 2);
    side.offset = side.normal.dot(from.place) + (k % 2 == 0 ? high[k / 2] : -low[k / 2]);
    const double depth = depth_below(state, obstacle, side);
    const double cost = depth * (2 + side.normal.dot(down)) * (is_barred(state, obstacle, depth * side.normal) ? kBarred : 1);
    if (cost < least) best = side, least = cost;
  }
  return best;
}

template <int Dim>
void WayOut<Dim>::choose(const StateOf<Dim>& state) {
  std::fill(led_.begin(), led_.end(), 0);
  is_leading_ = false;
  for (int o = 0; o < static_cast<int>(scene_.obstacles.size()); ++o) {
    const auto obstacle = static_cast<std::size_t>(o);
    if (std::holds_alternative<HalfSpace>(scene_.obstacles[obstacle].shape) || !leaves_by_opposite_sides(state, o)) continue;
    mark_inside(state, o);
    sides_[obstacle] = best_side(state, o);
    is_leading_ = true;
  }
}

template <int Dim>
void WayOut<Dim>::let_go(const StateOf<Dim>& state) {
  if (!is_leading_) return;
  is_leading_ = false;
  VectorOf<Dim> normal;
  for (int o = 0; o < static_cast<int>(scene_.obstacles.size()); ++o) {
    for (int p = 0; p < scene_.contact_points.count(); ++p) {
      char& is_led = led_[place_of(o, p)];
      if (is_led == 0) continue;
      is_led = signed_distance<Dim>(scene_.obstacles[static_cast<std::size_t>(o)], travel_of(state, o),
                                    scene_.contact_points.of(state.x, p), normal) < 0;
      is_leading_ = is_leading_ || is_led != 0;
    }
  }
}

template <int Dim>
double WayOut<Dim>::gap(int obstacle, const VectorOf<Dim>& travel, const VectorOf<Dim>& place, double distance,
                        VectorOf<Dim>& normal) const {
  if (distance >= 0) return distance;
  const Side& side = sides_[static_cast<std::size_t>(obstacle)];
  normal = side.normal;
  return side.normal.dot(place - travel) - side.offset;
}

template class WayOut<2>;
template class WayOut<3>;

}  // namespace hydrostat::physics
