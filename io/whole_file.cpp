#include "io/whole_file.h"

#include <fstream>
#include <string>

#include "retarget/error.h"

namespace hydrostat::io {

void write_whole_file(const std::filesystem::path& path, std::string_view bytes) {
  const std::filesystem::path part = path.string() + ".part";
  std::error_code failure;
  std::ofstream stream(part, std::ios::binary | std::ios::trunc);
  if (!stream) {
    throw Error(path.string(), "output", "the file cannot be opened for writing",
                "Name a folder that exists and that you may write to");
  }
  stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  stream.close();
  if (!stream) {
    std::filesystem::remove(part, failure);
    throw Error(path.string(), "output", "the file could not be written to its end", "Free space on the disk or name another one");
  }
  std::filesystem::rename(part, path, failure);
  if (failure) {
    std::error_code ignored;
    std::filesystem::remove(part, ignored);
    throw Error(path.string(), "output", "the finished file cannot take its place: " + failure.message(),
                "Remove what stands there or name another output");
  }
}

}  // namespace hydrostat::io
