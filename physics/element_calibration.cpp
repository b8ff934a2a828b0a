#include "physics/element_calibration.h"

#include <cassert>

#include "physics/element_body.h"
#include "physics/internal_forces.h"

namespace hydrostat::physics {
namespace {

constexpr double kAtTheEnd = 1e-6;  // of the extent along an axis [-]: nodes so near to its end are held

/// The work of the body's weight, under an acceleration of 1 m/s2, on the way that the body gives [J], over all holds and
/// directions across them.
template <int Dim>
double compliance(const BodyOf<Dim>& body) {
  SystemMatrixOf<Dim> matrix(body);
  const InternalForces<Dim> forces(body);
  Eigen::MatrixXd loads(body.rest.size(), Dim - 1);
  double work = 0;
  for (int axis = 0; axis < Dim; ++axis) {
    const double low = body.rest.row(axis).minCoeff(), high = body.rest.row(axis).maxCoeff();
    for (const double end : {low, high}) {
      std::vector<int> held;
      loads.setZero();
      for (int n = 0; n < body.node_count(); ++n) {
        if (std::abs(body.rest(axis, n) - end) <= kAtTheEnd * (high - low)) {
          held.push_back(n);
          continue;
        }
        for (int k = 0; k < Dim - 1; ++k) loads(Dim * n + (axis + 1 + k) % Dim, k) = body.mass[n];
      }
      matrix.set_zero();
      forces.add_stiffness(body.rest, 1, matrix);
      matrix.hold(held);
      const bool is_positive = matrix.factor();
      assert(is_positive);
      if (!is_positive) continue;
      Eigen::MatrixXd ways = loads;
      matrix.solve_in_place(ways);
      work += ways.cwiseProduct(loads).sum();
    }
  }
  return work;
}

}  // namespace

template <int Dim>
double unlocking_factor(const ElementMesh<Dim>& tets, const ElementMesh<Dim>& boxes) {
  BodyOf<Dim> of_tets = make_body(tets, ElementBodyOptions{});
  const BodyOf<Dim> of_boxes = make_body(boxes, ElementBodyOptions{});
  of_tets.mass = of_boxes.mass;  // the same loads
  return compliance(of_tets) / compliance(of_boxes);
}

template double unlocking_factor<2>(const ElementMesh<2>&, const ElementMesh<2>&);
template double unlocking_factor<3>(const ElementMesh<3>&, const ElementMesh<3>&);

}  // namespace hydrostat::physics
