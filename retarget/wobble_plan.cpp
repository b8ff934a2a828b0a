#include "retarget/wobble_plan.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "retarget/cpu_seconds.h"
#include "retarget/error.h"

namespace hydrostat::retarget {
namespace {

constexpr Eigen::Index kSought = 16, kMostKept = 8;  // modes; the latter for what reads glTF
constexpr double kSeen = 0.003;                      // of L: less is not seen
constexpr double kLeastModeShare = 0.1;              // of that: a mode below is left out
constexpr double kUnseen = 1e-3;                     // of a mode's largest offset: less is nothing
constexpr double kStartForgotten = 7;                // time constants of a mode after which its start no longer counts
constexpr Eigen::Index kTimedFrames = 12;

/// Amplitudes of the target, K x F, not limited; `wobble.start` becomes that of its first frame.
Eigen::MatrixXd target_amplitudes(const Performer& performer, Wobble& wobble) {
  const Motion& target = performer.prepared.target;
  const Eigen::MatrixXd loads = wobble_loads(wobble, performer, target);
  wobble.mean_load = loads.rowwise().mean();
  const Eigen::VectorXd w = 2 * M_PI * wobble.frequency_hz;
  wobble.start.col(0) = (loads.col(0) - wobble.mean_load).cwiseQuotient(w.cwiseAbs2());
  wobble.start.col(1).setZero();
  if (!target.loop) return swung(wobble, loads, target.rate_hz);
  Eigen::MatrixXd closed(loads.rows(), loads.cols() + 1);
  closed << loads, loads.col(0);
  for (Eigen::Index k = 0; k < w.size(); ++k) {
    const double periods = std::ceil(kStartForgotten / (kWobbleDamping * w[k]) / target.duration_s());
    Eigen::Vector2d now = wobble.start.row(k);
    for (double period = 0; period < periods; ++period) {
      for (Eigen::Index f = 0; f < loads.cols(); ++f)
        now = oscillated(now, w[k], kWobbleDamping, 1 / target.rate_hz, closed(k, f) - wobble.mean_load[k],
                         closed(k, f + 1) - wobble.mean_load[k]);
    }
    wobble.start.row(k) = now;
  }
  return swung(wobble, loads, target.rate_hz);
}

/// The wobble with some of its modes alone.
Wobble with_modes(const Wobble& all, const std::vector<Eigen::Index>& modes) {
  Wobble some;
  some.shapes = all.shapes(Eigen::all, modes);
  some.frequency_hz = all.frequency_hz(modes);
  some.drive = all.drive(Eigen::all, modes);
  some.mean_load = all.mean_load(modes);
  some.most = all.most(modes);
  some.start = all.start(modes, Eigen::all);
  return some;
}

/// Modes that the target drives, the most driven first, at most kMostKept; those below `least` [m] are left out.
std::vector<Eigen::Index> driven_modes(const Eigen::MatrixXd& amplitudes, double least) {
  const Eigen::VectorXd farthest = amplitudes.rows() > 0 ? amplitudes.cwiseAbs().rowwise().maxCoeff().eval() : Eigen::VectorXd();
  std::vector<Eigen::Index> modes(static_cast<std::size_t>(farthest.size()));
  std::iota(modes.begin(), modes.end(), 0);
  std::stable_sort(modes.begin(), modes.end(), [&](Eigen::Index a, Eigen::Index b) { return farthest[a] > farthest[b]; });
  if (static_cast<Eigen::Index>(modes.size()) > kMostKept) modes.resize(kMostKept);
  while (!modes.empty() && farthest[modes.back()] < least) modes.pop_back();
  std::sort(modes.begin(), modes.end());
  return modes;
}

Wobble off_because(const std::string& reason) {
  Wobble off;
  off.reason = reason;
  return off;
}

/// All modes that are looked at; a body that no finer mesh can be made of has none.
Wobble modes_of(const Performer& performer, const Rig& rig) {
  try {
    Wobble modes = flesh_modes(performer, rig, make_flesh(performer, rig), kSought);
    if (!modes.is_on()) modes.reason = "bones and ground hold all of the body, so that no flesh swings";
    return modes;
  } catch (const Error& error) {
    return off_because("no finer mesh can be made of the skin: " + std::string(error.what()));
  }
}

std::string told(const char* format, double share, const Wobble& wobble) {
  char text[240];
  if (wobble.is_on()) {
    std::snprintf(text, sizeof text, format, 100 * share, static_cast<int>(wobble.count()), wobble.frequency_hz.minCoeff(),
                  wobble.frequency_hz.maxCoeff());
  } else {
    std::snprintf(text, sizeof text, format, 100 * share);
  }
  return text;
}

}  // namespace

double farthest_wobble(const Wobble& wobble, const Eigen::MatrixXd& amplitudes) {
  double farthest = 0;
  for (Eigen::Index f = 0; f < amplitudes.cols(); ++f) {
    if (amplitudes.col(f).lpNorm<1>() <= farthest) continue;  // no shape has more than 1
    const Eigen::VectorXd offsets = wobble.shapes * amplitudes.col(f);
    farthest = std::max(farthest, offsets.reshaped(3, offsets.size() / 3).colwise().norm().maxCoeff());
  }
  return farthest;
}

Wobble plan_wobble(const Performer& performer, const Rig& rig, Wish wish) {
  if (wish == Wish::kOff) return off_because("turned off by --wobble");
  Wobble all = modes_of(performer, rig);
  if (!all.is_on()) return all;
  Eigen::MatrixXd amplitudes = target_amplitudes(performer, all);
  const double least = wish == Wish::kOn ? 0 : kLeastModeShare * kSeen * performer.length;
  const std::vector<Eigen::Index> modes = driven_modes(amplitudes, least);
  Wobble kept = with_modes(all, modes);
  amplitudes = amplitudes(modes, Eigen::all).eval();
  for (auto frame : amplitudes.colwise()) limit_wobble(kept, frame);
  const double share = farthest_wobble(kept, amplitudes) / performer.length;
  if (wish == Wish::kAuto && share < kSeen)
    return off_because(told("the target would move skin by at most %.2g %% L beyond what the nodes carry, which is not seen", share, {}));
  kept.reason = told("the target moves skin by up to %.2g %% L beyond what the nodes carry, in %d modes of %.3g to %.3g Hz", share, kept);
  if (wish == Wish::kOn) kept.reason = "asked for; " + kept.reason;
  return kept;
}

double wobble_seconds(const Performer& performer) {
  Motion some = performer.prepared.target;
  some.loop = false;
  some.frames = some.frames.leftCols(std::min(kTimedFrames, some.count())).eval();
  return seconds_of([&] { wobble_of(performer, some); }) / static_cast<double>(some.count());
}

MovingMorphs wobble_morphs(const Performer& performer, const Motion& motion) {
  MovingMorphs worn;
  const Wobble& wobble = performer.wobble;
  if (!wobble.is_on()) return worn;
  worn.rate_hz = motion.rate_hz;
  worn.weights = wobble_of(performer, motion);
  for (Eigen::Index k = 0; k < wobble.count(); ++k) {
    const double largest = std::max(worn.weights.row(k).cwiseAbs().maxCoeff(), 1e-12);
    worn.weights.row(k) /= largest;
    const auto offsets = wobble.shapes.col(k).reshaped(3, wobble.shapes.rows() / 3);
    std::vector<int> moved;
    for (int v = 0; v < offsets.cols(); ++v) {
      if (offsets.col(v).norm() > kUnseen) moved.push_back(v);
    }
    worn.targets.push_back({"wobble " + std::to_string(k + 1),
                            Eigen::Map<const Eigen::VectorXi>(moved.data(), static_cast<Eigen::Index>(moved.size())),
                            largest * offsets(Eigen::all, moved)});
  }
  return worn;
}

MovingMorphs worn_with(const MovingMorphs& own, const MovingMorphs& wobble) {
  if (wobble.targets.empty()) return own;
  if (own.targets.empty()) return wobble;
  MovingMorphs worn = wobble;
  const auto count = static_cast<Eigen::Index>(own.targets.size());
  worn.weights.resize(count + wobble.weights.rows(), wobble.weights.cols());
  worn.weights.bottomRows(wobble.weights.rows()) = wobble.weights;
  for (Eigen::Index f = 0; f < worn.weights.cols(); ++f)
    worn.weights.col(f).head(count) = own.at(static_cast<double>(f) / wobble.rate_hz);
  worn.targets.insert(worn.targets.begin(), own.targets.begin(), own.targets.end());
  return worn;
}

}  // namespace hydrostat::retarget
