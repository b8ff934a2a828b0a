#include "retarget/scenario.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace hydrostat::retarget {

constexpr double kCollapse = 1e-3;

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
physics::BodyOf<Dim> make_spring_body(const physics::ElementMesh<Dim>& mesh, double damping_time) {
  const physics::SimplexMeshOf<Dim> simplices{mesh.rest, mesh.nodes};
  const Eigen::Matrix2Xi edges = physics::edges_of(simplices);
  const auto& materials = mesh.materials;
  // All that a body is made of adds up over its simplices, so that it is the sum of one body a material.
  std::vector<std::size_t> firsts;
  const auto is_alike = [&](std::size_t a, std::size_t b) {
    return materials[a].density == materials[b].density && materials[a].youngs_modulus == materials[b].youngs_modulus &&
           materials[a].poissons_ratio == materials[b].poissons_ratio;
  };
  for (std::size_t t = 0; t < materials.size(); ++t) {
    if (std::none_of(firsts.begin(), firsts.end(), [&](std::size_t first) { return is_alike(first, t); })) firsts.push_back(t);
  }
  physics::BodyOf<Dim> body;
  for (const std::size_t first : firsts) {
    Eigen::VectorXd fill = mesh.fill;
    for (std::size_t t = 0; t < materials.size() && materials.size() > 1; ++t) {
      if (!is_alike(first, t)) fill[static_cast<Eigen::Index>(t)] = 0;
    }
    physics::BodyOf<Dim> part = physics::make_body<Dim>(mesh.rest, simplices.simplices, edges, fill,
                                                        spring_material<Dim>(materials[first], damping_time));
    if (first == firsts.front()) {
      body = std::move(part);
      continue;
    }
    body.mass += part.mass;
    body.edge_stiffness += part.edge_stiffness;
    body.edge_damping += part.edge_damping;
    body.volume_stiffness += part.volume_stiffness;
  }
  return body;
}

void hold_at(const std::vector<Clamp>& clamps, double time_s, std::vector<int>& held) {
  held.clear();
  for (const Clamp& clamp : clamps) {
    if (time_s < clamp.until_s) held.insert(held.end(), clamp.nodes.begin(), clamp.nodes.end());
  }
  std::sort(held.begin(), held.end());
  held.erase(std::unique(held.begin(), held.end()), held.end());
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
  // Not a distribution of the library's, whose numbers are its own affair.
  const auto within_box = [&]() -> physics::VectorOf<Dim> {
    physics::VectorOf<Dim> place;
    for (int d = 0; d < Dim; ++d) place[d] = low[d] + (high[d] - low[d]) * (static_cast<double>(random()) / 4294967296.0);
    return place;
  };
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    switch (shape) {
      case StartShape::kRest:
        break;
      case StartShape::kRandom:
        x.col(i) = within_box();
        break;
      case StartShape::kCollapsed:
        x.col(i) = middle + kCollapse * (within_box() - middle);
        break;
      case StartShape::kFlattened:
        x(1, i) = middle.y();
        break;
    }
  }
}

#define HYDROSTAT_INSTANTIATE(Dim)                                                                                      \
  template physics::Material spring_material<Dim>(const physics::ElementMaterial&, double);                             \
  template physics::BodyOf<Dim> make_spring_body<Dim>(const physics::ElementMesh<Dim>&, double);                         \
  template void distort<Dim>(StartShape, unsigned, physics::PointsOf<Dim>&);
HYDROSTAT_INSTANTIATE(2)
HYDROSTAT_INSTANTIATE(3)
#undef HYDROSTAT_INSTANTIATE

}  // namespace hydrostat::retarget
