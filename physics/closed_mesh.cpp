#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "physics/nearest_on_face.h"
#include "physics/obstacle.h"

namespace hydrostat::physics {
namespace {

constexpr int kFacesOfLeaf = 4;
constexpr int kDeepestTree = 64;

}  // namespace

template <int Dim>
ClosedMeshOf<Dim>::ClosedMeshOf(PointsOf<Dim> vertices, Faces faces)
    : vertices_(std::move(vertices)), faces_(std::move(faces)) {
  assert(broken_mesh_rule<Dim>(vertices_, faces_).empty());
  find_normals();
  order_.resize(static_cast<std::size_t>(faces_.cols()));
  std::iota(order_.begin(), order_.end(), 0);
  grow_tree(0, static_cast<int>(order_.size()));
}

template <int Dim>
void ClosedMeshOf<Dim>::find_normals() {
  const auto count = static_cast<int>(faces_.cols());
  face_normals_.resize(Dim, count);
  vertex_normals_ = PointsOf<Dim>::Zero(Dim, vertices_.cols());
  for (int f = 0; f < count; ++f) {
    face_normals_.col(f) = face_normal<Dim>(corners_of_face<Dim>(vertices_, faces_.col(f))).normalized();
    for (int k = 0; k < Dim; ++k) {
      double angle = 1;
      if constexpr (Dim == 3) {
        const VectorOf<Dim> here = vertices_.col(faces_(k, f));
        const VectorOf<Dim> one = vertices_.col(faces_((k + 1) % 3, f)) - here,
                            two = vertices_.col(faces_((k + 2) % 3, f)) - here;
        angle = std::atan2(one.cross(two).norm(), one.dot(two));
      }
      vertex_normals_.col(faces_(k, f)) += angle * face_normals_.col(f);
    }
  }
  vertex_normals_.colwise().normalize();
  if constexpr (Dim == 3) {
    std::map<std::pair<int, int>, int> face_of;  // of a directed edge
    for (int f = 0; f < count; ++f) {
      for (int k = 0; k < 3; ++k) face_of[{faces_(k, f), faces_((k + 1) % 3, f)}] = f;
    }
    edge_normals_.resize(Dim, 3 * count);
    for (int f = 0; f < count; ++f) {
      for (int k = 0; k < 3; ++k) {
        const int other = face_of.at({faces_((k + 1) % 3, f), faces_(k, f)});
        edge_normals_.col(3 * f + k) = face_normals_.col(f) + face_normals_.col(other);
      }
    }
  }
  std::vector<char> pointed(static_cast<std::size_t>(vertices_.cols()), 1);
  for (int f = 0; f < count; ++f) {
    for (int k = 0; k < Dim; ++k) {
      for (int other = 0; other < Dim; ++other) {
        const int v = faces_(k, f), w = faces_(other, f);
        const VectorOf<Dim> span = vertices_.col(w) - vertices_.col(v);
        if (w != v && vertex_normals_.col(v).dot(span) > -1e-9 * span.norm()) pointed[static_cast<std::size_t>(v)] = 0;
      }
    }
  }
  for (int v = 0; v < vertices_.cols(); ++v) {
    if (pointed[static_cast<std::size_t>(v)]) convex_vertices_.push_back(v);
  }
}

template <int Dim>
int ClosedMeshOf<Dim>::grow_tree(int begin, int end) {
  const auto at = static_cast<std::size_t>(boxes_.size());
  Box box{VectorOf<Dim>::Constant(std::numeric_limits<double>::infinity()), {}, -1, -1, begin, end};
  box.high = -box.low;
  for (int n = begin; n < end; ++n) {
    for (int k = 0; k < Dim; ++k) {
      const VectorOf<Dim> vertex = vertices_.col(faces_(k, order_[static_cast<std::size_t>(n)]));
      box.low = box.low.cwiseMin(vertex);
      box.high = box.high.cwiseMax(vertex);
    }
  }
  boxes_.push_back(box);
  if (end - begin > kFacesOfLeaf) {
    Eigen::Index axis;
    (box.high - box.low).maxCoeff(&axis);
    const int middle = (begin + end) / 2;
    const auto place = [&](int f) { return vertices_(axis, faces_.col(f)).sum(); };
    std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                     [&](int f, int g) { return std::pair(place(f), f) < std::pair(place(g), g); });
    const int left = grow_tree(begin, middle), right = grow_tree(middle, end);
    boxes_[at].left = left;
    boxes_[at].right = right;
  }
  return static_cast<int>(at);
}

template <int Dim>
void ClosedMeshOf<Dim>::consider(int face, const VectorOf<Dim>& point, Nearest& nearest) const {
  VectorOf<Dim> weights;
  const int feature = nearest_on_face<Dim>(point, corners_of_face<Dim>(vertices_, faces_.col(face)), weights);
  VectorOf<Dim> foot = VectorOf<Dim>::Zero();
  for (int k = 0; k < Dim; ++k) foot += weights[k] * vertices_.col(faces_(k, face));
  const double squared_distance = (point - foot).squaredNorm();
  if (squared_distance >= nearest.squared_distance) return;
  nearest.squared_distance = squared_distance;
  nearest.point = foot;
  if (feature == 0) {
    nearest.normal = face_normals_.col(face);
  } else if (feature >= 4) {
    nearest.normal = vertex_normals_.col(faces_(feature - 4, face));
  } else {
    nearest.normal = edge_normals_.col(3 * face + feature - 1).normalized();
  }
}

template <int Dim>
double ClosedMeshOf<Dim>::signed_distance(const VectorOf<Dim>& point, VectorOf<Dim>& normal) const {
  const auto squared_distance_to = [&](int box) {
    const Box& b = boxes_[static_cast<std::size_t>(box)];
    return (b.low - point).cwiseMax(point - b.high).cwiseMax(0.0).squaredNorm();
  };
  Nearest nearest{std::numeric_limits<double>::infinity(), {}, {}};
  std::array<int, kDeepestTree> waiting;
  int count = 0;
  waiting[0] = 0;
  for (count = 1; count > 0;) {
    const int at = waiting[static_cast<std::size_t>(--count)];
    if (squared_distance_to(at) >= nearest.squared_distance) continue;
    const Box& box = boxes_[static_cast<std::size_t>(at)];
    if (box.left < 0) {
      for (int n = box.begin; n < box.end; ++n) consider(order_[static_cast<std::size_t>(n)], point, nearest);
    } else {
      const bool left_first = squared_distance_to(box.left) <= squared_distance_to(box.right);
      waiting[static_cast<std::size_t>(count++)] = left_first ? box.right : box.left;
      waiting[static_cast<std::size_t>(count++)] = left_first ? box.left : box.right;
    }
  }
  const VectorOf<Dim> away = point - nearest.point;
  const double distance = std::sqrt(nearest.squared_distance), sign = away.dot(nearest.normal) < 0 ? -1 : 1;
  const double rounding = 1e-12 * (high() - low()).norm();  // a direction needs more than that
  normal = distance > rounding ? VectorOf<Dim>(sign / distance * away) : nearest.normal;
  return sign * distance;
}

template <int Dim>
std::string broken_mesh_rule(const PointsOf<Dim>& vertices, const Eigen::Matrix<int, Dim, Eigen::Dynamic>& faces) {
  if (faces.cols() <= Dim) return "there are too few faces to enclose anything";
  if (faces.minCoeff() < 0 || faces.maxCoeff() >= vertices.cols()) return "a face names a vertex that does not exist";
  if (!vertices.allFinite()) return "a vertex is not a finite number";
  // Across every rim of a face lies one other face, which runs along it the other way.
  std::map<std::pair<int, int>, int> balance;
  for (Eigen::Index f = 0; f < faces.cols(); ++f) {
    if (!(face_normal<Dim>(corners_of_face<Dim>(vertices, faces.col(f))).norm() > 0)) return "face " + std::to_string(f) + " has no area";
    for (int k = 0; k < Dim; ++k) {
      const int one = faces(k, f), two = Dim == 3 ? faces((k + 1) % Dim, f) : -1;
      const bool first_of_two = Dim == 3 ? one < two : k == 0;
      int& count = balance[std::minmax(one, two)];
      if (first_of_two ? (count & 1) != 0 : (count & 2) != 0)
        return "more than two faces meet in one place, or they face against each other";
      count |= first_of_two ? 1 : 2;
    }
  }
  for (const auto& [rim, count] : balance) {
    if (count != 3) return "it is not closed: a rim at vertex " + std::to_string(rim.second) + " has one face only";
  }
  double volume = 0;
  for (Eigen::Index f = 0; f < faces.cols(); ++f) {
    volume += face_normal<Dim>(corners_of_face<Dim>(vertices, faces.col(f))).dot(vertices.col(faces(0, f)) - vertices.col(faces(0, 0)));
  }
  if (!(volume > 0)) return "its faces look inward";
  return {};
}

template class ClosedMeshOf<2>;
template class ClosedMeshOf<3>;
template std::string broken_mesh_rule<2>(const PointsOf<2>&, const Eigen::Matrix<int, 2, Eigen::Dynamic>&);
template std::string broken_mesh_rule<3>(const PointsOf<3>&, const Eigen::Matrix<int, 3, Eigen::Dynamic>&);

}  // namespace hydrostat::physics
