#pragma once

#include <filesystem>
#include <string_view>

namespace hydrostat::io {

/// Writes `bytes` beside `path` (its name and ".part") and renames that when it is whole: a reader never sees half a file, and
/// what stood at `path` before stays until then. Throws Error when the place cannot be written; nothing half-written is left.
void write_whole_file(const std::filesystem::path& path, std::string_view bytes);

}  // namespace hydrostat::io
