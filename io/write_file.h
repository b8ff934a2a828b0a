#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace hydrostat::io {

/// Writes a file whole or not at all: the bytes go to "<file>.part", reach the disk, and are renamed. Directories that are
/// missing are made. Throws Error that names `shown_as` and the cause (full disk, no permission, a directory in the way) and
/// leaves no part.
void write_file(const std::filesystem::path& file, std::string_view bytes, const std::filesystem::path& shown_as);
void write_file(const std::filesystem::path& file, std::string_view bytes);
/// The same of bytes that `next_piece` hands over one after the other, until a piece is empty: a large file need not lie in
/// memory as a whole.
void write_file(const std::filesystem::path& file, const std::function<std::string_view()>& next_piece);

/// All bytes of a file. Throws Error when it cannot be read.
std::string read_file(const std::filesystem::path& file);

/// What to do about an errno of a write: "Free space on the disk, or write elsewhere." and the like, one sentence.
const char* mend_of_write_error(int error_number);

}  // namespace hydrostat::io
