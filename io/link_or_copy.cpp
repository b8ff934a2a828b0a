#include "io/link_or_copy.h"

#include <system_error>

namespace hydrostat::io {

void link_or_copy(const std::filesystem::path& from, const std::filesystem::path& to) {
  using std::filesystem::copy_options;
  constexpr copy_options kWhole = copy_options::recursive | copy_options::copy_symlinks | copy_options::skip_existing;
  std::error_code failed;
  std::filesystem::copy(from, to, kWhole | copy_options::create_hard_links, failed);
  if (failed) std::filesystem::copy(from, to, kWhole);
}

}  // namespace hydrostat::io
