#include "physics/material_rotation.h"

#include <Eigen/LU>
#include <Eigen/SVD>

namespace hydrostat::physics {

template <int Dim>
SignedSingularValues<Dim> signed_singular_values(const SquareMatrix<double, Dim>& F) {
  using Matrix = SquareMatrix<double, Dim>;
  SignedSingularValues<Dim> result{Matrix::Identity(), Matrix::Identity(), F.diagonal()};
  const Eigen::JacobiSVD<Matrix, Eigen::NoQRPreconditioner> svd(F, Eigen::ComputeFullU | Eigen::ComputeFullV);
  if (svd.info() != Eigen::Success) return result;  // not finite
  result = {svd.matrixU(), svd.matrixV(), svd.singularValues()};
  const auto make_rotation = [&](Matrix& factor) {
    if (factor.determinant() > 0) return;
    factor.col(Dim - 1) *= -1;
    result.stretch[Dim - 1] *= -1;
  };
  make_rotation(result.U);
  make_rotation(result.V);
  return result;
}

void repair_rotation(const SquareMatrix<double, 3>& F, double sound, SquareMatrix<double, 3>& R) {
  if (sound > 0) return;
  const SignedSingularValues<3> svd = signed_singular_values<3>(F);
  R = svd.U * svd.V.transpose();
}

void repair_rotation(const SquareMatrix<Lanes, 3>& F, const Lanes& sound, SquareMatrix<Lanes, 3>& R) {
  for (int lane = 0; lane < Lanes::kCount; ++lane) {
    if (sound[lane] > 0) continue;
    SquareMatrix<double, 3> one;
    for (int k = 0; k < 9; ++k) one(k) = F(k)[lane];
    repair_rotation(one, 0.0, one);
    for (int k = 0; k < 9; ++k) R(k).value[lane] = one(k);
  }
}

template SignedSingularValues<2> signed_singular_values<2>(const SquareMatrix<double, 2>&);
template SignedSingularValues<3> signed_singular_values<3>(const SquareMatrix<double, 3>&);

}  // namespace hydrostat::physics
