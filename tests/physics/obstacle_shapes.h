#pragma once

#include <cmath>

#include "tests/physics/lattice_scene.h"

namespace hydrostat::physics {

/// The surface of a body as a closed mesh; `warp` moves its nodes.
template <int Dim>
ClosedMeshOf<Dim> mesh_of(
    const BodyOf<Dim>& body,
    const std::function<VectorOf<Dim>(const VectorOf<Dim>&)>& warp = [](const VectorOf<Dim>& x) { return x; }) {
  SceneOf<Dim> scene = scene_of(body, {});
  touch_with_whole_surface(scene);
  PointsOf<Dim> vertices(Dim, scene.contact_points.count());
  for (int p = 0; p < scene.contact_points.count(); ++p) vertices.col(p) = warp(scene.contact_points.of(body.rest, p));
  return ClosedMeshOf<Dim>(vertices, scene.contact_faces);
}

/// A box about the origin as a mesh, three cells along every side.
template <int Dim>
ClosedMeshOf<Dim> box_mesh(const VectorOf<Dim>& half_extents) {
  return mesh_of<Dim>(bar<Dim>(3, 3, 3, 1.0),
                      [&](const VectorOf<Dim>& x) -> VectorOf<Dim> { return (x.array() / 1.5 - 1) * half_extents.array(); });
}

/// A cube of cells bent into a ball or disc about the origin.
template <int Dim>
VectorOf<Dim> round_off(const VectorOf<Dim>& cube, double radius) {
  const double largest = cube.cwiseAbs().maxCoeff();
  return largest == 0 ? cube : VectorOf<Dim>(cube * (radius * largest / cube.norm()));
}

template <int Dim>
ClosedMeshOf<Dim> ball_mesh(int cells, double radius) {
  return mesh_of<Dim>(bar<Dim>(cells, cells, cells, 2.0 / cells),
                      [&](const VectorOf<Dim>& x) -> VectorOf<Dim> { return round_off<Dim>(x.array() - 1, radius); });
}

/// A soft ball or disc of `radius` about the origin, `cells` across.
template <int Dim>
BodyOf<Dim> ball(int cells, double radius, const Material& material) {
  Lattice<Dim> lattice = make_lattice<Dim>(cells, cells, cells, 2.0 / cells);
  for (Eigen::Index i = 0; i < lattice.nodes.cols(); ++i) {
    lattice.nodes.col(i) = round_off<Dim>(lattice.nodes.col(i).array() - 1, radius);
  }
  return body_of(lattice, material);
}

}  // namespace hydrostat::physics
