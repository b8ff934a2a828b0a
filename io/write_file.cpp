#include "io/write_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <system_error>
#include <utility>
#include <vector>

#include "io/writable.h"
#include "io/write_error.h"

namespace hydrostat::io {

namespace {

WriteError write_error(const std::filesystem::path& shown_as, int error_number) {
  return {shown_as.string(), "", std::string("cannot be written: ") + std::strerror(error_number),
          mend_of_write_error(error_number)};
}

using Pieces = std::function<std::string_view()>;

/// 0, or the errno of the call that failed.
int write_piece(int descriptor, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written >= 0) {
      bytes.remove_prefix(static_cast<std::size_t>(written));
    } else if (errno != EINTR) {
      return errno;
    }
  }
  return 0;
}

/// Likewise.
int write_and_sync(const std::filesystem::path& file, const Pieces& next_piece) {
  const int descriptor = open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (descriptor < 0) return errno;
  int failure = 0;
  for (std::string_view piece = next_piece(); failure == 0 && !piece.empty();) {
    failure = write_piece(descriptor, piece);
    if (failure == 0) piece = next_piece();
  }
  // A file system may find only now that it has no room left.
  if (failure == 0 && fsync(descriptor) != 0 && errno != EINVAL && errno != ENOTSUP) failure = errno;
  if (close(descriptor) != 0 && failure == 0) failure = errno;
  return failure;
}

}  // namespace

const char* mend_of_write_error(int error_number) {
  switch (error_number) {
    case ENOSPC:
    case EDQUOT:
      return "Free space on the disk, or write elsewhere.";
    case EFBIG:
      return "Raise the limit on file sizes (ulimit -f), or write elsewhere.";
    case EACCES:
    case EPERM:
      return "Give yourself permission to write there, or write elsewhere.";
    case EROFS:
      return "The file system is read-only; write elsewhere.";
    case ENOTDIR:
    case EEXIST:
      return "A file stands where a directory is needed; move it away, or write elsewhere.";
    case EISDIR:
      return "A directory stands where the file belongs; move it away, or write elsewhere.";
    case ENAMETOOLONG:
      return "Give a shorter name.";
    default:
      return "Check the path and the disk, or write elsewhere.";
  }
}

namespace {

void write_pieces(const std::filesystem::path& file, const Pieces& next_piece, const std::filesystem::path& shown_as) {
  std::error_code failed;
  if (file.has_parent_path()) std::filesystem::create_directories(file.parent_path(), failed);
  if (failed) throw write_error(shown_as, failed.value());
  std::filesystem::path part = file;
  part += ".part";
  int failure = write_and_sync(part, next_piece);
  if (failure == 0 && std::rename(part.c_str(), file.c_str()) != 0) failure = errno;
  if (failure == 0) return;
  std::filesystem::remove(part, failed);
  throw write_error(shown_as, failure);
}

}  // namespace

void write_file(const std::filesystem::path& file, std::string_view bytes, const std::filesystem::path& shown_as) {
  const auto whole = [&] { return std::exchange(bytes, {}); };
  write_pieces(file, whole, shown_as);
}

void write_file(const std::filesystem::path& file, std::string_view bytes) { write_file(file, bytes, file); }

void write_file(const std::filesystem::path& file, const Pieces& next_piece) { write_pieces(file, next_piece, file); }

void refuse_unwritable(const std::filesystem::path& directory) {
  std::error_code failed;
  std::vector<std::filesystem::path> made;  // the deepest first
  for (std::filesystem::path place = directory; !place.empty(); place = place.parent_path()) {
    if (std::filesystem::exists(std::filesystem::symlink_status(place, failed))) break;
    made.push_back(place);
  }
  if (!directory.empty()) std::filesystem::create_directories(directory, failed);
  const int cannot_make = failed.value();
  std::string name = (directory / ".hydrostat-XXXXXX").string();
  const int descriptor = cannot_make != 0 ? -1 : mkstemp(name.data());
  const int cannot_write = cannot_make != 0 ? cannot_make : descriptor < 0 ? errno : 0;
  if (descriptor >= 0) close(descriptor);
  if (descriptor >= 0) std::filesystem::remove(name, failed);
  for (const std::filesystem::path& place : made) std::filesystem::remove(place, failed);  // those that are empty
  if (cannot_write != 0) throw write_error(directory, cannot_write);
}

void refuse_unwritable_file(const std::filesystem::path& file) {
  if (std::filesystem::is_directory(file)) throw write_error(file, EISDIR);
  refuse_unwritable(file.parent_path());
}

std::string read_file(const std::filesystem::path& file) {
  std::ifstream stream;
  if (!std::filesystem::is_directory(file)) stream.open(file, std::ios::binary);
  if (!stream.is_open()) throw Error(file.string(), "", "cannot be read", "Check the path and the permission to read it.");
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

}  // namespace hydrostat::io
