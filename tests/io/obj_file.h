#pragma once

#include <Eigen/Core>
#include <array>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

/// Wavefront OBJ as other programs read it.
namespace hydrostat::io::obj_file {

struct ObjFile {
  struct Corner {
    int vertex = 0, place = 0, normal = 0;  // counted from 0; -1: not told
  };
  struct Group {
    std::string material;
    bool is_smooth = false;
    std::vector<std::array<Corner, 3>> faces;
  };
  std::vector<Eigen::Vector3f> vertices, normals;
  std::vector<Eigen::Vector2f> places;
  std::vector<Group> groups;
  std::string material_file;

  std::vector<std::array<Corner, 3>> faces() const {
    std::vector<std::array<Corner, 3>> all;
    for (const Group& group : groups) all.insert(all.end(), group.faces.begin(), group.faces.end());
    return all;
  }
};

inline ObjFile::Corner parse_corner(const std::string& text) {
  const std::size_t first = text.find('/'), second = text.find('/', first + 1);
  const std::string place = text.substr(first + 1, second - first - 1);
  return {std::stoi(text.substr(0, first)) - 1, place.empty() ? -1 : std::stoi(place) - 1,
          std::stoi(text.substr(second + 1)) - 1};
}

inline ObjFile parse_obj(const std::string& text) {
  ObjFile file;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string key, a, b, c;
    words >> key >> a >> b >> c;
    const auto numbers = [&] { return Eigen::Vector3f(std::stof(a), std::stof(b), std::stof(c)); };
    if (key == "v") file.vertices.push_back(numbers());
    if (key == "vn") file.normals.push_back(numbers());
    if (key == "vt") file.places.emplace_back(std::stof(a), std::stof(b));
    if (key == "mtllib") file.material_file = a;
    if (key == "usemtl") file.groups.push_back({a, false, {}});
    if (key == "s") file.groups.back().is_smooth = a == "1";
    if (key == "f") file.groups.back().faces.push_back({parse_corner(a), parse_corner(b), parse_corner(c)});
    if (key == "o" || key == "g") throw std::runtime_error("objects and groups are torn apart by some readers");
  }
  return file;
}

}  // namespace hydrostat::io::obj_file
