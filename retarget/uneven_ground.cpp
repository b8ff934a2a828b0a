#include "retarget/uneven_ground.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace hydrostat::retarget {
namespace {

constexpr double kHighestStep = 0.1;   // per L
constexpr double kTouched = 1e-4;      // per L: as near to a surface a ray has met it
constexpr double kUneven = 2e-3;       // per L: less is no step
constexpr double kGroundSmooth = 0.1;  // [s] in which the reference follows the ground
constexpr double kNarrow = 0.1;        // per L: feet that stand nearer to each other tell little of a slope
constexpr int kMostMarches = 64;
constexpr double kFoothold = 0.01;  // per L: between places that a foot may land on
constexpr int kFarthest = 8;        // of those from where it would land
constexpr int kFromEdge = 2;        // of those: so far off an edge a foot is to stand
constexpr double kStay = 0.5;       // what leaving a chosen place costs, against what going there does

/// The outermost of a patch's points to four sides, in the target's first frame.
std::vector<int> outermost(const Patch& patch, const Eigen::Ref<const Eigen::Matrix3Xd>& places) {
  std::vector<int> chosen;
  for (const Eigen::Vector3d& side : {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(-1, 0, 0), Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0, 0, -1)}) {
    chosen.push_back(*std::max_element(patch.points.begin(), patch.points.end(), [&](int a, int b) {
      return side.dot(places.col(a)) < side.dot(places.col(b));
    }));
  }
  std::sort(chosen.begin(), chosen.end());
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
  return chosen;
}

}  // namespace

UnevenGround::UnevenGround(const physics::Scene& scene, const PreparedTarget& plan, double length, double clearance)
    : scene_(scene),
      plan_(plan),
      length_(length),
      clearance_(clearance),
      points_(point_motion(scene.contact_points, plan.target)),
      curve_(points_) {
  for (std::size_t k = 0; k < plan.contacts.patches.size(); ++k) {
    const Patch& patch = plan.contacts.patches[k];
    if (patch.on_leg) feet_.push_back({&patch, k, outermost(patch, points_.at(0))});
  }
}

double UnevenGround::height_at(const Eigen::Vector3d& place, const physics::State& state) const {
  const double ground = scene_.has_ground ? scene_.ground.offset : 0;
  Eigen::Vector3d at(place.x(), ground + kHighestStep * length_, place.z()), normal;
  for (int march = 0; march < kMostMarches && at.y() > ground; ++march) {
    double nearest = at.y() - ground;
    for (std::size_t o = 0; o < scene_.obstacles.size(); ++o) {
      Eigen::Vector3d travel = Eigen::Vector3d::Zero();
      if (state.obstacle_travel.cols() > 0) travel = state.obstacle_travel.col(static_cast<Eigen::Index>(o));
      if (physics::distance_at_least<3>(scene_.obstacles[o], travel, at) >= nearest) continue;
      nearest = std::min(nearest, physics::signed_distance<3>(scene_.obstacles[o], travel, at, normal));
    }
    if (nearest < kTouched * length_) return march == 0 ? 0 : at.y() - ground;  // a wall
    at.y() -= nearest;
  }
  return 0;
}

/// 0 where by plan it stands.
long UnevenGround::frames_to_landing(const Foot& foot, double time_s) const {
  const std::vector<ContactState>& planned = plan_.contacts.state[foot.index];
  const Eigen::Index now = frame_at(plan_.target, time_s);
  const Eigen::Index count = plan_.target.count();
  for (Eigen::Index ahead = 0; ahead < count; ++ahead) {
    if (!plan_.target.loop && now + ahead >= count) return 0;
    if (planned[static_cast<std::size_t>((now + ahead) % count)] != ContactState::kOff) return ahead;
  }
  return 0;
}

/// The top under the outermost points of a foot, as the target has them at a time.
double UnevenGround::highest(const Foot& foot, double time_s, const RigidFit& fit, const physics::State& state) const {
  Eigen::Matrix3Xd x, v;
  curve_.at(time_s, x, v);
  double highest = 0;
  for (const int p : foot.points) highest = std::max(highest, height_at(fit.rotation * (x.col(p) - fit.mean_a) + fit.mean_b, state));
  return highest;
}

/// Where it would land at a time across an edge or beside one, another place on its way, the nearest that is level. Returns the height
/// of that place.
double UnevenGround::choose_foothold(Foot& foot, double time_s, const RigidFit& fit, const physics::State& state) {
  Eigen::Matrix3Xd x, v;
  curve_.at(time_s, x, v);
  Eigen::Matrix3Xd landing(3, static_cast<Eigen::Index>(foot.points.size()));
  for (std::size_t k = 0; k < foot.points.size(); ++k) landing.col(static_cast<Eigen::Index>(k)) = fit.rotation * (x.col(foot.points[k]) - fit.mean_a) + fit.mean_b;
  const Eigen::Vector3d to = landing.rowwise().mean() - foot.place;
  const Eigen::Vector3d way = Eigen::Vector3d(to.x(), 0, to.z()).normalized() * kFoothold * length_;
  const auto range = [&](int from, int until) {
    std::pair<double, double> heights(1e300, -1e300);
    for (Eigen::Index k = 0; k < landing.cols(); ++k) {
      for (int step = from; step <= until; ++step) {
        const double height = height_at(landing.col(k) + step * way, state);
        heights = {std::min(heights.first, height), std::max(heights.second, height)};
      }
    }
    return heights;
  };
  const auto is_level = [&](const std::pair<double, double>& heights) { return heights.second - heights.first < kUneven * length_; };
  const auto here = range(-kFromEdge, kFromEdge);
  if (is_level(here)) {
    foot.aside.setZero();
    return here.second;
  }
  double least = 1e300, height = here.second;
  Eigen::Vector3d chosen = Eigen::Vector3d::Zero();
  for (int step = -kFarthest; step <= kFarthest; ++step) {
    const double cost = way.norm() * std::abs(step) + kStay * (step * way - foot.aside).norm();
    if (cost >= least) continue;
    const auto there = range(step - kFromEdge, step + kFromEdge);
    if (!is_level(there)) continue;
    least = cost, chosen = step * way, height = there.second;
  }
  foot.aside = chosen;
  return height;
}

void UnevenGround::look_ahead(Foot& foot, double time_s, double seconds, const RigidFit& fit, const physics::State& state) {
  double here = 0;
  foot.place.setZero();
  for (const int p : foot.points) {
    const Eigen::Vector3d place = scene_.contact_points.of(state.x, p);
    here = std::max(here, height_at(place, state));
    foot.place += place / static_cast<double>(foot.points.size());
  }
  const long ahead = frames_to_landing(foot, time_s);
  double landing = here, most = here;
  if (ahead == 0) foot.aside.setZero();
  if (ahead > 0) {
    const double rate = plan_.target.rate_hz;
    landing = choose_foothold(foot, time_s + static_cast<double>(ahead) / rate, fit, state);
    most = std::max(most, landing);
    for (long f = 2; f < ahead; f += 2) most = std::max(most, highest(foot, time_s + static_cast<double>(f) / rate, fit, state));
  }
  const bool is_step = most > std::min(here, landing) + kUneven * length_;
  foot.lift = most + (is_step ? clearance_ * length_ : 0);
  const double share = is_first_ ? 1 : 1 - std::exp(-seconds / kGroundSmooth);
  foot.ground += share * (landing - foot.ground);
}

void UnevenGround::look(double time_s, double seconds, const RigidFit& fit, const physics::State& state) {
  centre_ = fit.mean_b;
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (Foot& foot : feet_) {
    look_ahead(foot, time_s, seconds, fit, state);
    const Eigen::Vector3d row(1, foot.place.x() - centre_.x(), foot.place.z() - centre_.z());
    normal += row * row.transpose();
    right += foot.ground * row;
  }
  is_first_ = false;
  if (feet_.empty()) return;
  normal.diagonal().tail<2>().array() += std::pow(kNarrow * length_, 2);
  plane_ = normal.ldlt().solve(right);
}

double UnevenGround::plane_at(const Eigen::Vector3d& place) const {
  return plane_[0] + plane_[1] * (place.x() - centre_.x()) + plane_[2] * (place.z() - centre_.z());
}

void UnevenGround::apply(const Eigen::Vector3d& com, physics::State& reference) const {
  if (plane_.isZero(0)) return;
  const Eigen::Vector3d up = Eigen::Vector3d(-plane_[1], 1, -plane_[2]).normalized(), axis = Eigen::Vector3d::UnitY().cross(up);
  const double sine = axis.norm();
  const Eigen::Matrix3d tilt = sine > 0 ? Eigen::AngleAxisd(std::asin(sine), axis / sine).toRotationMatrix() : Eigen::Matrix3d::Identity();
  for (Eigen::Index i = 0; i < reference.x.cols(); ++i) {
    const Eigen::Vector3d arm = reference.x.col(i) - com, speed = reference.v.col(i);
    reference.x.col(i) = com + Eigen::Vector3d(0, plane_[0], 0) + tilt * arm;
    reference.v.col(i) = tilt * speed;
  }
}

/// How much higher [m] it has to be before it goes on a little, so that it meets no riser; 0 where it meets none.
double UnevenGround::missing_height(const Patch& patch, const Eigen::Vector3d& way, const physics::State& state) const {
  const double ground = scene_.has_ground ? scene_.ground.offset : 0;
  double missing = 0;
  for (const int p : patch.points) {
    const Eigen::Vector3d place = scene_.contact_points.of(state.x, p);
    for (int step = 1; step <= kFromEdge; ++step) {
      missing = std::max(missing, height_at(place + step * kFoothold * length_ * way, state) - (place.y() - ground));
    }
  }
  return missing > kTouched * length_ ? missing : 0;
}

/// What keeps a foot that would meet a riser from going on, and lifts it over: its own place, a little back and as much higher as it has to be, in
/// the place of the reference's, and the reference's speed undone.
Eigen::Vector3d UnevenGround::hold(const Foot& foot, const physics::State& state, const physics::State& reference, double settle_s) const {
  Eigen::Vector3d speed = Eigen::Vector3d::Zero(), off = Eigen::Vector3d::Zero();
  for (const int p : foot.patch->points) {
    const double share = 1 / static_cast<double>(foot.patch->points.size());
    speed += share * scene_.contact_points.of(reference.v, p);
    off += share * (scene_.contact_points.of(state.x, p) - scene_.contact_points.of(reference.x, p));
  }
  speed.y() = 0;
  const Eigen::Vector3d way = speed.normalized();
  const double missing = missing_height(*foot.patch, way, state);
  if (missing == 0) return Eigen::Vector3d::Zero();
  const double back = std::min(0.0, way.dot(off) - speed.norm() * settle_s - kFoothold * length_);
  return back * way + (off.y() + missing + clearance_ * length_) * Eigen::Vector3d::UnitY();
}

void UnevenGround::lead(const std::vector<const Patch*>& feet, const physics::State& state, const physics::State& reference, double settle_s,
                        std::vector<Eigen::Vector3d>& moves) const {
  moves.clear();
  for (const Patch* patch : feet) {
    moves.push_back(Eigen::Vector3d::Zero());
    const auto foot = std::find_if(feet_.begin(), feet_.end(), [&](const Foot& f) { return f.patch == patch; });
    if (foot == feet_.end()) continue;
    moves.back() = hold(*foot, state, reference, settle_s);
    const double lift = foot->lift - plane_at(foot->place);
    if (moves.back().isZero(0)) moves.back() = foot->aside;
    moves.back().y() = std::max(moves.back().y(), lift);
  }
}

}  // namespace hydrostat::retarget
