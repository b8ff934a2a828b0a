#include "retarget/scenario.h"

#include <cmath>
#include <random>

namespace hydrostat::retarget {

template <int Dim>
physics::Material spring_material(const physics::ElementMaterial& material, double damping_time) {
  const physics::Lame lame = physics::lame_of(material.youngs_modulus, material.poissons_ratio);
  // Young's modulus of the lattice alone: of lambda = mu in 3D; in the plane, where it has no third direction to give way.
  physics::Material springs;
  springs.density = material.density;
  springs.youngs_modulus = (Dim == 3 ? 5.0 / 2 : 8.0 / 3) * lame.mu;
  springs.bulk_factor = (lame.lambda - lame.mu) / springs.youngs_modulus;
  springs.damping_time = damping_time;
  return springs;
}

template <int Dim>
physics::BodyOf<Dim> make_spring_body(const physics::SimplexMeshOf<Dim>& mesh,
                                      const std::vector<physics::ElementMaterial>& materials,
                                      const Eigen::VectorXi& material_of, double damping_time) {
  const Eigen::Matrix2Xi edges = physics::edges_of(mesh);
  physics::BodyOf<Dim> body;
  // All that a body is made of adds up over its simplices, so that it is the sum of one body a material.
  for (std::size_t m = 0; m < materials.size(); ++m) {
    const Eigen::VectorXd fill = (material_of.array() == static_cast<int>(m)).template cast<double>();
    const physics::BodyOf<Dim> part =
        physics::make_body<Dim>(mesh.nodes, mesh.simplices, edges, fill, spring_material<Dim>(materials[m], damping_time));
    if (m == 0) {
      body = part;
      continue;
    }
    body.mass += part.mass;
    body.edge_stiffness += part.edge_stiffness;
    body.edge_damping += part.edge_damping;
    body.volume_stiffness += part.volume_stiffness;
  }
  return body;
}

void activations_at(const std::vector<Wave>& waves, double time_s, Eigen::VectorXd& activation) {
  activation.setOnes();
  for (const Wave& wave : waves) {
    if (time_s < wave.from_s || time_s >= wave.until_s) continue;
    const double turn = 2 * M_PI * wave.frequency_hz * time_s;
    for (Eigen::Index e = 0; e < activation.size(); ++e) {
      if (wave.share[e] == 0) continue;
      const double sine = std::sin(turn + wave.phase[e]);
      activation[e] += wave.share[e] * (wave.offset + wave.amplitude * (wave.is_square ? (sine < 0 ? -1 : 1) : sine));
    }
  }
}

template <int Dim>
void distort(StartShape shape, unsigned seed, physics::PointsOf<Dim>& x) {
  const physics::VectorOf<Dim> low = x.rowwise().minCoeff(), high = x.rowwise().maxCoeff(), middle = (low + high) / 2;
  std::mt19937 random(seed);
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    switch (shape) {
      case StartShape::kRest:
        break;
      case StartShape::kRandom:
        // Not a distribution of the library's, whose numbers are its own affair.
        for (int d = 0; d < Dim; ++d) x(d, i) = low[d] + (high[d] - low[d]) * (static_cast<double>(random()) / 4294967296.0);
        break;
      case StartShape::kCollapsed:
        x.col(i) = middle;
        break;
      case StartShape::kFlattened:
        x(1, i) = middle.y();
        break;
    }
  }
}

#define HYDROSTAT_INSTANTIATE(Dim)                                                                                      \
  template physics::Material spring_material<Dim>(const physics::ElementMaterial&, double);                             \
  template physics::BodyOf<Dim> make_spring_body<Dim>(const physics::SimplexMeshOf<Dim>&,                               \
                                                      const std::vector<physics::ElementMaterial>&,                     \
                                                      const Eigen::VectorXi&, double);                                  \
  template void distort<Dim>(StartShape, unsigned, physics::PointsOf<Dim>&);
HYDROSTAT_INSTANTIATE(2)
HYDROSTAT_INSTANTIATE(3)
#undef HYDROSTAT_INSTANTIATE

}  // namespace hydrostat::retarget
