#include "io/obj_out.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <map>
#include <set>

#include "io/link_or_copy.h"
#include "io/writable.h"
#include "io/write_error.h"
#include "io/write_file.h"

namespace hydrostat::io {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLeastDigits = 4;  // of a frame's number

void put_number(std::string& text, float number) {
  std::array<char, 32> digits;
  text.append(digits.data(), std::to_chars(digits.begin(), digits.end(), number).ptr);
}

/// "v 1 2 3\n"
template <typename Numbers>
void put_line(std::string& text, const char* key, const Numbers& numbers) {
  text += key;
  for (const double number : numbers) {
    text += ' ';
    put_number(text, static_cast<float>(number));
  }
  text += '\n';
}

/// Of the triangle's side that its corners go round counterclockwise; up where it has no area.
Eigen::Vector3d triangle_normal(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const Eigen::Vector3d area = (b - a).cross(c - a);
  const double size = area.norm();
  return size > 0 ? Eigen::Vector3d(area / size) : Eigen::Vector3d::UnitY();
}

/// Many readers end a name at the first blank, and a line break would end it for all.
std::string word_of(std::string name) {
  for (char& letter : name) {
    if (static_cast<unsigned char>(letter) <= ' ' || letter == '\x7f') letter = '_';
  }
  return name.empty() ? "material" : name;
}

/// The places in images of the set that the colour's image goes by; 2 x 0 where there are none.
Eigen::Matrix2Xd places_of(const Appearance::Part& part, const std::vector<Material>& materials) {
  if (part.uvs.empty()) return {};
  const int wanted = part.material < 0 ? 0 : materials[static_cast<std::size_t>(part.material)].base_colour_map.uv_set;
  const auto set = static_cast<std::size_t>(std::max(0, wanted));
  return part.uvs[set < part.uvs.size() ? set : 0];
}

std::string number_of(Eigen::Index frame, std::size_t digits) {
  const std::string number = std::to_string(frame + 1);
  return std::string(digits - std::min(digits, number.size()), '0') + number;
}

/// Whether write_obj_frames wrote it.
bool is_of_frames(const std::string& file, const std::string& name) {
  if (file == name + ".mtl") return true;
  const std::string begin = name + "_", end = ".obj";
  if (!file.starts_with(begin) || !file.ends_with(end) || file.size() < begin.size() + end.size() + kLeastDigits) return false;
  return std::all_of(file.begin() + static_cast<std::ptrdiff_t>(begin.size()), file.end() - static_cast<std::ptrdiff_t>(end.size()),
                     [](unsigned char letter) { return std::isdigit(letter) != 0; });
}

WriteError directory_error(const fs::path& directory, const std::error_code& failure) {
  return {directory.string(), "", "the directory cannot be written: " + failure.message(),
          mend_of_write_error(failure.value())};
}

}  // namespace

ObjSkin::ObjSkin(std::vector<Appearance::Part> parts, const std::vector<Material>& materials,
                 const Eigen::Matrix3Xd& bind_pose, const std::string& name, const std::array<double, 4>& plain_colour)
    : parts_(std::move(parts)), normals_(parts_, bind_pose), normal_count_(static_cast<int>(normals_.count())) {
  std::vector<int> numbers(static_cast<std::size_t>(bind_pose.cols()), 0);  // of each vertex in the file; 0: not drawn
  for (const Appearance::Part& part : parts_) {
    for (const int corner : part.triangles.reshaped()) numbers[static_cast<std::size_t>(part.vertices[corner])] = 1;
  }
  std::vector<int> drawn;
  for (std::size_t v = 0; v < numbers.size(); ++v) {
    if (numbers[v] == 0) continue;
    drawn.push_back(static_cast<int>(v));
    numbers[v] = static_cast<int>(drawn.size());
  }
  vertices_ = Eigen::Map<const Eigen::VectorXi>(drawn.data(), static_cast<Eigen::Index>(drawn.size()));
  const std::vector<std::string> names = name_materials(materials, name, plain_colour);
  for (std::size_t p = 0; p < parts_.size(); ++p) add_part(p, materials, names[p], numbers);
}

std::vector<std::string> ObjSkin::name_materials(const std::vector<Material>& materials, const std::string& name,
                                                 const std::array<double, 4>& plain_colour) {
  std::vector<std::string> of_parts;
  std::map<int, std::string> names;
  std::set<std::string> taken;
  for (const Appearance::Part& part : parts_) {
    const auto [place, is_new] = names.try_emplace(part.material);
    if (is_new) {
      const bool is_plain = part.material < 0;
      const Material material = is_plain ? Material() : materials[static_cast<std::size_t>(part.material)];
      const std::string word = word_of(is_plain ? name : material.name);
      place->second = word;
      for (int k = 2; !taken.insert(place->second).second; ++k) place->second = word + "_" + std::to_string(k);
      // Where the vertices have colours these are factors, which OBJ does not hold.
      Eigen::Vector4d colour = material.base_colour;
      if (is_plain && part.colours.size() == 0) colour = Eigen::Map<const Eigen::Vector4d>(plain_colour.data());
      const bool is_opaque = !is_plain && material.alpha_mode != AlphaMode::kBlend;
      material_text_ += "newmtl " + place->second + "\n";
      put_line(material_text_, "Kd", colour.head<3>());
      put_line(material_text_, "d", std::array{is_opaque ? 1.0 : colour[3]});
    }
    of_parts.push_back(place->second);
  }
  return of_parts;
}

void ObjSkin::add_part(std::size_t p, const std::vector<Material>& materials, const std::string& material,
                       const std::vector<int>& numbers) {
  const Appearance::Part& part = parts_[p];
  const Eigen::VectorXi& normals = normals_.of_parts()[p];
  const Eigen::Matrix2Xd places = places_of(part, materials);
  for (const auto place : places.colwise()) put_line(places_, "vt", std::array{place.x(), 1 - place.y()});  // v upward
  const bool is_flat = normals.size() == 0;
  faces_ += "usemtl " + material + (is_flat ? "\ns off\n" : "\ns 1\n");
  for (const auto corners : part.triangles.colwise()) {
    if (is_flat) ++normal_count_;
    faces_ += 'f';
    for (const int corner : corners) {
      const int normal = is_flat ? normal_count_ : normals[corner] + 1;
      const std::string place = places.cols() > 0 ? std::to_string(place_count_ + corner + 1) : "";
      faces_ += ' ' + std::to_string(numbers[static_cast<std::size_t>(part.vertices[corner])]) + '/' + place + '/' +
                std::to_string(normal);
    }
    faces_ += '\n';
  }
  place_count_ += static_cast<int>(places.cols());
}

std::string ObjSkin::text(const Eigen::Matrix3Xd& positions, const Eigen::Quaterniond& turn,
                          const std::string& material_file) const {
  std::string text = "# hydrostat: metres, y up\nmtllib " + material_file + "\n";
  for (const int vertex : vertices_) put_line(text, "v", positions.col(vertex));
  const Eigen::Matrix3Xd normals = normals_.at(positions, turn);
  for (const auto normal : normals.colwise()) put_line(text, "vn", normal);
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    if (normals_.of_parts()[p].size() > 0) continue;
    const Appearance::Part& flat = parts_[p];
    for (const auto corners : flat.triangles.colwise()) {
      const auto corner = [&](int k) -> Eigen::Vector3d { return positions.col(flat.vertices[corners[k]]); };
      put_line(text, "vn", triangle_normal(corner(0), corner(1), corner(2)));
    }
  }
  return text + places_ + faces_;
}

void refuse_obj_frames(const fs::path& directory, const std::string& name) {
  std::error_code ignored;
  if (!fs::exists(directory, ignored)) return refuse_unwritable(directory.parent_path());
  if (!fs::is_directory(directory, ignored)) {
    throw Error(directory.string(), "--export obj", "is a file where a directory belongs", "Move the file away.");
  }
  for (const fs::directory_entry& entry : fs::directory_iterator(directory, ignored)) {
    if (is_of_frames(entry.path().filename().string(), name)) continue;
    throw Error(directory.string(), "--export obj", "holds '" + entry.path().filename().string() + "', which is none of its frames",
                "Move it away, or give another file.");
  }
  refuse_unwritable(directory.parent_path());
}

void keep_others_than_obj_frames(const fs::path& directory, const std::string& name, const fs::path& to) {
  if (!fs::is_directory(fs::symlink_status(directory))) return;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory)) {
    const fs::path file = entry.path().filename();
    if (is_of_frames(file.string(), name)) continue;
    fs::create_directories(to);
    link_or_copy(entry.path(), to / file);
  }
}

void remove_obj_frames(const fs::path& directory, const std::string& name) {
  if (!fs::is_directory(fs::symlink_status(directory))) {
    fs::remove(directory);
    return;
  }
  const std::vector<fs::directory_entry> entries(fs::directory_iterator(directory), fs::directory_iterator{});
  for (const fs::directory_entry& entry : entries) {
    if (is_of_frames(entry.path().filename().string(), name)) fs::remove_all(entry.path());
  }
  if (fs::is_empty(directory)) fs::remove(directory);
}

void write_obj_frames(const fs::path& directory, const std::string& name, Eigen::Index frames,
                      const std::function<std::string(Eigen::Index)>& text_at, const std::string& material_text) {
  const fs::path part = directory.string() + ".part";
  const std::size_t digits = std::max(kLeastDigits, std::to_string(frames).size());
  std::error_code ignored;
  try {
    fs::remove_all(part);
    write_file(part / (name + ".mtl"), material_text, directory / (name + ".mtl"));
    for (Eigen::Index f = 0; f < frames; ++f) {
      const std::string file = name + "_" + number_of(f, digits) + ".obj";
      write_file(part / file, text_at(f), directory / file);
    }
    keep_others_than_obj_frames(directory, name, part);
    fs::remove_all(directory);
    fs::rename(part, directory);
  } catch (const fs::filesystem_error& failure) {
    fs::remove_all(part, ignored);
    throw directory_error(directory, failure.code());
  } catch (...) {
    fs::remove_all(part, ignored);
    throw;
  }
}

}  // namespace hydrostat::io
