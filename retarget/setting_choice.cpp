#include "retarget/setting_choice.h"

#include <algorithm>
#include <cmath>

namespace hydrostat::retarget {
namespace {

constexpr double kMostWork = 60000;  // [ms] counted, of a whole run's reference

StepSetting setting_of(const AccuracyRow& row) { return {*physics::method_named(row.method), row.dt_s}; }

bool has(const std::vector<AccuracyRow>& rows, const StepSetting& setting) {
  return std::any_of(rows.begin(), rows.end(), [&](const AccuracyRow& row) {
    return row.method == physics::name_of(setting.method) && row.dt_s == setting.dt_s;
  });
}

/// The rows of a whole run among those that were tried.
class Trials {
 public:
  Trials(std::vector<AccuracyRow> rows, double most_m) : rows_(std::move(rows)), most_m_(most_m), is_whole_(rows_.size(), false) {}

  const std::vector<AccuracyRow>& rows() const { return rows_; }
  const AccuracyRow& row(int k) const { return rows_[static_cast<std::size_t>(k)]; }
  bool holds(int k) const { return row(k).stable && !row(k).is_refused && row(k).error_rms_m <= most_m_; }
  void put(int k, AccuracyRow row) {
    if (k == static_cast<int>(rows_.size())) {
      rows_.push_back({});
      is_whole_.push_back(true);
    }
    rows_[static_cast<std::size_t>(k)] = std::move(row);
    is_whole_[static_cast<std::size_t>(k)] = true;
  }
  /// Of least work among those that hold; -1: none.
  int cheapest() const {
    int best = -1;
    for (int k = 0; k < static_cast<int>(rows_.size()); ++k) {
      if (!is_whole_[static_cast<std::size_t>(k)] || !holds(k)) continue;
      if (best < 0 || row(k).work_ms < row(best).work_ms) best = k;
    }
    return best;
  }
  /// As most_accurate, of the whole run's.
  int nearest() const {
    std::vector<AccuracyRow> whole = rows_;
    for (std::size_t k = 0; k < whole.size(); ++k) whole[k].stable = whole[k].stable && is_whole_[k];
    return most_accurate(whole);
  }

 private:
  std::vector<AccuracyRow> rows_;
  double most_m_;
  std::vector<bool> is_whole_;
};

/// Settings that the first seconds did not ask for, each method's from long steps to short ones.
template <int Dim>
void try_others(const ReferenceOf<Dim>& whole, const std::vector<AccuracyRow>& first, std::optional<physics::Method> only,
                Trials& trials) {
  for (const std::vector<StepSetting>& of_method : settings_to_try(whole.scenario.scene, whole.options.step_frame_s)) {
    if (only && of_method.front().method != *only) continue;
    for (const StepSetting& setting : of_method) {
      if (has(first, setting)) continue;
      const int added = static_cast<int>(trials.rows().size());
      trials.put(added, measure_error(whole, whole.scenario, setting));
      const int best = trials.cheapest();
      if (best >= 0 && trials.row(added).work_ms >= trials.row(best).work_ms) break;
    }
  }
}

}  // namespace

std::vector<bool> pareto_front(const std::vector<AccuracyRow>& rows, double AccuracyRow::* time) {
  std::vector<bool> front(rows.size(), false);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    front[i] = rows[i].stable && !rows[i].is_refused;
    for (std::size_t j = 0; j < rows.size() && front[i]; ++j) {
      if (i == j || !rows[j].stable || rows[j].is_refused) continue;
      const bool no_worse = rows[j].error_rms_m <= rows[i].error_rms_m && rows[j].*time <= rows[i].*time;
      const bool better = rows[j].error_rms_m < rows[i].error_rms_m || rows[j].*time < rows[i].*time || j < i;
      if (no_worse && better) front[i] = false;
    }
  }
  return front;
}

int cheapest_within(const std::vector<AccuracyRow>& rows, double most_m, double AccuracyRow::* time) {
  int best = -1;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (!rows[k].stable || rows[k].is_refused || !(rows[k].error_rms_m <= most_m)) continue;
    if (best < 0 || rows[k].*time < rows[static_cast<std::size_t>(best)].*time) best = static_cast<int>(k);
  }
  return best;
}

int most_accurate(const std::vector<AccuracyRow>& rows) {
  int best = -1;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (!rows[k].stable) continue;
    const auto rank = [&](std::size_t row) { return std::pair(rows[row].is_refused, rows[row].error_rms_m); };
    if (best < 0 || rank(k) < rank(static_cast<std::size_t>(best))) best = static_cast<int>(k);
  }
  return best;
}

template <int Dim>
StepChoice choose_setting(const ReferenceOf<Dim>& reference, double most_m, std::optional<physics::Method> only) {
  StepChoice choice;
  std::vector<StepSetting> settings;
  const double room = most_m - reference.uncertainty_m();
  for (const std::vector<StepSetting>& of_method :
       settings_to_try(reference.scenario.scene, reference.options.step_frame_s)) {
    if (only && of_method.front().method != *only) continue;
    for (const StepSetting& setting :
         of_method) {  // shorter steps cost more: the first that will do is the method's cheapest
      choice.tried.push_back(measure_error(reference, reference.scenario, setting));
      settings.push_back(setting);
      const int best = cheapest_within(choice.tried, room);
      if (best >= 0 && choice.tried.back().work_ms >= choice.tried[static_cast<std::size_t>(best)].work_ms) break;
    }
  }
  int best = cheapest_within(choice.tried, room);
  choice.is_met = best >= 0;
  if (!choice.is_met) best = most_accurate(choice.tried);
  if (best < 0) best = 0;  // all of them ran away: the caller's own run will tell
  choice.setting = settings[static_cast<std::size_t>(best)];
  choice.index = best;
  choice.row = choice.tried[static_cast<std::size_t>(best)];
  choice.estimated_error_m = choice.row.error_rms_m + reference.uncertainty_m();
  return choice;
}

template <int Dim>
std::optional<ReferenceOf<Dim>> reference_of_whole(const ReferenceOf<Dim>& first, double duration_s) {
  if (first.windows.size() > 1) return std::nullopt;
  const double frame_s = first.options.frame_s, span_s = first.windows.front().duration_s;
  if (span_s < first.options.duration_s - frame_s) return std::nullopt;  // it breaks there
  AccuracyOptions options = first.options;
  options.duration_s = std::min(duration_s, kMostWork * span_s / std::max(1e-9, first.work_ms));
  if (options.duration_s < span_s + frame_s) return std::nullopt;
  // A second method that agreed on the first seconds need not be asked again.
  const bool is_checked = first.uncertainty_m() > first.own_error_m;
  ReferenceOf<Dim> whole = make_reference(first.scenario, options, is_checked);
  if (whole.windows.size() > 1) return std::nullopt;
  return whole;
}

template <int Dim>
StepChoice choose_for_whole(const ReferenceOf<Dim>& whole, const StepChoice& first, double most_m,
                            std::optional<physics::Method> only) {
  const double room = most_m - whole.uncertainty_m();
  const auto measure = [&](int k) {
    return measure_error(whole, whole.scenario, setting_of(first.tried[static_cast<std::size_t>(k)]));
  };
  Trials trials(first.tried, room);
  std::vector<AccuracyRow> left = first.tried;  // those within the error on the first seconds, and on the whole as far as is known
  int chosen = -1;
  for (int k = cheapest_within(left, room); k >= 0 && chosen < 0; k = cheapest_within(left, room)) {
    trials.put(k, measure(k));
    if (trials.holds(k)) chosen = k;
    left[static_cast<std::size_t>(k)].stable = false;
  }
  if (chosen < 0) {
    try_others(whole, first.tried, only, trials);
    chosen = trials.cheapest();
  }
  StepChoice choice;
  choice.is_met = chosen >= 0;
  if (chosen < 0) chosen = trials.nearest();
  if (chosen < 0) {
    chosen = first.index;
    trials.put(chosen, measure(chosen));
  }
  choice.tried = trials.rows();
  choice.index = chosen;
  choice.row = trials.row(chosen);
  choice.setting = setting_of(choice.row);
  choice.estimated_error_m = choice.row.error_rms_m + whole.uncertainty_m();
  return choice;
}

#define HYDROSTAT_INSTANTIATE(Dim)                                                                                    \
  template StepChoice choose_setting<Dim>(const ReferenceOf<Dim>&, double, std::optional<physics::Method>);           \
  template std::optional<ReferenceOf<Dim>> reference_of_whole<Dim>(const ReferenceOf<Dim>&, double);                  \
  template StepChoice choose_for_whole<Dim>(const ReferenceOf<Dim>&, const StepChoice&, double, std::optional<physics::Method>);
HYDROSTAT_INSTANTIATE(2)
HYDROSTAT_INSTANTIATE(3)
#undef HYDROSTAT_INSTANTIATE

}  // namespace hydrostat::retarget
