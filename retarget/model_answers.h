#pragma once

#include <functional>
#include <mutex>
#include <vector>

#include "retarget/replay.h"
#include "retarget/return_map.h"

namespace hydrostat::retarget {

/// What the model of one motion answers to ReturnMap::learn, for all runs that go by it, side by side too: asked when one first wants to
/// know, and for all others the same. It hangs neither on the body that goes nor on what disturbs or delays it.
class ModelAnswers {
 public:
  struct Answered {
    ReturnMap::Answers errors;  // [rad], [m], [m], as ReturnMap::learn takes them
    double seconds = 0;  // of a processor, that another run spent on them; 0 for who asked
  };

  /// Who wants to know while the model is being asked waits. For other feedback or steps than any before it is asked anew.
  Answered of(const ReplayOptions& options, const std::function<ReturnMap::Answers()>& ask) const;
  int times_asked() const;

 private:
  struct Settings {
    double step_s;
    int steps_per_control;
    physics::Method method;
    CorrectorOptions corrector;
    bool operator==(const Settings&) const = default;
  };
  struct Entry {
    Settings settings;
    Answered answered;
  };
  mutable std::mutex mutex_;
  mutable std::vector<Entry> entries_;
};

}  // namespace hydrostat::retarget
