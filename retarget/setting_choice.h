#pragma once

#include <optional>
#include <vector>

#include "retarget/accuracy.h"

namespace hydrostat::retarget {

/// Which rows no other beats in both error and time; of equal ones the first.
std::vector<bool> pareto_front(const std::vector<AccuracyRow>& rows, double AccuracyRow::* time = &AccuracyRow::ms_per_sim_s);
/// The stable row of least `time`, for a choice counted work, that was not refused and whose error is at most `most_m` [m]; none: -1.
int cheapest_within(const std::vector<AccuracyRow>& rows, double most_m, double AccuracyRow::* time = &AccuracyRow::work_ms);
/// The stable row of least error, one that was refused only where all were; none: -1.
int most_accurate(const std::vector<AccuracyRow>& rows);

/// The cheapest setting by counted work whose error stays within a bound, measured on this very body.
struct StepChoice {
  StepSetting setting;
  AccuracyRow row;
  bool is_met = false;           // false: the setting is the most accurate one that was found
  double estimated_error_m = 0;  // the row's, and what the reference leaves open
  std::vector<AccuracyRow> tried;
  int index = -1;  // of the row in `tried`
};
/// `only`: no other method is tried.
template <int Dim>
StepChoice choose_setting(const ReferenceOf<Dim>& reference, double most_m, std::optional<physics::Method> only);

/// The reference of a whole run, of which `first` is that of the first seconds; of its first part where the whole would take
/// more than a minute of counted work. None where that is no more than `first` has, or where something touches in it.
template <int Dim>
std::optional<ReferenceOf<Dim>> reference_of_whole(const ReferenceOf<Dim>& first, double duration_s);

/// What choose_setting found on the first seconds held against the whole run: settings that kept the error there are tried in
/// the order of their work, the first that keeps it to the end is taken; where none does, shorter steps. Rows of what was tried
/// on the whole are of it, the others stay as they are.
template <int Dim>
StepChoice choose_for_whole(const ReferenceOf<Dim>& whole, const StepChoice& first, double most_m,
                            std::optional<physics::Method> only);

}  // namespace hydrostat::retarget
