#pragma once

#include "cli/asked_accuracy.h"
#include "io/stage_cache.h"

namespace hydrostat::cli {

/// A choice for the stage cache: all but the motions that it was held against, so that no candidate is left behind it.
io::Record record_of_choice(const ChosenStep& chosen);
/// Throws std::out_of_range for a record that lacks a value.
ChosenStep choice_of(const io::Record& record);

}  // namespace hydrostat::cli
