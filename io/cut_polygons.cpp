#include "io/cut_polygons.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>

namespace hydrostat::io {
namespace {

constexpr unsigned kMostCorners = 200;

/// The corners in the plane that fits them best, so that they run to the left.
Eigen::Matrix2Xd flattened(const Eigen::Matrix3Xd& corners) {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  const Eigen::Vector3d first = corners.col(0);
  for (Eigen::Index i = 0; i < corners.cols(); ++i)
    normal += (corners.col(i) - first).cross(corners.col((i + 1) % corners.cols()) - first);
  if (!(normal.norm() > 0) || !normal.allFinite()) normal = Eigen::Vector3d::UnitZ();
  normal.normalize();
  const Eigen::Vector3d x = normal.unitOrthogonal(), y = normal.cross(x);
  Eigen::Matrix2Xd flat(2, corners.cols());
  flat.row(0) = x.transpose() * (corners.colwise() - first);
  flat.row(1) = y.transpose() * (corners.colwise() - first);
  return flat;
}

/// Twice the area to the left of a, b, c.
double area(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

class EarCutter {
 public:
  explicit EarCutter(Eigen::Matrix2Xd points) : points_(std::move(points)), count_(static_cast<int>(points_.cols())) {
    next_.resize(static_cast<std::size_t>(count_));
    last_ = next_;
    is_cut_.assign(next_.size(), false);
    for (int i = 0; i < count_; ++i) {
      next_[place(i)] = (i + 1) % count_;
      last_[place(i)] = (i + count_ - 1) % count_;
    }
    make_grid();
  }

  std::vector<Eigen::Vector3i> cut() {
    std::vector<Eigen::Vector3i> triangles;
    int here = 0;
    for (int left = count_, without_ear = 0; left > 2;) {
      // Of what crosses itself, or has no area, some corner is cut off all the same.
      if (!is_ear(here) && ++without_ear <= left) {
        here = next_[place(here)];
        continue;
      }
      const int before = last_[place(here)], behind = next_[place(here)];
      triangles.emplace_back(before, here, behind);
      next_[place(before)] = behind;
      last_[place(behind)] = before;
      is_cut_[place(here)] = true;
      here = next_[place(behind)];
      without_ear = 0;
      --left;
    }
    return triangles;
  }

 private:
  static std::size_t place(int index) { return static_cast<std::size_t>(index); }
  Eigen::Vector2d at(int index) const { return points_.col(index); }

  double turn(int i) const { return area(at(last_[place(i)]), at(i), at(next_[place(i)])); }

  /// Only corners that turn to the right can lie in an ear, and those turn so from the start.
  void make_grid() {
    low_ = points_.rowwise().minCoeff();
    const Eigen::Vector2d extent = points_.rowwise().maxCoeff() - low_;
    side_ = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(count_))));
    step_ = extent.cwiseMax(1e-300) / side_;
    cells_.resize(place(side_ * side_));
    for (int i = 0; i < count_; ++i) {
      if (turn(i) <= 0) cells_[place(cell(at(i).x(), 0) + side_ * cell(at(i).y(), 1))].push_back(i);
    }
  }
  int cell(double value, int axis) const {
    const double along = (value - low_[axis]) / step_[axis];
    return std::isfinite(along) ? static_cast<int>(std::clamp(along, 0.0, side_ - 1.0)) : 0;
  }

  bool is_ear(int i) const {
    const Eigen::Vector2d a = at(last_[place(i)]), b = at(i), c = at(next_[place(i)]);
    if (area(a, b, c) <= 0) return false;
    const Eigen::Vector2d least = a.cwiseMin(b).cwiseMin(c), most = a.cwiseMax(b).cwiseMax(c);
    for (int row = cell(least.y(), 1); row <= cell(most.y(), 1); ++row) {
      for (int column = cell(least.x(), 0); column <= cell(most.x(), 0); ++column) {
        for (const int other : cells_[place(column + side_ * row)]) {
          const Eigen::Vector2d point = at(other);
          const bool is_corner = point == a || point == b || point == c;
          if (!is_cut_[place(other)] && !is_corner && area(a, b, point) >= 0 && area(b, c, point) >= 0 &&
              area(c, a, point) >= 0)
            return false;
        }
      }
    }
    return true;
  }

  const Eigen::Matrix2Xd points_;
  const int count_;
  std::vector<int> next_, last_;
  std::vector<bool> is_cut_;
  Eigen::Vector2d low_, step_;
  int side_ = 1;
  std::vector<std::vector<int>> cells_;
};

/// Cuts a mesh's large polygons; the others stay for assimp.
void cut_large_polygons(aiMesh& mesh) {
  const auto is_large = [](const aiFace& face) { return face.mNumIndices > kMostCorners; };
  if (std::none_of(mesh.mFaces, mesh.mFaces + mesh.mNumFaces, is_large)) return;
  std::vector<aiFace> faces;
  for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
    const aiFace& face = mesh.mFaces[f];
    if (!is_large(face)) {
      faces.push_back(face);
      continue;
    }
    Eigen::Matrix3Xd corners(3, face.mNumIndices);
    for (unsigned k = 0; k < face.mNumIndices; ++k) {
      const aiVector3D& at = mesh.mVertices[face.mIndices[k]];
      corners.col(k) << at.x, at.y, at.z;
    }
    for (const Eigen::Vector3i& triangle : cut_polygon(corners)) {
      aiFace& cut = faces.emplace_back();
      cut.mNumIndices = 3;
      cut.mIndices = new unsigned[3];
      for (int k = 0; k < 3; ++k) cut.mIndices[k] = face.mIndices[triangle[k]];
    }
  }
  delete[] mesh.mFaces;
  mesh.mNumFaces = static_cast<unsigned>(faces.size());
  mesh.mFaces = new aiFace[faces.size()];
  std::copy(faces.begin(), faces.end(), mesh.mFaces);
  mesh.mPrimitiveTypes |= aiPrimitiveType_TRIANGLE;
  // assimp asserts that it has something to do.
  if (std::none_of(faces.begin(), faces.end(), [](const aiFace& face) { return face.mNumIndices > 3; }))
    mesh.mPrimitiveTypes &= ~static_cast<unsigned>(aiPrimitiveType_POLYGON);
}

}  // namespace

std::vector<Eigen::Vector3i> cut_polygon(const Eigen::Matrix3Xd& corners) { return EarCutter(flattened(corners)).cut(); }

const aiScene* read_in_triangles(Assimp::Importer& importer, const std::string& path, unsigned flags) {
  const aiScene* scene = importer.ReadFile(path, flags);
  if (scene == nullptr) return nullptr;
  // The importer keeps its scene to itself, but means it to be worked on.
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) cut_large_polygons(*scene->mMeshes[m]);
  return importer.ApplyPostProcessing(aiProcess_Triangulate | aiProcess_SortByPType);
}

}  // namespace hydrostat::io
