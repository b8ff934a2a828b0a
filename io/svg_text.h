#pragma once

#include <string>

namespace hydrostat::io {

/// Text for the inside of an element or of a quoted attribute of SVG and HTML: < > & " as entities.
std::string escaped(const std::string& text);

/// A number as short as `digits` significant ones make it: 0.025, 1e-09.
std::string short_number(double value, int digits = 3);

}  // namespace hydrostat::io
