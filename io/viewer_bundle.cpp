#include "io/viewer_bundle.h"

// The assembler copies the files in; a literal of a megabyte would cost the compiler minutes.
asm(".section .rodata\n"
    ".global hydrostat_viewer_script, hydrostat_viewer_script_end, hydrostat_viewer_style, hydrostat_viewer_style_end\n"
    "hydrostat_viewer_script:\n"
    ".incbin \"" HYDROSTAT_VIEWER_JS
    "\"\n"
    "hydrostat_viewer_script_end:\n"
    "hydrostat_viewer_style:\n"
    ".incbin \"" HYDROSTAT_VIEWER_CSS
    "\"\n"
    "hydrostat_viewer_style_end:\n"
    ".previous\n");

extern "C" {
extern const char hydrostat_viewer_script[], hydrostat_viewer_script_end[];
extern const char hydrostat_viewer_style[], hydrostat_viewer_style_end[];
}

namespace hydrostat::io {

std::string_view viewer_script() { return {hydrostat_viewer_script, hydrostat_viewer_script_end}; }
std::string_view viewer_style() { return {hydrostat_viewer_style, hydrostat_viewer_style_end}; }

}  // namespace hydrostat::io
