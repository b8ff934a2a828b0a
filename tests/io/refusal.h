#pragma once

#include <gtest/gtest.h>

#include "retarget/error.h"

namespace hydrostat {

/// Calls `action`, which must throw Error; returns "file|where|what|mend".
template <typename Action>
std::string refusal(Action&& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.file + "|" + error.where + "|" + error.what() + "|" + error.mend;
  }
  ADD_FAILURE() << "nothing was refused";
  return "";
}

}  // namespace hydrostat
