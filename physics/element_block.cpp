#include "physics/element_block.h"

#include <Eigen/LU>
#include <cassert>
#include <cmath>

#include "physics/element_hourglass.h"
#include "physics/element_kernel.h"

namespace hydrostat::physics {
namespace {

constexpr double kLeastVolumeShare = 1e-6;    // of the longest edge cubed (2D: squared)
constexpr double kLeastJacobianRatio = 1e-3;  // of a box, at each of its corners

/// What every kind of element says of itself at rest.
struct RestElement {
  double volume = 0;
  Eigen::VectorXd nodal_volume;
  Eigen::MatrixXd gradient, hourglass, stiffness;  // as in BoxMeasure and hourglass_stiffness
  double least_jacobian_ratio = 1;
};

template <int Dim>
RestElement measure_simplex(const NodeMatrix<Dim>& corners) {
  SquareMatrix<double, Dim> span;
  for (int i = 0; i < Dim; ++i) span.col(i) = corners.col(i + 1) - corners.col(0);
  RestElement element;
  element.volume = span.determinant() / (Dim == 2 ? 2 : 6);
  element.nodal_volume = Eigen::VectorXd::Constant(Dim + 1, element.volume / (Dim + 1));
  const SquareMatrix<double, Dim> inverse = span.inverse();
  element.gradient.resize(Dim + 1, Dim);
  element.gradient.bottomRows(Dim) = inverse;
  element.gradient.row(0) = -inverse.colwise().sum();
  element.hourglass.resize(Dim + 1, 0);
  return element;
}

template <int Dim>
RestElement measure_element(const NodeMatrix<Dim>& corners) {
  if (corners.cols() == Dim + 1) return measure_simplex<Dim>(corners);
  const BoxMeasure<Dim> box = measure_box<Dim>(corners);
  return {box.volume, box.nodal_volume, box.gradient, box.hourglass, {}, box.least_jacobian_ratio};
}

template <int Dim>
double longest_edge(const NodeMatrix<Dim>& corners) {
  double longest = 0;
  for (int a = 0; a < corners.cols(); ++a) {
    for (int b = 0; b < a; ++b) longest = std::max(longest, (corners.col(a) - corners.col(b)).norm());
  }
  return longest;
}

/// Remembers the last hourglass stiffness: cells of a lattice are alike.
template <int Dim>
class HourglassCache {
 public:
  const Eigen::MatrixXd& stiffness(const NodeMatrix<Dim>& corners, const Lame& lame) {
    const bool is_known = corners_.size() > 0 && lame.lambda == lame_.lambda && lame.mu == lame_.mu &&
                          are_alike<Dim>(corners, corners_);
    if (!is_known) {
      corners_ = corners;
      lame_ = lame;
      const Corners<Dim> box = corners;
      stiffness_ = hourglass_stiffness<Dim>(box, measure_box<Dim>(box), lame);
    }
    return stiffness_;
  }

 private:
  NodeMatrix<Dim> corners_;
  Lame lame_;
  Eigen::MatrixXd stiffness_;
};

template <int Dim, int Nodes>
void write_lanes(const RestElement& element, const Lame& lame, double fill, int index, std::vector<Lanes>& lanes) {
  using Layout = ElementLayout<Dim, Nodes>;
  Lanes* const batch = &lanes[static_cast<std::size_t>(index / Lanes::kCount) * Layout::kSize];
  const int lane = index % Lanes::kCount;
  const double matter = element.volume * fill;
  batch[Layout::kVolume].value[lane] = matter;
  batch[Layout::kLambda].value[lane] = lame.lambda * matter;
  batch[Layout::kMu].value[lane] = lame.mu * matter;
  for (int n = 0; n < Nodes - 1; ++n) {
    for (int j = 0; j < Dim; ++j) batch[Layout::kGradient + Dim * n + j].value[lane] = element.gradient(n + 1, j);
    for (int k = 0; k < Layout::kModes; ++k) {
      batch[Layout::kHourglass + Layout::kModes * n + k].value[lane] = element.hourglass(n + 1, k);
    }
  }
  int at = Layout::kStiffness;
  for (int row = 0; row < Layout::kCoordinates; ++row) {
    for (int column = 0; column <= row; ++column) batch[at++].value[lane] = fill * element.stiffness(row, column);
  }
}

template <int Dim, int Nodes>
void fill_lanes(const ElementMesh<Dim>& mesh, ElementBlock<Dim>& block) {
  const int count = block.element_count(), padded = block.batch_count() * Lanes::kCount;
  block.lanes.assign(static_cast<std::size_t>(block.batch_count()) * ElementLayout<Dim, Nodes>::kSize, Lanes(0.0));
  block.lane_nodes.resize(static_cast<std::size_t>(padded) * Nodes);
  block.rest_volume.resize(count);
  block.nodal_mass.resize(Nodes, count);
  HourglassCache<Dim> cache;
  for (int e = 0; e < padded; ++e) {
    const int source = std::min(e, count - 1);
    for (int n = 0; n < Nodes; ++n) {
      const std::size_t row = static_cast<std::size_t>(e / Lanes::kCount) * Nodes + n;
      block.lane_nodes[row * Lanes::kCount + e % Lanes::kCount] = block.nodes(n, source);
    }
    const NodeMatrix<Dim> corners = corners_of<Dim>(mesh, source);
    RestElement element = measure_element<Dim>(corners);
    const ElementMaterial& material = mesh.materials[mesh.materials.size() == 1 ? 0 : source];
    const Lame lame = lame_of(material.youngs_modulus, material.poissons_ratio);
    if constexpr (ElementLayout<Dim, Nodes>::kModes > 0) element.stiffness = cache.stiffness(corners, lame);
    const bool is_real = e < count;
    write_lanes<Dim, Nodes>(element, lame, is_real ? mesh.fill[e] : 0, e, block.lanes);
    if (!is_real) continue;
    block.rest_volume[e] = element.volume;
    block.nodal_mass.col(e) = material.density * mesh.fill[e] * element.nodal_volume;
  }
}

template <int Dim>
std::string broken_rule_of_shape(const ElementMesh<Dim>& mesh, int element) {
  const NodeMatrix<Dim> corners = corners_of<Dim>(mesh, element);
  if (!corners.allFinite()) return "has a place that is not finite";
  const RestElement shape = measure_element<Dim>(corners);
  const double least = kLeastVolumeShare * std::pow(longest_edge<Dim>(corners), Dim);
  if (!(shape.volume > least)) {
    return "has volume " + std::to_string(shape.volume) + ", which is below zero or a sliver's";
  }
  if (!(shape.least_jacobian_ratio > kLeastJacobianRatio)) return "is folded over at a corner";
  return {};
}

}  // namespace

template <int Dim>
NodeMatrix<Dim> corners_of(const ElementMesh<Dim>& mesh, int element) {
  NodeMatrix<Dim> corners(Dim, mesh.nodes.rows());
  for (int n = 0; n < mesh.nodes.rows(); ++n) corners.col(n) = mesh.rest.col(mesh.nodes(n, element));
  return corners;
}

template <int Dim>
bool are_alike(const NodeMatrix<Dim>& corners, const NodeMatrix<Dim>& other) {
  if (corners.cols() != other.cols()) return false;
  const NodeMatrix<Dim> difference = (corners.colwise() - corners.col(0)) - (other.colwise() - other.col(0));
  const double rounding = 1e-15 * corners.cwiseAbs().maxCoeff() + 1e-14 * longest_edge<Dim>(corners);
  return difference.cwiseAbs().maxCoeff() <= 4 * rounding;
}

template <int Dim>
std::string broken_rule(const ElementMesh<Dim>& mesh) {
  const Eigen::Index count = mesh.nodes.cols();
  if (mesh.nodes.rows() != Dim + 1 && mesh.nodes.rows() != 1 << Dim) {
    return "an element must have " + std::to_string(Dim + 1) + " or " + std::to_string(1 << Dim) + " nodes";
  }
  if (count == 0) return "there must be an element";
  if (mesh.fill.size() != count) return "there must be one fill for each element";
  const auto materials = static_cast<Eigen::Index>(mesh.materials.size());
  if (materials != 1 && materials != count) return "there must be one material for all elements or one for each";
  for (std::size_t m = 0; m < mesh.materials.size(); ++m) {
    const ElementMaterial& material = mesh.materials[m];
    const std::string rule = material.density > 0 ? broken_rule(material.youngs_modulus, material.poissons_ratio)
                                                  : "density must be above 0 kg/m3";
    if (!rule.empty()) return "material " + std::to_string(m) + ": " + rule;
  }
  for (int e = 0; e < count; ++e) {
    const std::string name = "element " + std::to_string(e) + " ";
    if (mesh.nodes.col(e).minCoeff() < 0 || mesh.nodes.col(e).maxCoeff() >= mesh.rest.cols()) {
      return name + "names a node that is not there";
    }
    if (!(mesh.fill[e] > 0 && mesh.fill[e] <= 1)) return name + "must have a fill above 0 and at most 1";
    const std::string rule = broken_rule_of_shape<Dim>(mesh, e);
    if (!rule.empty()) return name + rule;
  }
  return {};
}

template <int Dim>
ElementBlock<Dim> make_element_block(const ElementMesh<Dim>& mesh, ElasticLaw law) {
  assert(broken_rule(mesh).empty());
  ElementBlock<Dim> block;
  block.law = law;
  block.nodes = mesh.nodes;
  if (block.is_box()) {
    fill_lanes<Dim, 1 << Dim>(mesh, block);
  } else {
    fill_lanes<Dim, Dim + 1>(mesh, block);
  }
  return block;
}

template <int Dim>
void add_lumped_mass(const ElementBlock<Dim>& block, Eigen::VectorXd& mass) {
  for (int e = 0; e < block.element_count(); ++e) {
    for (int n = 0; n < block.nodes_per_element(); ++n) mass[block.nodes(n, e)] += block.nodal_mass(n, e);
  }
}

template <int Dim>
std::size_t memory_of(const ElementBlock<Dim>& block) {
  return sizeof(block) + block.nodes.size() * sizeof(int) + (block.rest_volume.size() + block.nodal_mass.size()) * sizeof(double) +
         block.lane_nodes.capacity() * sizeof(int) + block.lanes.capacity() * sizeof(Lanes);
}

template NodeMatrix<2> corners_of<2>(const ElementMesh<2>&, int);
template NodeMatrix<3> corners_of<3>(const ElementMesh<3>&, int);
template bool are_alike<2>(const NodeMatrix<2>&, const NodeMatrix<2>&);
template bool are_alike<3>(const NodeMatrix<3>&, const NodeMatrix<3>&);
template std::string broken_rule<2>(const ElementMesh<2>&);
template std::string broken_rule<3>(const ElementMesh<3>&);
template ElementBlock<2> make_element_block<2>(const ElementMesh<2>&, ElasticLaw);
template ElementBlock<3> make_element_block<3>(const ElementMesh<3>&, ElasticLaw);
template void add_lumped_mass<2>(const ElementBlock<2>&, Eigen::VectorXd&);
template void add_lumped_mass<3>(const ElementBlock<3>&, Eigen::VectorXd&);
template std::size_t memory_of<2>(const ElementBlock<2>&);
template std::size_t memory_of<3>(const ElementBlock<3>&);

}  // namespace hydrostat::physics
