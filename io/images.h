#pragma once

#include <string>

#include "io/scene.h"

namespace hydrostat::io {

/// Reads the images that the scene's materials name but the clip file does not hold, from the folder of the clip and those
/// below it, never from elsewhere. Paths in FBX and Collada are often those of the artist's machine: there their last part
/// is looked for too, beside the clip, in `textures` and in `<clip>.fbm`. What is missing, neither PNG nor JPEG, damaged or
/// above 64 MiB is left out, with one warning for each; the material's colour stays. Images that no mesh wears are dropped.
void settle_images(Scene& scene, const std::string& path);

/// "image/png" or "image/jpeg" for what is whole as far as its structure tells, otherwise an empty text.
/// Sources: RFC 2083, section 3; ITU-T T.81, annex B.
std::string image_type(const std::string& bytes);

}  // namespace hydrostat::io
