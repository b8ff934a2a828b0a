#pragma once

#include <string_view>

namespace hydrostat::io {

/// Script and style of the report page, bundled at build time from io/viewer and held in the library.
std::string_view viewer_script();
std::string_view viewer_style();

}  // namespace hydrostat::io
