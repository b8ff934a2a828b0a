#pragma once

#include <string>
#include <vector>

#include "retarget/effect_bench.h"

namespace hydrostat::io {

/// A table with a header: effect, ms_per_sim_s, difference_length, stable, guard_steps, without_ms_per_sim_s,
/// without_difference_length.
std::string effects_csv(const std::vector<retarget::EffectRow>& rows);
/// Bars of time and of difference in motion, alone and left out, with a sentence that says what to see.
std::string effects_svg(const std::string& subject, const std::vector<retarget::EffectRow>& rows);
/// One page that needs nothing else.
std::string effects_page(const std::string& subject, const std::vector<retarget::EffectRow>& rows);

}  // namespace hydrostat::io
