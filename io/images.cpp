#include "io/images.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

namespace hydrostat::io {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLargestImage = std::size_t{64} << 20;   // [bytes]
constexpr std::size_t kLargestTotal = std::size_t{256} << 20;  // [bytes]; the result is one file
constexpr std::string_view kPngStart{"\x89PNG\r\n\x1a\n", 8};

std::uint32_t big_endian(std::string_view bytes, std::size_t at, std::size_t width) {
  std::uint32_t number = 0;
  for (std::size_t i = at; i < at + width; ++i) number = number << 8 | static_cast<unsigned char>(bytes[i]);
  return number;
}

/// Chunks of length, type, data and checksum, from IHDR to IEND.
bool is_png(std::string_view bytes) {
  if (!bytes.starts_with(kPngStart)) return false;
  std::size_t at = kPngStart.size();
  bool is_first = true;
  while (bytes.size() - at >= 12) {
    const std::size_t length = big_endian(bytes, at, 4);
    const std::string_view type = bytes.substr(at + 4, 4);
    if (length > bytes.size() - at - 12) return false;
    if (is_first &&
        (type != "IHDR" || length != 13 || big_endian(bytes, at + 8, 4) == 0 || big_endian(bytes, at + 12, 4) == 0))
      return false;
    if (type == "IEND") return true;
    is_first = false;
    at += length + 12;
  }
  return false;
}

/// Segments of marker and length up to the start of the scan, a frame header among them, and the end marker behind.
bool is_jpeg(std::string_view bytes) {
  if (!bytes.starts_with("\xff\xd8\xff")) return false;
  bool has_size = false;
  std::size_t at = 2;
  while (bytes.size() - at >= 4 && bytes[at] == '\xff') {
    const unsigned marker = static_cast<unsigned char>(bytes[at + 1]);
    if (marker == 0xff) {  // fill
      ++at;
      continue;
    }
    if (marker == 0xda) return has_size && bytes.find("\xff\xd9", at) != std::string_view::npos;
    const std::size_t length = big_endian(bytes, at + 2, 2);
    if (length < 2 || length > bytes.size() - at - 2) return false;
    const bool is_frame = marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
    if (is_frame && length >= 8) has_size = big_endian(bytes, at + 5, 2) > 0 && big_endian(bytes, at + 7, 2) > 0;
    at += length + 2;
  }
  return false;
}

/// The file in the folder or below it that is meant, or nothing.
std::optional<fs::path> find_in(const fs::path& folder, const std::vector<fs::path>& candidates) {
  std::error_code failure;
  const fs::path home = fs::canonical(folder, failure);
  if (failure) return std::nullopt;
  for (const fs::path& candidate : candidates) {
    if (candidate.empty() || candidate.is_absolute()) continue;
    const fs::path place = fs::canonical(home / candidate, failure);  // links and ".." followed
    if (failure) continue;
    const auto [in_home, in_place] = std::mismatch(home.begin(), home.end(), place.begin(), place.end());
    if (in_home == home.end() && fs::is_regular_file(place, failure)) return place;
  }
  return std::nullopt;
}

std::vector<fs::path> candidates_of(const Scene& scene, const std::string& reference, const fs::path& clip) {
  if (scene.format == "gltf") return {reference};
  std::string path = reference;
  std::replace(path.begin(), path.end(), '\\', '/');
  if (path.starts_with("file://")) path.erase(0, 7);
  const fs::path name = fs::path(path).filename();
  return {path, name, fs::path("textures") / name, fs::path(clip.stem().string() + ".fbm") / name};
}

/// Bytes of a file, or nothing where it cannot be read or is too large.
std::optional<std::string> bytes_of(const fs::path& file) {
  const int descriptor = open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
  if (descriptor < 0) return std::nullopt;
  struct stat told {};
  std::optional<std::string> bytes;
  if (fstat(descriptor, &told) == 0 && S_ISREG(told.st_mode) && told.st_size >= 0 &&
      static_cast<std::size_t>(told.st_size) <= kLargestImage) {
    bytes.emplace(static_cast<std::size_t>(told.st_size), '\0');
    std::size_t done = 0;
    while (done < bytes->size()) {
      const ssize_t got = read(descriptor, bytes->data() + done, bytes->size() - done);
      if (got <= 0) break;
      done += static_cast<std::size_t>(got);
    }
    bytes->resize(done);
  }
  close(descriptor);
  return bytes;
}

std::string name_of(const Image& image, std::size_t index) {
  if (!image.file.empty()) return image.file.size() > 200 ? image.file.substr(0, 200) + "..." : image.file;
  return image.name.empty() ? std::to_string(index) : image.name;
}

/// Fills in an image's bytes. What is wrong with it and how to mend that, or nothing.
std::string settle(Image& image, const Scene& scene, const fs::path& clip) {
  if (!image.file.empty()) {
    const std::optional<fs::path> place = find_in(clip.parent_path(), candidates_of(scene, image.file, clip));
    if (!place) return "is not in the clip's folder; put it there";
    std::optional<std::string> bytes = bytes_of(*place);
    if (!bytes) return "cannot be read, or is larger than 64 MiB; give a readable, smaller one";
    image.bytes = std::move(*bytes);
  }
  if (image.bytes.size() > kLargestImage) return "is larger than 64 MiB; give a smaller one";
  if (image_type(image.bytes).empty()) return "is no whole PNG or JPEG image; convert it to one of these";
  return {};
}

std::vector<bool> worn_images(const Scene& scene) {
  std::vector<bool> worn(scene.images.size(), false);
  for (const SceneMesh& mesh : scene.meshes) {
    for (const int index : mesh.triangle_materials) {
      if (index < 0) continue;
      for (const TextureMap* map : maps_of(scene.materials[static_cast<std::size_t>(index)])) {
        if (map->image >= 0) worn[static_cast<std::size_t>(map->image)] = true;
      }
    }
  }
  return worn;
}

}  // namespace

std::string image_type(const std::string& bytes) { return is_png(bytes) ? "image/png" : is_jpeg(bytes) ? "image/jpeg" : ""; }

void settle_images(Scene& scene, const std::string& path) {
  const std::vector<bool> worn = worn_images(scene);
  std::vector<bool> sound(scene.images.size(), false);
  std::size_t total = 0;
  for (std::size_t i = 0; i < scene.images.size(); ++i) {
    Image& image = scene.images[i];
    if (!worn[i]) continue;
    std::string wrong = settle(image, scene, fs::absolute(path));
    if (wrong.empty() && total + image.bytes.size() > kLargestTotal)
      wrong = "would make more than 256 MiB of them; give smaller ones";
    sound[i] = wrong.empty();
    if (sound[i]) total += image.bytes.size();
    if (!sound[i])
      scene.warnings.push_back("Texture '" + name_of(image, i) + "' " + wrong +
                               ". It is left out, and its material's colour stays.");
    if (!sound[i]) image.bytes.clear();
  }
  for (Material& material : scene.materials) {
    for (TextureMap* map : maps_of(material)) {
      if (map->image >= 0 && !sound[static_cast<std::size_t>(map->image)]) *map = {};
    }
    // glTF's colour is a factor on the image, that of the others its stand-in.
    if (scene.format != "gltf" && material.base_colour_map.image >= 0) material.base_colour.head<3>().setOnes();
  }
}

}  // namespace hydrostat::io
