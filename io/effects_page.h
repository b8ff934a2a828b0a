#pragma once

#include <string>
#include <vector>

#include "retarget/effect_bench.h"

namespace hydrostat::io {

/// A table with a header: effect, ms_per_sim_s, difference_length, stable.
std::string effects_csv(const std::vector<retarget::EffectRow>& rows);
/// Bars of time and of difference in motion, with a sentence that says what to see.
std::string effects_svg(const std::string& subject, const std::vector<retarget::EffectRow>& rows);
/// One page that needs nothing else.
std::string effects_page(const std::string& subject, const std::vector<retarget::EffectRow>& rows);

}  // namespace hydrostat::io
