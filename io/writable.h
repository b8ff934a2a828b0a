#pragma once

#include <filesystem>

namespace hydrostat::io {

/// Before work whose outcome goes to a directory: makes it where it is missing, and writes and removes a file in it. Throws Error as
/// write_file does where that cannot be.
void refuse_unwritable(const std::filesystem::path& directory);

}  // namespace hydrostat::io
