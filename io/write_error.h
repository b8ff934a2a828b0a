#pragma once

#include "retarget/error.h"

namespace hydrostat::io {

/// A file that cannot be written (full disk, no permission): whatever was to be written, it is no reason to try another.
struct WriteError : Error {
  using Error::Error;
};

}  // namespace hydrostat::io
