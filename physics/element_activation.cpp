#include "physics/element_activation.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <cmath>

#include "physics/element_hourglass.h"
#include "physics/element_variation.h"

namespace hydrostat::physics {
namespace {

template <int Dim>
constexpr int kStrains = Dim * (Dim + 1) / 2;  // entries i <= j of the symmetric strain, row by row

/// Strain and hourglass coordinates that fit the relative stretches of all pairs of an element best.
template <int Dim>
Eigen::MatrixXd fit_map(const NodeMatrix<Dim>& corners) {
  const int count = static_cast<int>(corners.cols());
  Eigen::MatrixXd pattern(count, 0);
  if (count == 1 << Dim) pattern = measure_box<Dim>(Corners<Dim>(corners)).pattern;
  Eigen::MatrixXd stretch(count * (count - 1) / 2, kStrains<Dim> + Dim * pattern.cols());
  int row = 0;
  for (int a = 0; a < count; ++a) {
    for (int b = a + 1; b < count; ++b, ++row) {
      const Eigen::Matrix<double, Dim, 1> span = corners.col(b) - corners.col(a);
      const double length_squared = span.squaredNorm();
      int column = 0;
      for (int i = 0; i < Dim; ++i) {
        for (int j = i; j < Dim; ++j) stretch(row, column++) = (i == j ? 1 : 2) * span[i] * span[j] / length_squared;
      }
      for (int k = 0; k < pattern.cols(); ++k) {
        for (int i = 0; i < Dim; ++i) stretch(row, column++) = (pattern(b, k) - pattern(a, k)) * span[i] / length_squared;
      }
    }
  }
  return stretch.colPivHouseholderQr().solve(Eigen::MatrixXd::Identity(stretch.rows(), stretch.rows()));
}

/// Symmetric matrix of the first entries of a column of a map.
template <int Dim, class Column>
SquareMatrix<double, Dim> strain_matrix(const Column& column) {
  SquareMatrix<double, Dim> strain;
  int at = 0;
  for (int i = 0; i < Dim; ++i) {
    for (int j = i; j < Dim; ++j) strain(i, j) = strain(j, i) = column[at++];
  }
  return strain;
}

/// exp(e), its inverse, and how the inverse changes with e.
template <int Dim>
class ActiveStretch {
 public:
  using Square = SquareMatrix<double, Dim>;
  explicit ActiveStretch(const Square& strain) : modes_(strain) {}

  Square stretch() const { return modes_.eigenvectors() * exponential(1).asDiagonal() * modes_.eigenvectors().transpose(); }
  Square inverse() const { return modes_.eigenvectors() * exponential(-1).asDiagonal() * modes_.eigenvectors().transpose(); }

  /// Change of the inverse when the strain changes by dstrain.
  /// Source: Daleckii and Krein; Higham, "Functions of Matrices", SIAM 2008, theorem 3.11.
  Square change_of_inverse(const Square& dstrain) const {
    const Square& V = modes_.eigenvectors();
    Square change = V.transpose() * dstrain * V;
    for (int i = 0; i < Dim; ++i) {
      for (int j = 0; j < Dim; ++j) {
        const double half = 0.5 * (modes_.eigenvalues()[i] - modes_.eigenvalues()[j]);
        const double mean = 0.5 * (modes_.eigenvalues()[i] + modes_.eigenvalues()[j]);
        change(i, j) *= -std::exp(-mean) * (std::abs(half) < 1e-4 ? 1 + half * half / 6 : std::sinh(half) / half);
      }
    }
    return V * change * V.transpose();
  }

 private:
  Eigen::Matrix<double, Dim, 1> exponential(double sign) const { return (sign * modes_.eigenvalues()).array().exp(); }
  Eigen::SelfAdjointEigenSolver<Square> modes_;
};

template <int Dim, int Nodes>
void write_active(const SquareMatrix<double, Dim>& inverse, const double* hourglass, int element, std::vector<Lanes>& lanes) {
  using Layout = ActiveLayout<Dim, Nodes>;
  Lanes* const batch = &lanes[static_cast<std::size_t>(element / Lanes::kCount) * Layout::kSize];
  const int lane = element % Lanes::kCount;
  for (int k = 0; k < Dim * Dim; ++k) batch[Layout::kInverse + k].value[lane] = inverse(k);
  for (int k = 0; k < Layout::kSize - Layout::kHourglass; ++k) batch[Layout::kHourglass + k].value[lane] = hourglass[k];
}

template <int Dim, int Nodes>
struct ActiveShape {
  static constexpr int kPairs = Nodes * (Nodes - 1) / 2;
  static constexpr int kSize = kStrains<Dim> + ElementLayout<Dim, Nodes>::kCoordinates;
  using Coordinates = Eigen::Matrix<double, kSize, 1>;  // strain, then hourglass

  static Coordinates of(const ActivationFit<Dim>& fit, const Eigen::VectorXd& activation, int element) {
    Eigen::Matrix<double, kPairs, 1> logarithm;
    for (int p = 0; p < kPairs; ++p) logarithm[p] = std::log(activation[fit.of_element(p, element)]);
    Coordinates result;
    result.noalias() = fit.maps[static_cast<std::size_t>(fit.map_of_element[element])] * logarithm;
    return result;
  }
};

template <int Dim, int Nodes>
void set_activation_of(const ActivationFit<Dim>& fit, const Eigen::VectorXd& activation, ActiveStrain<Dim>& active) {
  using Shape = ActiveShape<Dim, Nodes>;
  for (int e = 0; e < fit.of_element.cols(); ++e) {
    const typename Shape::Coordinates shape = Shape::of(fit, activation, e);
    const ActiveStretch<Dim> stretch(strain_matrix<Dim>(shape));
    write_active<Dim, Nodes>(stretch.inverse(), shape.data() + kStrains<Dim>, e, active.lanes);
  }
}

template <int Dim, int Nodes>
ActiveStrain<Dim> make_active_strain_of(const ElementBlock<Dim>& block) {
  ActiveStrain<Dim> active;
  active.lanes.assign(static_cast<std::size_t>(block.batch_count()) * ActiveLayout<Dim, Nodes>::kSize, Lanes(0.0));
  const Eigen::Matrix<double, Dim * Nodes, 1> rest = Eigen::Matrix<double, Dim * Nodes, 1>::Zero();
  for (int e = 0; e < block.batch_count() * Lanes::kCount; ++e) {
    write_active<Dim, Nodes>(SquareMatrix<double, Dim>::Identity(), rest.data(), e, active.lanes);
  }
  return active;
}

template <int Dim, int Nodes>
Eigen::MatrixXd force_per_activation(const ElementBlock<Dim>& block, const ActivationFit<Dim>& fit, int element,
                                     const ConstNodeMatrix<Dim>& x, const Eigen::VectorXd& activation) {
  using Variation = ElementVariation<Dim, Nodes>;
  using Square = SquareMatrix<double, Dim>;
  constexpr int kModes = Variation::kModes;
  const auto shape = ActiveShape<Dim, Nodes>::of(fit, activation, element);
  const ActiveStretch<Dim> active(strain_matrix<Dim>(shape));
  typename Variation::Hourglass rest;
  for (int k = 0; k < Dim * kModes; ++k) rest(k) = shape[kStrains<Dim> + k];
  const Variation variation(block, element, x, active.inverse(), rest);
  const GradientDerivative<Dim> moduli = variation.moduli(Definiteness::kExact);
  const typename Variation::Weights weights = variation.node_weights();
  const Square stretch = active.stretch();
  const Eigen::MatrixXd& map = fit.maps[static_cast<std::size_t>(fit.map_of_element[element])];
  Eigen::MatrixXd result(Dim * Nodes, map.cols());
  for (int pair = 0; pair < map.cols(); ++pair) {
    const Square undo = stretch * active.change_of_inverse(strain_matrix<Dim>(map.col(pair)));
    typename Variation::Change change;
    change.F = variation.F() * undo;
    const Eigen::Matrix<double, Dim * Dim, 1> of_law = moduli * change.F.reshaped();
    typename Variation::Response response;
    // The nodes feel the stress through A^-1, which changes too.
    response.stress = of_law.reshaped(Dim, Dim) + variation.stress() * undo.transpose();
    if constexpr (kModes > 0) {
      for (int k = 0; k < Dim * kModes; ++k) change.rest(k) = map(kStrains<Dim> + k, pair);
      const typename Variation::Response of_hourglass = variation.respond(change);
      response.stress += of_hourglass.stress;
      response.force = of_hourglass.force;
    }
    const double per_activation = 1 / activation[fit.of_element(pair, element)];
    for (int n = 0; n < Nodes; ++n) {
      Eigen::Matrix<double, Dim, 1> force = response.stress * weights.row(n).template head<Dim>().transpose();
      if constexpr (kModes > 0) force += response.force * weights.row(n).template tail<kModes>().transpose();
      result.col(pair).segment<Dim>(Dim * n) = -per_activation * force;
    }
  }
  return result;
}

}  // namespace

template <int Dim>
ActivationFit<Dim> make_activation_fit(const ElementMesh<Dim>& mesh, const ElementConstraints& constraints) {
  ActivationFit<Dim> fit;
  fit.of_element = constraints.of_element;
  fit.map_of_element.resize(mesh.nodes.cols());
  NodeMatrix<Dim> last;
  for (int e = 0; e < mesh.nodes.cols(); ++e) {
    const NodeMatrix<Dim> corners = corners_of<Dim>(mesh, e);
    if (e == 0 || !are_alike<Dim>(corners, last)) {
      last = corners;
      fit.maps.push_back(fit_map<Dim>(corners));
    }
    fit.map_of_element[e] = static_cast<int>(fit.maps.size()) - 1;
  }
  return fit;
}

template <int Dim>
ActiveStrain<Dim> make_active_strain(const ElementBlock<Dim>& block) {
  return block.is_box() ? make_active_strain_of<Dim, 1 << Dim>(block) : make_active_strain_of<Dim, Dim + 1>(block);
}

template <int Dim>
bool set_activation(const ActivationFit<Dim>& fit, const Eigen::VectorXd& activation, ActiveStrain<Dim>& active) {
  for (const double each : activation) {
    if (!(each > 0) || !std::isfinite(each)) return false;
  }
  if (fit.is_of_boxes()) {
    set_activation_of<Dim, 1 << Dim>(fit, activation, active);
  } else {
    set_activation_of<Dim, Dim + 1>(fit, activation, active);
  }
  return true;
}

template <int Dim>
Eigen::MatrixXd element_force_per_activation(const ElementBlock<Dim>& block, const ActivationFit<Dim>& fit, int element,
                                             const ConstNodeMatrix<Dim>& x, const Eigen::VectorXd& activation) {
  return block.is_box() ? force_per_activation<Dim, 1 << Dim>(block, fit, element, x, activation)
                        : force_per_activation<Dim, Dim + 1>(block, fit, element, x, activation);
}

template ActivationFit<2> make_activation_fit<2>(const ElementMesh<2>&, const ElementConstraints&);
template ActivationFit<3> make_activation_fit<3>(const ElementMesh<3>&, const ElementConstraints&);
template ActiveStrain<2> make_active_strain<2>(const ElementBlock<2>&);
template ActiveStrain<3> make_active_strain<3>(const ElementBlock<3>&);
template bool set_activation<2>(const ActivationFit<2>&, const Eigen::VectorXd&, ActiveStrain<2>&);
template bool set_activation<3>(const ActivationFit<3>&, const Eigen::VectorXd&, ActiveStrain<3>&);
template Eigen::MatrixXd element_force_per_activation<2>(const ElementBlock<2>&, const ActivationFit<2>&, int,
                                                         const ConstNodeMatrix<2>&, const Eigen::VectorXd&);
template Eigen::MatrixXd element_force_per_activation<3>(const ElementBlock<3>&, const ActivationFit<3>&, int,
                                                         const ConstNodeMatrix<3>&, const Eigen::VectorXd&);

}  // namespace hydrostat::physics
