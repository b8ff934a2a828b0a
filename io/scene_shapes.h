#pragma once

#include <string>
#include <vector>

#include "io/toml_reader.h"
#include "physics/element_block.h"
#include "physics/simplex_mesh.h"

namespace hydrostat::io {

/// Of an angle in degrees.
constexpr double radians(double degrees) { return degrees * 3.14159265358979323846 / 180; }

/// The turn of `rotation_deg`: in 2D an angle, in 3D about x, then y, then z of the world; none where it is missing.
template <int Dim>
physics::BlockOf<Dim> rotation_of(const TomlReader& table);

/// A closed surface: `file` with `scale`, or `vertices_m` with `triangles`, in 3D, `outline_m` in 2D; `warnings` receives what of it was mended. Throws Error where it is
/// not closed or cuts itself.
template <int Dim>
physics::ClosedMeshOf<Dim> surface_of(const TomlReader& table, std::vector<std::string>& warnings);

/// The rest shape of [body] in its own frame, without materials. `shape` and `element` become their names ("sphere", "tet"),
/// `cells` the nodes of the boxes that its tets or triangles are cut from (2^Dim x C, as ElementMesh has them; empty where there are
/// none), `warnings` receives what the mesh departs in. Throws Error where the shape is not told as it must be, gives slivers or falls
/// into pieces.
template <int Dim>
physics::ElementMesh<Dim> body_mesh(const TomlReader& body, std::string& shape, std::string& element,
                                    Eigen::MatrixXi& cells, std::vector<std::string>& warnings);

/// "from [-1, 0] to [1, 2]": where points lie, Dim x P [m], P > 0.
template <int Dim>
std::string extent_in_words(const physics::PointsOf<Dim>& points);

/// Which points (Dim x P, in the body's own frame) lie in the part that `table` names: `box_m`, or `normal` with `offset_m`; all
/// where it names none. Throws Error where no point does.
template <int Dim>
std::vector<char> points_within(const TomlReader& table, const physics::PointsOf<Dim>& points);

}  // namespace hydrostat::io
