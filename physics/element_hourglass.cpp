#include "physics/element_hourglass.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace hydrostat::physics {
namespace {

/// Coordinate d of corner c of the cube [-1, 1]^Dim.
double sign_of(int corner, int d) { return (corner >> d & 1) * 2 - 1; }

template <int Dim>
struct Point {
  Eigen::Matrix<double, Dim, 1> xi;
  Eigen::Matrix<double, (1 << Dim), 1> shape;          // values of the shape functions
  Eigen::Matrix<double, (1 << Dim), Dim> shape_slope;  // their derivatives with respect to xi
  Gradient<Dim> jacobian;                  // dX / dxi
  double determinant = 0;
};

template <int Dim>
Point<Dim> point_at(const Corners<Dim>& corners, const Eigen::Matrix<double, Dim, 1>& xi) {
  Point<Dim> point;
  point.xi = xi;
  for (int c = 0; c < 1 << Dim; ++c) {
    Eigen::Matrix<double, Dim, 1> factor;
    for (int d = 0; d < Dim; ++d) factor[d] = (1 + sign_of(c, d) * xi[d]) / 2;
    point.shape[c] = factor.prod();
    for (int d = 0; d < Dim; ++d) {
      Eigen::Matrix<double, Dim, 1> of_slope = factor;
      of_slope[d] = sign_of(c, d) / 2;
      point.shape_slope(c, d) = of_slope.prod();
    }
  }
  point.jacobian = corners * point.shape_slope;
  point.determinant = point.jacobian.determinant();
  return point;
}

/// Gauss point q of 2^Dim, each of weight 1: exact for the volume and the mean gradient of a box of any shape.
template <int Dim>
Point<Dim> gauss_point(const Corners<Dim>& corners, int q) {
  Eigen::Matrix<double, Dim, 1> xi;
  for (int d = 0; d < Dim; ++d) xi[d] = sign_of(q, d) / std::sqrt(3.0);
  return point_at<Dim>(corners, xi);
}

/// Matrix that takes nodal displacements to the displacement gradient (columns stacked), given nodal gradients.
template <int Dim>
Eigen::MatrixXd strain_operator(const Eigen::Matrix<double, Eigen::Dynamic, Dim>& gradient) {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(Dim * Dim, Dim * gradient.rows());
  for (int c = 0; c < gradient.rows(); ++c) {
    for (int i = 0; i < Dim; ++i) {
      for (int j = 0; j < Dim; ++j) result(i + Dim * j, Dim * c + i) = gradient(c, j);
    }
  }
  return result;
}

/// The enhanced displacement gradients (columns stacked) at a point, one column a mode; their mean over the box is zero.
template <int Dim>
Eigen::MatrixXd enhanced_modes(const Point<Dim>& point, const Point<Dim>& centre, bool volume_modes) {
  const double scale = centre.determinant / point.determinant;
  const Gradient<Dim> inverse = centre.jacobian.inverse();
  Eigen::Matrix<double, Eigen::Dynamic, Dim> parabolas(Dim, Dim);
  for (int d = 0; d < Dim; ++d) parabolas.row(d) = -2 * point.xi[d] * scale * inverse.row(d);
  Eigen::MatrixXd modes = strain_operator<Dim>(parabolas);
  if (!volume_modes) return modes;
  for (int d = 0; d < Dim; ++d) {
    for (int e = d + 1; e < Dim; ++e) {
      const Gradient<Dim> swelling = Gradient<Dim>::Identity() * (scale * point.xi[d] * point.xi[e]);
      modes.conservativeResize(Eigen::NoChange, modes.cols() + 1);
      modes.rightCols(1) = swelling.reshaped();
    }
  }
  return modes;
}

}  // namespace

template <int Dim>
BoxMeasure<Dim> measure_box(const Corners<Dim>& corners) {
  using Measure = BoxMeasure<Dim>;
  Measure measure;
  measure.nodal_volume.setZero();
  measure.gradient.setZero();
  for (int q = 0; q < Measure::kNodes; ++q) {
    const Point<Dim> point = gauss_point(corners, q);
    measure.volume += point.determinant;
    measure.nodal_volume += point.determinant * point.shape;
    measure.gradient += point.shape_slope * point.jacobian.inverse() * point.determinant;
  }
  measure.gradient /= measure.volume;

  // Patterns of two and three coordinates multiplied, made blind to linear motions.
  int mode = 0;
  for (int bits = 1; bits < Measure::kNodes; ++bits) {
    if ((bits & (bits - 1)) == 0) continue;
    for (int c = 0; c < Measure::kNodes; ++c) {
      measure.pattern(c, mode) = 1;
      for (int d = 0; d < Dim; ++d) measure.pattern(c, mode) *= bits >> d & 1 ? sign_of(c, d) : 1;
    }
    ++mode;
  }
  measure.hourglass = (measure.pattern - measure.gradient * (corners * measure.pattern)) / Measure::kNodes;

  // The dual basis: what the mean, the gradient and the hourglass coordinates measure one at a time.
  Eigen::Matrix<double, Measure::kNodes, Measure::kNodes> all;
  all << Eigen::Matrix<double, Measure::kNodes, 1>::Constant(1.0 / Measure::kNodes), measure.gradient, measure.hourglass;
  const Eigen::Matrix<double, Measure::kNodes, Measure::kNodes> dual = all.transpose().inverse();
  measure.pattern = dual.template rightCols<Measure::kModes>();

  measure.least_jacobian_ratio = std::numeric_limits<double>::infinity();
  double mean = 0;
  for (int c = 0; c < Measure::kNodes; ++c) {
    Eigen::Matrix<double, Dim, 1> xi;
    for (int d = 0; d < Dim; ++d) xi[d] = sign_of(c, d);
    const double here = point_at<Dim>(corners, xi).determinant;
    mean += here / Measure::kNodes;
    measure.least_jacobian_ratio = std::min(measure.least_jacobian_ratio, here);
  }
  measure.least_jacobian_ratio /= mean;
  return measure;
}

template <int Dim>
Eigen::MatrixXd enhanced_stiffness(const Corners<Dim>& corners, const Lame& lame, bool volume_modes) {
  constexpr int kNodes = 1 << Dim;
  const GradientDerivative<Dim> hooke = stress_derivative<Dim>(ElasticLaw::kCorotatedLinear, lame, Gradient<Dim>::Identity(),
                                                               Definiteness::kExact);
  const Point<Dim> centre = point_at<Dim>(corners, Eigen::Matrix<double, Dim, 1>::Zero());
  Eigen::MatrixXd plain = Eigen::MatrixXd::Zero(Dim * kNodes, Dim * kNodes), coupling, enhanced;
  for (int q = 0; q < kNodes; ++q) {
    const Point<Dim> point = gauss_point(corners, q);
    const Eigen::MatrixXd strain = strain_operator<Dim>(point.shape_slope * point.jacobian.inverse());
    const Eigen::MatrixXd modes = enhanced_modes(point, centre, volume_modes);
    if (q == 0) {
      coupling = Eigen::MatrixXd::Zero(modes.cols(), strain.cols());
      enhanced = Eigen::MatrixXd::Zero(modes.cols(), modes.cols());
    }
    plain += point.determinant * strain.transpose() * hooke * strain;
    coupling += point.determinant * modes.transpose() * hooke * strain;
    enhanced += point.determinant * modes.transpose() * hooke * modes;
  }
  return plain - coupling.transpose() * enhanced.ldlt().solve(coupling);
}

template <int Dim>
Eigen::MatrixXd hourglass_stiffness(const Corners<Dim>& corners, const BoxMeasure<Dim>& measure, const Lame& lame) {
  using Measure = BoxMeasure<Dim>;
  Eigen::MatrixXd patterns = Eigen::MatrixXd::Zero(Dim * Measure::kNodes, Dim * Measure::kModes);
  for (int mode = 0; mode < Measure::kModes; ++mode) {
    for (int c = 0; c < Measure::kNodes; ++c) {
      for (int i = 0; i < Dim; ++i) patterns(Dim * c + i, Dim * mode + i) = measure.pattern(c, mode);
    }
  }
  const Eigen::MatrixXd result = patterns.transpose() * enhanced_stiffness<Dim>(corners, lame) * patterns;
  return 0.5 * (result + result.transpose());
}

template BoxMeasure<2> measure_box<2>(const Corners<2>&);
template BoxMeasure<3> measure_box<3>(const Corners<3>&);
template Eigen::MatrixXd enhanced_stiffness<2>(const Corners<2>&, const Lame&, bool);
template Eigen::MatrixXd enhanced_stiffness<3>(const Corners<3>&, const Lame&, bool);
template Eigen::MatrixXd hourglass_stiffness<2>(const Corners<2>&, const BoxMeasure<2>&, const Lame&);
template Eigen::MatrixXd hourglass_stiffness<3>(const Corners<3>&, const BoxMeasure<3>&, const Lame&);

}  // namespace hydrostat::physics
