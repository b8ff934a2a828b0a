#pragma once

#include <vector>

#include "physics/scene.h"

namespace hydrostat::physics {

/// How a body that starts deep inside an obstacle gets out of it: as one. Where its places would leave by opposite sides, each by
/// its own nearest, all that are inside go over the same side of the obstacle's box instead: the way is short, rather up than
/// aside, and not barred by ground or another obstacle. A place that has been outside is led no longer.
template <int Dim>
class WayOut {
 public:
  explicit WayOut(const SceneOf<Dim>& scene);

  /// Whom to lead where, from this state on.
  void choose(const StateOf<Dim>& state);
  /// Leaves those that are out to themselves.
  void let_go(const StateOf<Dim>& state);
  bool leads(int obstacle, int point) const { return is_leading_ && led_[place_of(obstacle, point)] != 0; }
  /// From the side that leads out [m], negative below it, whose outward normal becomes `normal`; `distance` and `normal` are
  /// those of the obstacle itself, which stay for what is outside.
  double gap(int obstacle, const VectorOf<Dim>& travel, const VectorOf<Dim>& place, double distance,
             VectorOf<Dim>& normal) const;

 private:
  struct Side {
    VectorOf<Dim> normal = VectorOf<Dim>::UnitY();
    double offset = 0;  // [m] of the obstacle before any travel
  };
  std::size_t place_of(int obstacle, int point) const {
    return static_cast<std::size_t>(obstacle) * static_cast<std::size_t>(scene_.contact_points.count()) +
           static_cast<std::size_t>(point);
  }
  VectorOf<Dim> travel_of(const StateOf<Dim>& state, int obstacle) const;
  bool leaves_by_opposite_sides(const StateOf<Dim>& state, int obstacle) const;
  void mark_inside(const StateOf<Dim>& state, int obstacle);
  double depth_below(const StateOf<Dim>& state, int obstacle, const Side& side) const;
  bool is_barred(const StateOf<Dim>& state, int obstacle, const VectorOf<Dim>& way) const;
  Side best_side(const StateOf<Dim>& state, int obstacle) const;

  const SceneOf<Dim>& scene_;
  double deep_ = 0;  // [m]
  bool is_leading_ = false;
  std::vector<char> led_;    // obstacles x contact points
  std::vector<Side> sides_;  // of each obstacle
};

}  // namespace hydrostat::physics
