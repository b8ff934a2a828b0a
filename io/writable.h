#pragma once

#include <filesystem>

namespace hydrostat::io {

/// Before work whose outcome goes to a directory: makes it where it is missing, writes a file in it, and takes all of that away again.
/// Throws Error as write_file does where that cannot be.
void refuse_unwritable(const std::filesystem::path& directory);
/// The same of a file that write_file is to write.
void refuse_unwritable_file(const std::filesystem::path& file);

}  // namespace hydrostat::io
