#include "physics/element_calibration.h"

#include <gtest/gtest.h>

#include "physics/internal_forces.h"
#include "tests/physics/element_method_scene.h"

namespace hydrostat::physics::element_calibration_test {
namespace {

using Cells = Eigen::Vector3i;

ElementMesh<3> bar_of(const Cells& cells, const Eigen::Vector3d& size, Cut cut, double poissons_ratio, double factor = 1) {
  return element_bar<3>(cells, size, cut, {1000, factor * 5e7, poissons_ratio});
}

double factor_of(const Cells& cells, const Eigen::Vector3d& size, double poissons_ratio) {
  return unlocking_factor(bar_of(cells, size, Cut::kFiveTets, poissons_ratio),
                          bar_of(cells, size, Cut::kBoxes, poissons_ratio));
}

/// How far the nodes at `place` along x sink under the weight of a bar that is held at x = 0, or at both ends [m], to first
/// order.
double sag(const ElementMesh<3>& mesh, double place, bool both_ends) {
  const BodyOf<3> body = make_body(mesh, ElementBodyOptions{});
  const double length = body.rest.row(0).maxCoeff();
  Eigen::MatrixXd way = Eigen::MatrixXd::Zero(body.rest.size(), 1);
  std::vector<int> held;
  for (int n = 0; n < body.node_count(); ++n) {
    if (body.rest(0, n) < 1e-9 || (both_ends && body.rest(0, n) > length - 1e-9)) {
      held.push_back(n);
    } else {
      way(3 * n + 1, 0) = -9.81 * body.mass[n];
    }
  }
  SystemMatrix matrix(body);
  matrix.set_zero();
  InternalForces<3>(body).add_stiffness(body.rest, 1, matrix);
  matrix.hold(held);
  EXPECT_TRUE(matrix.factor());
  matrix.solve_in_place(way);
  double sum = 0;
  int count = 0;
  for (int n = 0; n < body.node_count(); ++n) {
    if (std::abs(body.rest(0, n) - place) > 1e-9) continue;
    sum -= way(3 * n + 1, 0);
    ++count;
  }
  return sum / count;
}

TEST(UnlockingFactor, LetsCoarseTetsSagAsFarAsTheConvergedBar) {
  // CalculiX 2.20: C3D8I of 24 x 6 x 6 cells.
  const Eigen::Vector3d size(1, 0.25, 0.25);
  for (const auto& [poissons_ratio, converged, tolerance] :
       {std::tuple(0.4, 4.79e-3, 0.05), std::tuple(0.49, 4.66e-3, 0.1)}) {
    for (const Cells& cells : {Cells(8, 2, 2), Cells(12, 4, 4)}) {
      SCOPED_TRACE(std::to_string(cells[0]) + " cells along, nu " + std::to_string(poissons_ratio));
      const double factor = factor_of(cells, size, poissons_ratio);
      EXPECT_LT(sag(bar_of(cells, size, Cut::kFiveTets, poissons_ratio), 1, false), 0.85 * converged);
      EXPECT_NEAR(sag(bar_of(cells, size, Cut::kFiveTets, poissons_ratio, factor), 1, false), converged,
                  tolerance * converged);
    }
  }
}

TEST(UnlockingFactor, HoldsForBarsThatAreHeldInAnotherWay) {
  // Held at both ends, of other lengths; hexahedra of twice as many cells along each axis for the converged one.
  for (const Cells& cells : {Cells(6, 2, 2), Cells(10, 2, 2), Cells(8, 1, 1)}) {
    SCOPED_TRACE(std::to_string(cells[0]) + " cells along, " + std::to_string(cells[1]) + " across");
    const Eigen::Vector3d size = 0.1 * cells.cast<double>();
    const double middle = size.x() / 2, factor = factor_of(cells, size, 0.4);
    const double converged = sag(bar_of(2 * cells, size, Cut::kBoxes, 0.4), middle, true);
    EXPECT_LT(sag(bar_of(cells, size, Cut::kFiveTets, 0.4), middle, true), 0.8 * converged);
    EXPECT_NEAR(sag(bar_of(cells, size, Cut::kFiveTets, 0.4, factor), middle, true), converged, 0.25 * converged);
  }
}

TEST(UnlockingFactor, GrowsTowardsOneWithTheCellsAcross) {
  double last = 0;
  for (const int across : {1, 2, 4}) {
    const double factor = factor_of({4 * across, across, across}, {1, 0.25, 0.25}, 0.4);
    EXPECT_GT(factor, last);
    EXPECT_LT(factor, 1);
    last = factor;
  }
}

}  // namespace
}  // namespace hydrostat::physics::element_calibration_test
