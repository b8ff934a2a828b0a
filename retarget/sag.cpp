#include "retarget/sag.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "physics/element_body.h"
#include "physics/system_matrix.h"
#include "retarget/contacts.h"

namespace hydrostat::retarget {
namespace {

constexpr int kMoments = 12;  // at least, of a plan that has so many frames

/// Those that carry a point which touches in frame f.
std::vector<int> nodes_that_stand(const physics::ContactPoints& points, const ContactSchedule& contacts, Eigen::Index f) {
  std::set<int> nodes;
  for (Eigen::Index p = 0; p < contacts.touching.rows(); ++p) {
    if (!contacts.touching(p, f)) continue;
    for (Eigen::Index c = 0; c < points.nodes.rows(); ++c) {
      if (points.weights(c, p) != 0) nodes.insert(points.nodes(c, p));
    }
  }
  return {nodes.begin(), nodes.end()};
}

}  // namespace

double sag(const physics::Scene& scene, const PreparedTarget& prepared, double length) {
  const physics::Body& body = scene.body;
  if (scene.gravity.isZero(0)) return 0;
  const Eigen::VectorXd at_rest = Eigen::VectorXd::Ones(body.edge_count());
  physics::SystemMatrix stiffness(body);
  const Eigen::Index frames = prepared.target.count(), stride = std::max<Eigen::Index>(1, frames / kMoments);
  std::vector<double> sags;
  for (Eigen::Index f = 0; f < frames; f += stride) {
    const std::vector<int> standing = nodes_that_stand(scene.contact_points, prepared.contacts, f);
    if (standing.empty()) continue;
    stiffness.set_zero();
    stiffness.add_stiffness(body, prepared.target.at(f), at_rest, 1);
    stiffness.hold(standing);
    if (!stiffness.factor()) continue;
    const Eigen::VectorXd weight = (scene.gravity * body.mass.transpose()).reshaped();
    Eigen::MatrixXd sunk = weight;
    for (const int node : standing) sunk.middleRows<3>(3 * node).setZero();
    stiffness.solve_in_place(sunk);
    sags.push_back(weight.dot(sunk.col(0)) / (body.mass.sum() * scene.gravity.norm() * length));
  }
  if (sags.empty()) return 0;
  const auto middle = sags.begin() + static_cast<std::ptrdiff_t>(sags.size() / 2);
  std::nth_element(sags.begin(), middle, sags.end());
  return *middle;
}

double stiffness_to_bear(double sag) { return std::clamp(sag / kMostSag, 1.0, kMostStiffening); }

void stiffen(double factor, physics::Body& body) {
  body.edge_stiffness *= factor;
  body.volume_stiffness *= factor;
  body.edge_damping *= factor;
  for (physics::BodyElements<3>& elements : body.elements) {
    physics::ElementMesh<3> mesh = physics::mesh_of(body, elements);
    for (physics::ElementMaterial& material : mesh.materials) material.youngs_modulus *= factor;
    elements = physics::make_body_elements(mesh, elements.block.law);
  }
}

}  // namespace hydrostat::retarget
