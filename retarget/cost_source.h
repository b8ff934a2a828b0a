#pragma once

#include <memory>
#include <mutex>
#include <utility>

#include "retarget/cost_to_go.h"

namespace hydrostat::retarget {

/// The cost to go of one motion, for all that go by it, side by side too: found when one first asks, and for all others the same. It hangs
/// neither on the body that goes nor on what disturbs it, nor on how far a regulator reaches.
class CostSource {
 public:
  /// What the motion refers to must outlive this and stay as it is.
  explicit CostSource(RegulatedMotion motion) : motion_(std::move(motion)) {}

  /// Who asks while it is being found waits. For other settings than those before it is found anew and the last one let go. None where
  /// there is no regulator for such a motion.
  std::shared_ptr<const CostToGo> cost(double control_s, RegulatorOptions options) const;
  /// Whether it is of just these, at the same places in memory; signals are not told apart.
  bool is_of(const physics::Scene& scene, const Muscles& muscles, const PreparedTarget& prepared, const NominalPath* path) const;
  int times_found() const;

 private:
  const RegulatedMotion motion_;
  mutable std::mutex mutex_;  // of all below, and of the motion's feed-forward
  mutable std::shared_ptr<const CostToGo> cost_;
  mutable double control_s_ = 0;      // of cost_
  mutable RegulatorOptions options_;  // likewise
  mutable int times_found_ = 0;
};

}  // namespace hydrostat::retarget
