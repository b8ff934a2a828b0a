#include "retarget/skin_distance.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "retarget/best_fit_rotation.h"

namespace hydrostat::retarget {
namespace {

constexpr double kSameTime = 1e-6;  // of a frame: rounding of times

Eigen::Matrix3Xd nodes_at(const Motion& motion, double time_s) {
  const double place = std::clamp(time_s * motion.rate_hz, 0.0, static_cast<double>(motion.count() - 1));
  const auto from = static_cast<Eigen::Index>(std::floor(place + kSameTime));
  const double share = place - static_cast<double>(from);
  if (share < kSameTime) return motion.at(from);
  return (1 - share) * motion.at(from) + share * motion.at(from + 1);
}

}  // namespace

SkinDistance skin_distance(const CarriedSkin& a, const CarriedSkin& b) {
  assert(!a.nodes.loop && !b.nodes.loop);
  assert(a.embedding.count() == b.embedding.count() && a.embedding.count() > 0);
  const double both_s = std::min(a.nodes.duration_s(), b.nodes.duration_s());
  const auto frames = static_cast<Eigen::Index>(std::floor(both_s * a.nodes.rate_hz + kSameTime)) + 1;
  const Eigen::Index vertices = a.embedding.count();
  const Eigen::VectorXd weights = Eigen::VectorXd::Constant(vertices, 1 / static_cast<double>(vertices));
  SkinDistance found{Eigen::VectorXd(frames), Eigen::VectorXd(frames), Eigen::VectorXd(frames)};
  for (Eigen::Index f = 0; f < frames; ++f) {
    found.time_s[f] = static_cast<double>(f) / a.nodes.rate_hz;
    const Eigen::Matrix3Xd skin_a = embedded_positions(a.embedding, a.nodes.at(f));
    const Eigen::Matrix3Xd skin_b = embedded_positions(b.embedding, nodes_at(b.nodes, found.time_s[f]));
    found.distance_m[f] = std::sqrt((skin_a - skin_b).squaredNorm() / static_cast<double>(vertices));
    found.shape_m[f] = best_rigid_fit(skin_a, skin_b, weights).rms;
  }
  return found;
}

}  // namespace hydrostat::retarget
