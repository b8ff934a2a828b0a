#pragma once

#include <Eigen/Geometry>
#include <array>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "io/drawn_normals.h"

namespace hydrostat::io {

/// A skin as Wavefront OBJ text: its vertices that triangles draw, each once, in the skin's order, with one `usemtl` a part.
/// What stays the same from frame to frame is made once.
class ObjSkin {
 public:
  /// bind_pose: [m] 3 x V; plain_colour: linear red, green, blue, alpha of parts without material, which are called `name`.
  ObjSkin(std::vector<Appearance::Part> parts, const std::vector<Material>& materials, const Eigen::Matrix3Xd& bind_pose,
          const std::string& name, const std::array<double, 4>& plain_colour);

  /// Of the skin, ascending: vertex n of the file, counted from 0, is vertices()[n].
  const Eigen::VectorXi& vertices() const { return vertices_; }

  /// The skin at `positions` [m], 3 x V, turned as a whole by `turn`, with its true normals there: edges that are hard in
  /// the bind pose stay hard, flat parts have those of their triangles. Positions and normals are float32, as short as reads
  /// back the same. `material_file`: name of the file that holds material_text(), beside it.
  std::string text(const Eigen::Matrix3Xd& positions, const Eigen::Quaterniond& turn,
                   const std::string& material_file) const;

  /// Names, base colours (`Kd`, linear) and opacities (`d`) for an MTL file; no textures.
  const std::string& material_text() const { return material_text_; }

 private:
  std::vector<std::string> name_materials(const std::vector<Material>& materials, const std::string& name,
                                          const std::array<double, 4>& plain_colour);
  void add_part(std::size_t p, const std::vector<Material>& materials, const std::string& material,
                const std::vector<int>& numbers);

  std::vector<Appearance::Part> parts_;
  DrawnNormals normals_;
  Eigen::VectorXi vertices_;
  std::string places_, faces_;  // `vt`; `usemtl`, `s` and `f`
  int place_count_ = 0, normal_count_ = 0;
  std::string material_text_;
};

/// Writes one OBJ file a frame, <name>_0001.obj and so on, and <name>.mtl into a directory, which takes the place of the old
/// one when it is whole, and has its other files. text_at: of frames from 0 on, which name the file <name>.mtl. Throws Error where that cannot be.
void write_obj_frames(const std::filesystem::path& directory, const std::string& name, Eigen::Index frames,
                      const std::function<std::string(Eigen::Index)>& text_at, const std::string& material_text);

/// Throws Error where write_obj_frames may not replace or cannot make the directory: it holds anything but its frames, or is a file.
void refuse_obj_frames(const std::filesystem::path& directory, const std::string& name);

/// Gives `to` all that lies in a directory and has no name that write_obj_frames gives, as link_or_copy does; `to` is made where that is
/// anything. Throws std::filesystem::filesystem_error.
void keep_others_than_obj_frames(const std::filesystem::path& directory, const std::string& name, const std::filesystem::path& to);
/// Removes what has such a name, and the directory where that was all; a symbolic link alone where it is one. Throws likewise.
void remove_obj_frames(const std::filesystem::path& directory, const std::string& name);

}  // namespace hydrostat::io
