#include "retarget/fall.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

namespace hydrostat::retarget {
namespace {

constexpr double kFallSeconds = 0.2, kFallTilt = 50 * M_PI / 180;

}  // namespace

bool FallWatch::has_fallen(const physics::Ground& ground, const RigidFit& fit, double seconds) {
  const double tilt = std::acos(std::clamp(fit.rotation(1, 1), -1.0, 1.0));
  const double height = ground.normal.dot(fit.mean_b) - ground.offset;
  const bool is_down = height < 0.5 * fit.mean_a.y() || tilt > kFallTilt;
  seconds_ = is_down ? seconds_ + seconds : 0;
  return seconds_ >= kFallSeconds;
}

std::string fall_cause(const ReplayInput& input, const physics::State& state, const physics::State& reference,
                       const RigidFit& fit, const Eigen::VectorXd& activation, double time_s) {
  std::map<std::string, std::pair<double, int>> error;
  std::map<std::string, std::pair<int, int>> at_limit;
  const physics::Body& body = input.scene.body;
  for (int e = 0; e < body.edge_count(); ++e) {
    const std::string& bone = input.muscles.edge_bone[static_cast<std::size_t>(e)];
    for (int k = 0; k < 2; ++k) {
      const int i = body.edges(k, e);
      const Eigen::Vector3d seen = fit.rotation * (reference.x.col(i) - fit.mean_a) + fit.mean_b;
      error[bone].first += (state.x.col(i) - seen).norm();
      error[bone].second += 1;
    }
    at_limit[bone].first += std::abs(activation[e] - 1) > 0.999 * input.limit ? 1 : 0;
    at_limit[bone].second += 1;
  }
  std::string worst;
  double largest = -1;
  for (const auto& [bone, sum] : error) {
    const double mean = sum.first / sum.second;
    if (mean > largest) largest = mean, worst = bone;
  }
  char text[300];
  std::snprintf(text, sizeof text,
                "at %.2f s (frame %ld) limb '%s' is %.3f m from its target, %.0f %% of its constraints at the limit of %.2f",
                time_s, frame_at(input.prepared.target, time_s), worst.c_str(), largest,
                100.0 * at_limit[worst].first / std::max(1, at_limit[worst].second), input.limit);
  return text;
}

}  // namespace hydrostat::retarget
