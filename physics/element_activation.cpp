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

/// How one element answers to a change of its active shape, at one deformation and activation.
template <int Dim, int Nodes>
class ActiveVariation {
 public:
  using Variation = ElementVariation<Dim, Nodes>;
  using Square = SquareMatrix<double, Dim>;
  using Shape = ActiveShape<Dim, Nodes>;
  static constexpr int kModes = Variation::kModes;

  ActiveVariation(const ElementBlock<Dim>& block, const ActivationFit<Dim>& fit, int element, const ConstNodeMatrix<Dim>& x,
                  const Eigen::VectorXd& activation)
      : shape_(Shape::of(fit, activation, element)),
        active_(strain_matrix<Dim>(shape_)),
        stretch_(active_.stretch()),
        variation_(block, element, x, active_.inverse(), hourglass_of(shape_)) {}

  /// Derivative of the nodes' forces with respect to the shape's coordinates [N, N/m].
  Eigen::MatrixXd forces() const {
    const GradientDerivative<Dim> moduli = variation_.moduli(Definiteness::kExact);
    const typename Variation::Weights weights = variation_.node_weights();
    Eigen::MatrixXd result(Dim * Nodes, Shape::kSize);
    for (int c = 0; c < Shape::kSize; ++c) {
      const Square undo = undo_of(c);
      typename Variation::Change change;
      change.F = variation_.F() * undo;
      const Eigen::Matrix<double, Dim * Dim, 1> of_law = moduli * change.F.reshaped();
      typename Variation::Response response;
      // The nodes feel the stress through A^-1, which changes too.
      response.stress = of_law.reshaped(Dim, Dim) + variation_.stress() * undo.transpose();
      if constexpr (kModes > 0) {
        if (c >= kStrains<Dim>) change.rest(c - kStrains<Dim>) = 1;
        const typename Variation::Response of_hourglass = variation_.respond(change);
        response.stress += of_hourglass.stress;
        response.force = of_hourglass.force;
      }
      for (int n = 0; n < Nodes; ++n) {
        Eigen::Matrix<double, Dim, 1> force = response.stress * weights.row(n).template head<Dim>().transpose();
        if constexpr (kModes > 0) force += response.force * weights.row(n).template tail<kModes>().transpose();
        result.col(c).template segment<Dim>(Dim * n) = -force;
      }
    }
    return result;
  }

  /// Derivative of the energy with respect to the shape's coordinates [J, N].
  Eigen::RowVectorXd energy() const {
    Eigen::RowVectorXd result(Shape::kSize);
    for (int c = 0; c < kStrains<Dim>; ++c) result[c] = variation_.stress().cwiseProduct(variation_.F() * undo_of(c)).sum();
    if constexpr (kModes > 0) {
      for (int k = 0; k < Dim * kModes; ++k) result[kStrains<Dim> + k] = -variation_.hourglass_force()(k);
    }
    return result;
  }

 private:
  static typename Variation::Hourglass hourglass_of(const typename Shape::Coordinates& shape) {
    typename Variation::Hourglass rest;
    for (int k = 0; k < Dim * kModes; ++k) rest(k) = shape[kStrains<Dim> + k];
    return rest;
  }
  /// A dA^-1 for a unit of coordinate c: what it does to F from behind.
  Square undo_of(int c) const {
    if (c >= kStrains<Dim>) return Square::Zero();
    const typename Shape::Coordinates unit = Shape::Coordinates::Unit(c);
    return stretch_ * active_.change_of_inverse(strain_matrix<Dim>(unit));
  }

  typename Shape::Coordinates shape_;
  ActiveStretch<Dim> active_;
  Square stretch_;
  Variation variation_;
};

/// Of the shape's coordinates with respect to the activations [1, m].
template <int Dim>
Eigen::MatrixXd shape_per_activation(const ActivationFit<Dim>& fit, int element, const Eigen::VectorXd& activation) {
  Eigen::MatrixXd result = fit.maps[static_cast<std::size_t>(fit.map_of_element[element])];
  for (int pair = 0; pair < result.cols(); ++pair) result.col(pair) /= activation[fit.of_element(pair, element)];
  return result;
}

template <int Dim, int Nodes>
Eigen::MatrixXd force_per_activation(const ElementBlock<Dim>& block, const ActivationFit<Dim>& fit, int element,
                                     const ConstNodeMatrix<Dim>& x, const Eigen::VectorXd& activation) {
  return ActiveVariation<Dim, Nodes>(block, fit, element, x, activation).forces() *
         shape_per_activation(fit, element, activation);
}

template <int Dim, int Nodes>
Eigen::RowVectorXd energy_per_activation(const ElementBlock<Dim>& block, const ActivationFit<Dim>& fit, int element,
                                         const ConstNodeMatrix<Dim>& x, const Eigen::VectorXd& activation) {
  return ActiveVariation<Dim, Nodes>(block, fit, element, x, activation).energy() *
         shape_per_activation(fit, element, activation);
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

template <int Dim>
Eigen::RowVectorXd element_energy_per_activation(const ElementBlock<Dim>& block, const ActivationFit<Dim>& fit, int element,
                                                 const ConstNodeMatrix<Dim>& x, const Eigen::VectorXd& activation) {
  return block.is_box() ? energy_per_activation<Dim, 1 << Dim>(block, fit, element, x, activation)
                        : energy_per_activation<Dim, Dim + 1>(block, fit, element, x, activation);
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
template Eigen::RowVectorXd element_energy_per_activation<2>(const ElementBlock<2>&, const ActivationFit<2>&, int,
                                                             const ConstNodeMatrix<2>&, const Eigen::VectorXd&);
template Eigen::RowVectorXd element_energy_per_activation<3>(const ElementBlock<3>&, const ActivationFit<3>&, int,
                                                             const ConstNodeMatrix<3>&, const Eigen::VectorXd&);

}  // namespace hydrostat::physics
