#pragma once

#include <random>

#include "physics/element_body.h"
#include "physics/simplex_mesh.h"
#include "physics/tearing.h"

namespace hydrostat::physics {

/// A bar of 0.2 x 0.6 (x 0.2) m about the origin, upright; `cells` across it.
template <int Dim>
ElementMesh<Dim> bar_mesh(int cells, bool of_boxes, const ElementMaterial& material = {1000, 1e6, 0.4}) {
  VectorOf<Dim> size = VectorOf<Dim>::Constant(0.2);
  size[1] = 0.6;
  Eigen::Matrix<int, Dim, 1> counts = Eigen::Matrix<int, Dim, 1>::Constant(cells);
  counts[1] = 3 * cells;
  ElementMesh<Dim> mesh;
  if (of_boxes) {
    const BoxMeshOf<Dim> lattice = lattice_of_box<Dim>(size, counts);
    mesh = {lattice.nodes, lattice.boxes, {material}, {}};
  } else {
    const SimplexMeshOf<Dim> simplices = mesh_of_box<Dim>(size, counts);
    mesh = {simplices.nodes, simplices.simplices, {material}, {}};
  }
  mesh.fill = Eigen::VectorXd::Ones(mesh.nodes.cols());
  return mesh;
}

/// Of finite elements that are cut along planes.
template <int Dim>
FractureOf<Dim> fracture_of(const ElementMesh<Dim>& mesh, const std::vector<SeamOf<Dim>>& seams, double damping_time = 0) {
  FractureOf<Dim> fracture{seams, mesh, find_seam_faces(mesh, seams), {}, {}};
  fracture.make_body = [damping_time](const ElementMesh<Dim>& part) {
    return make_body<Dim>(part, ElementBodyOptions{ElasticLaw::kStableNeoHookean, 0, damping_time});
  };
  return fracture;
}

template <int Dim>
SeamOf<Dim> level_seam(double offset, double strength = 1e5) {
  SeamOf<Dim> seam;
  seam.offset = offset;
  seam.strength = strength;
  return seam;
}

template <int Dim>
PointsOf<Dim> random_points(unsigned seed, Eigen::Index count, double size) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-size, size);
  return PointsOf<Dim>::NullaryExpr(Dim, count, [&] { return uniform(random); });
}

}  // namespace hydrostat::physics
