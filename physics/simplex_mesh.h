#pragma once

#include "physics/obstacle.h"

namespace hydrostat::physics {

/// A mesh of tets, in 2D of triangles.
template <int Dim>
struct SimplexMeshOf {
  PointsOf<Dim> nodes;                                    // [m] Dim x N, each of them in some simplex
  Eigen::Matrix<int, Dim + 1, Eigen::Dynamic> simplices;  // Dim + 1 x T, of positive volume
};

/// A box of `size` [m] about the origin, `cells` (> 0) along each axis: five tets a cell (two triangles), neighbours mirrored.
template <int Dim>
SimplexMeshOf<Dim> mesh_of_box(const VectorOf<Dim>& size, const Eigen::Matrix<int, Dim, 1>& cells);

/// The lattice of such a box, its cells whole: bit d of a node's number in its cell is its coordinate d.
template <int Dim>
struct BoxMeshOf {
  PointsOf<Dim> nodes;                                   // [m] Dim x N
  Eigen::Matrix<int, (1 << Dim), Eigen::Dynamic> boxes;  // 2^Dim x C
};
template <int Dim>
BoxMeshOf<Dim> lattice_of_box(const VectorOf<Dim>& size, const Eigen::Matrix<int, Dim, 1>& cells);

/// A ball (disc) about the origin with `cells` (> 1) from side to side. Its nodes lie on spheres; the outermost is a little
/// larger than the ball, so that the volume is the ball's.
template <int Dim>
SimplexMeshOf<Dim> mesh_of_ball(double diameter, int cells);

/// Every simplex cut into parts^Dim, of Dim! shapes at most; neighbours fit.
/// Source: Edelsbrunner, Grayson, "Edgewise subdivision of a simplex", Discrete & Computational Geometry 24, 2000.
template <int Dim>
SimplexMeshOf<Dim> refined(const SimplexMeshOf<Dim>& mesh, int parts);

/// A regular tetrahedron (triangle) of edge length `size` [m] on its side, its middle in the origin.
template <int Dim>
SimplexMeshOf<Dim> mesh_of_regular_simplex(double size, int parts);

/// A pyramid (triangle) that fills a box of `size` [m] about the origin: a rectangle below, its apex above the middle.
template <int Dim>
SimplexMeshOf<Dim> mesh_of_pyramid(const VectorOf<Dim>& size, int parts);

/// What lies inside a closed surface: a lattice of spacing `cell` [m] at most, fitted to the surface's box, whose nodes near the
/// surface are moved onto it and whose other simplices are cut by it. In 2D the surface's corners are nodes; in 3D pointed
/// edges are cut off by less than a cell. Parts thinner than a cell may be lost. Empty if all is.
/// Source of the order of snapping and cutting: Labelle, Shewchuk, "Isosurface stuffing", SIGGRAPH 2007. Departs from it in the
/// lattice, boxes of five tets, and thus has no bound on angles.
template <int Dim>
SimplexMeshOf<Dim> mesh_inside(const ClosedMeshOf<Dim>& surface, double cell);

template <int Dim>
double volume(const SimplexMeshOf<Dim>& mesh);
/// Every edge once, lower node first, in lexicographic order: 2 x E.
template <int Dim>
Eigen::Matrix2Xi edges_of(const SimplexMeshOf<Dim>& mesh);
/// Of each simplex: its volume over that of a regular one with the same mean squared edge, 1 at best; T.
template <int Dim>
Eigen::VectorXd shape_qualities(const SimplexMeshOf<Dim>& mesh);

}  // namespace hydrostat::physics
