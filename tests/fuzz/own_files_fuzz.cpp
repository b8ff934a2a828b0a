#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <unistd.h>

#include "io/batch_manifest.h"
#include "io/body_file.h"
#include "io/scene_file.h"
#include "io/signals_file.h"
#include "retarget/error.h"

namespace {

/// Where a text lies for the parsers that take a file.
const std::string& place() {
  static const std::string path = (std::filesystem::temp_directory_path() / ("hydrostat_own_" + std::to_string(getpid()) + ".toml")).string();
  return path;
}

void read_as(char kind, const std::string& text) {
  using namespace hydrostat;
  if (kind == 's') {
    io::parse_signals(text, "signals.json");
  } else if (kind == 'b') {
    retarget::Performer performer;
    io::parse_body(text, "body.json", performer);
  } else {
    std::ofstream(place(), std::ios::binary) << text;
    if (kind == 'm') io::read_batch_manifest(place());
    if (kind == 'w') io::read_scene_file(place());
  }
}

}  // namespace

/// One of our own texts, as HYDROSTAT_FUZZ_KIND tells: signals.json (s), body.json (b), a manifest (m) or a scene (w; its world).
/// Whatever it holds, it is read or refused with an Error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const char* kind = std::getenv("HYDROSTAT_FUZZ_KIND");
  try {
    read_as(kind ? *kind : 's', {reinterpret_cast<const char*>(data), size});
  } catch (const hydrostat::Error&) {
  }
  return 0;
}
