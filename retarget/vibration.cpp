#include "retarget/vibration.h"

#include <Eigen/Eigenvalues>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <random>

namespace hydrostat::retarget {
namespace {

constexpr int kMostRounds = 60;
constexpr double kSettled = 1e-6;          // relative change of the squared frequencies in a round
constexpr Eigen::Index kSpareVectors = 8;  // vectors beyond those that are wanted: what converges last is not asked for

Eigen::MatrixXd random_vectors(Eigen::Index rows, Eigen::Index columns) {
  std::mt19937 random(1);
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return static_cast<double>(random()) / 4294967295.0 - 0.5; });
}

}  // namespace

Vibration lowest_modes(const Eigen::SparseMatrix<double>& stiffness, const Eigen::VectorXd& mass, Eigen::Index count) {
  const Eigen::Index size = mass.size(), kept = std::min(count, size), width = std::min(kept + kSpareVectors, size);
  Vibration result;
  if (kept == 0) return result;
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(stiffness);
  if (solver.info() != Eigen::Success || solver.vectorD().minCoeff() <= 0) return result;
  Eigen::MatrixXd vectors = random_vectors(size, width);
  Eigen::VectorXd before = Eigen::VectorXd::Zero(kept);
  Eigen::Index settled = 0;  // modes, the lowest first
  for (int round = 0; round < kMostRounds && settled < kept; ++round) {
    const Eigen::MatrixXd weighed = mass.asDiagonal() * vectors, solved = solver.solve(weighed);
    // Within the solved vectors: their stiffness is theirs with what was solved for.
    const Eigen::MatrixXd small_stiffness = solved.transpose() * weighed;
    const Eigen::MatrixXd small_mass = solved.transpose() * mass.asDiagonal() * solved;
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> small(small_stiffness, small_mass);
    vectors = solved * small.eigenvectors();
    result.squared_frequency = small.eigenvalues().head(kept);
    const Eigen::VectorXd& now = result.squared_frequency;
    for (settled = 0; settled < kept && std::abs(now[settled] - before[settled]) < kSettled * now[settled];) ++settled;
    before = now;
  }
  result.squared_frequency.conservativeResize(settled);
  result.shapes = vectors.leftCols(settled);
  for (auto shape : result.shapes.colwise()) {
    Eigen::Index largest = 0;
    shape.cwiseAbs().maxCoeff(&largest);
    if (shape[largest] < 0) shape *= -1;
  }
  return result;
}

}  // namespace hydrostat::retarget
