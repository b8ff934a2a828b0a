#pragma once

#include <vector>

#include "retarget/corrector.h"
#include "retarget/prepare.h"

namespace hydrostat::retarget {

/// What a plan wants of its contacts, as the corrector is told it.
class PlannedContacts {
 public:
  /// `plan` must outlive this.
  explicit PlannedContacts(const PreparedTarget& plan);

  /// Before anything was simulated: what touches by plan sticks.
  ContactNow first() const;
  /// Sets what is to bear load from a time [s] to the horizon [s] behind it, the grip, and which feet are in the air, by what `contact`
  /// has of touching points. On uneven ground a foot that touches and should not is caught by an edge: it counts as in the air.
  void look(double time_s, double horizon_s, bool is_uneven, ContactNow& contact) const;

 private:
  const PreparedTarget& plan_;
  const std::vector<std::vector<bool>> steps_next_;
};

}  // namespace hydrostat::retarget
