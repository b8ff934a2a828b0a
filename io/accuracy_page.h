#pragma once

#include <string>
#include <vector>

#include "retarget/setting_choice.h"

namespace hydrostat::io {

/// What 'hydrostat bench accuracy' found.
struct AccuracyCurve {
  std::string subject;  // the scene's file or the creature's directory
  std::string truth;    // in words: what errors are told against
  std::vector<retarget::AccuracyRow> rows;
  int recommended = -1;  // the row of least time, as it is drawn, within max_error; -1: none
  double max_error = 0;  // per L
  double floor = 0;      // per L: no error below it can be told
  bool is_counted = false;  // drawn over counted work, by which choices go; else over the clock's time
};

/// A table with a header, one line a row: method, element, nodes, dt_s, iterations, harmonics, error_rms_m,
/// error_rel_length, ms_per_sim_s, volume_error, momentum_error, angular_error, stable.
std::string accuracy_csv(const AccuracyCurve& curve);
/// The curve alone, with axes, units and a sentence that says what to see.
std::string accuracy_svg(const AccuracyCurve& curve);
/// One page that needs nothing else: the curve, whose points lead to their rows of the table.
std::string accuracy_page(const AccuracyCurve& curve);
/// Schema "hydrostat.accuracy/1".
std::string accuracy_json(const AccuracyCurve& curve);

}  // namespace hydrostat::io
