#pragma once

#include <gtest/gtest.h>

#include "physics/element_body.h"
#include "tests/physics/element_scene.h"
#include "tests/physics/method_cases.h"

namespace hydrostat::physics {

/// A body of random elements: of every cut and law, with springs or without, with dashpots or without.
template <int Dim>
BodyOf<Dim> random_element_body(unsigned seed, Cut cut, ElasticLaw law) {
  ElementBodyOptions options{law, seed % 2 == 0 ? 0.0 : 0.3, seed % 3 == 0 ? 0.0 : 0.002};
  return make_body(random_element_mesh<Dim>(seed, cut), options);
}

template <int Dim, class Look>
void for_random_element_bodies(unsigned seeds, const Look& look) {
  for (const Cut cut : cuts<Dim>()) {
    for (const ElasticLaw law : {ElasticLaw::kStableNeoHookean, ElasticLaw::kCorotatedLinear}) {
      for (unsigned seed = 0; seed < seeds; ++seed) {
        SCOPED_TRACE(name_of(cut) + ", " + name_of(law) + ", seed " + std::to_string(seed));
        std::mt19937 random(seed);
        const BodyOf<Dim> body = random_element_body<Dim>(seed, cut, law);
        look(body, random);
      }
    }
  }
}

/// The cantilever of the peer benchmark: 1 m long, a quarter high and wide, held where x = 0.
template <int Dim>
SceneOf<Dim> cantilever(int cells_along, int cells_across, Cut cut, const ElementMaterial& material) {
  Eigen::Matrix<int, Dim, 1> cells = Eigen::Matrix<int, Dim, 1>::Constant(cells_across);
  Eigen::Matrix<double, Dim, 1> size = Eigen::Matrix<double, Dim, 1>::Constant(0.25);
  cells[0] = cells_along;
  size[0] = 1;
  BodyOf<Dim> body = make_body(element_bar<Dim>(cells, size, cut, material), ElementBodyOptions{});
  for (int i = 0; i < body.node_count(); ++i) {
    if (body.rest(0, i) < 1e-9) body.held.push_back(i);
  }
  return in_the_air(std::move(body), true);
}

}  // namespace hydrostat::physics
