#pragma once

#include <string>
#include <string_view>
#include <variant>

#include "io/scene.h"
#include "retarget/error.h"

namespace hydrostat::io {

/// What the worker process answers: the scene, or why there is none.
using WorkerAnswer = std::variant<Scene, Error>;

/// The bytes of an answer: a magic word, the fields in order, counts as 64-bit numbers, an end word. For one machine and one
/// build: no byte order, no versions.
std::string to_bytes(const WorkerAnswer& answer);

/// Reads bytes that nobody vouches for. Every count is held against what is left, every index against what it points into,
/// every number must be finite. Throws std::runtime_error with the reason where something does not fit.
WorkerAnswer from_bytes(std::string_view bytes);

}  // namespace hydrostat::io
