#include "io/track.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "retarget/error.h"

namespace hydrostat::io {
namespace {

constexpr double kSameTime = 1e-7;  // [s]; finer than any file's tick

void keep_last_of_equal_times(Track& track) {
  std::size_t kept = 0;
  for (std::size_t k = 0; k < track.times.size(); ++k) {
    if (kept > 0 && track.times[k] - track.times[kept - 1] < kSameTime) --kept;
    track.times[kept] = track.times[k];
    for (Eigen::MatrixXd* keys : {&track.values, &track.in_tangents, &track.out_tangents}) {
      if (keys->cols() > 0) keys->col(static_cast<Eigen::Index>(kept)) = keys->col(static_cast<Eigen::Index>(k)).eval();
    }
    ++kept;
  }
  track.times.resize(kept);
  for (Eigen::MatrixXd* keys : {&track.values, &track.in_tangents, &track.out_tangents}) {
    if (keys->cols() > 0) keys->conservativeResize(Eigen::NoChange, static_cast<Eigen::Index>(kept));
  }
}

void straighten_quaternions(Track& track, const std::string& file, const std::string& where) {
  for (Eigen::Index k = 0; k < track.values.cols(); ++k) {
    const double length = track.values.col(k).norm();
    if (length < 1e-6) throw Error(file, where, "a rotation key is the zero quaternion", "Export the clip anew");
    track.values.col(k) /= length;
    const bool straight = track.interpolation == Interpolation::kLinear;
    if (straight && k > 0 && track.values.col(k).dot(track.values.col(k - 1)) < 0) track.values.col(k) *= -1;
  }
}

Eigen::VectorXd between(const Track& track, Eigen::Index k, double fraction, double span_s) {
  const Eigen::VectorXd from = track.values.col(k), to = track.values.col(k + 1);
  if (track.interpolation == Interpolation::kStep) return from;
  if (track.interpolation == Interpolation::kCubic) {
    const double s = fraction, s2 = s * s, s3 = s2 * s;
    return (2 * s3 - 3 * s2 + 1) * from + span_s * (s3 - 2 * s2 + s) * track.out_tangents.col(k) + (3 * s2 - 2 * s3) * to +
           span_s * (s3 - s2) * track.in_tangents.col(k + 1);
  }
  if (from.size() != 4) return from + fraction * (to - from);
  const Eigen::Quaterniond a(from[3], from[0], from[1], from[2]), b(to[3], to[0], to[1], to[2]);
  return a.slerp(fraction, b).coeffs();
}

}  // namespace

void make_sound(Track& track, const std::string& file, const std::string& where) {
  bool finite = track.values.allFinite() && track.in_tangents.allFinite() && track.out_tangents.allFinite();
  for (const double time : track.times) finite = finite && std::isfinite(time);
  if (!finite) throw Error(file, where, "a key is not a finite number", "Export the clip anew");
  for (std::size_t k = 1; k < track.times.size(); ++k) {
    if (track.times[k] < track.times[k - 1]) throw Error(file, where, "key times do not ascend", "Export the clip anew");
  }
  keep_last_of_equal_times(track);
  if (track.values.rows() == 4) straighten_quaternions(track, file, where);
}

Eigen::VectorXd value_at(const Track& track, double time_s) {
  const auto later = std::upper_bound(track.times.begin(), track.times.end(), time_s);
  if (later == track.times.begin()) return track.values.col(0);
  if (later == track.times.end()) return track.values.col(track.values.cols() - 1);
  const double start_s = *(later - 1), span_s = *later - start_s;
  Eigen::VectorXd value = between(track, later - track.times.begin() - 1, (time_s - start_s) / span_s, span_s);
  if (value.size() == 4) value.normalize();
  return value;
}

}  // namespace hydrostat::io
