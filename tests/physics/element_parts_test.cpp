#include "physics/element_parts.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstring>

#include "physics/internal_forces.h"
#include "tests/physics/element_method_scene.h"

namespace hydrostat::physics::element_parts_test {
namespace {

TEST(WorkerTeam, DoesEveryPartOfEveryRoundOnce) {
  for (int threads = 1; threads <= 4; ++threads) {
    SCOPED_TRACE("threads " + std::to_string(threads));
    WorkerTeam team(threads);
    std::vector<std::atomic<int>> count(9);
    const int rounds = trials(2000);
    for (int round = 0; round < rounds; ++round) {
      const int parts = round % 10;
      team.share(parts, [&](int part) { ++count[static_cast<std::size_t>(part)]; });
      for (int part = 0; part < 9; ++part) {
        ASSERT_EQ(count[static_cast<std::size_t>(part)].exchange(0), part < parts ? 1 : 0)
            << "round " << round << ", part " << part;
      }
    }
  }
}

/// A plate of 5,400 triangles whose numbers are shuffled, so that every part has nodes everywhere, or as they come.
BodyOf<2> plate(bool is_shuffled) {
  ElementMesh<2> mesh = element_bar<2>({60, 45}, {0.6, 0.45}, Cut::kTwoTriangles);
  if (is_shuffled) {
    std::mt19937 random(1);
    const Eigen::MatrixXi nodes = mesh.nodes;
    std::vector<int> order(static_cast<std::size_t>(nodes.cols()));
    for (std::size_t k = 0; k < order.size(); ++k) order[k] = static_cast<int>(k);
    std::shuffle(order.begin(), order.end(), random);
    for (std::size_t k = 0; k < order.size(); ++k) mesh.nodes.col(static_cast<Eigen::Index>(k)) = nodes.col(order[k]);
  }
  return make_body(mesh, ElementBodyOptions{});
}

TEST(ElementParts, GiveTheSameBytesForAnyNumberOfThreads) {
  for (const bool is_shuffled : {false, true}) {
    SCOPED_TRACE(is_shuffled ? "shuffled" : "in order");
    const BodyOf<2> body = plate(is_shuffled);
    std::mt19937 random(2);
    const PointsOf<2> x = body.rest + random_points<2>(random, body.node_count(), 0.002);
    const Eigen::VectorXd activation = random_activation(random, body, 0.1);
    InternalForces<2> alone(body, 1);
    ASSERT_TRUE(alone.set_activation(activation));
    PointsOf<2> expected = PointsOf<2>::Zero(2, body.node_count());
    alone.add_elastic_forces(x, expected);
    ActiveStrain<2> active = make_active_strain(body.elements[0].block);
    ASSERT_TRUE(set_activation(body.elements[0].fit, activation, active));
    EXPECT_LT((expected - forces_of<2>(body.elements[0].block, x, &active)).norm(), 1e-12 * expected.norm());
    EXPECT_NEAR(alone.elastic_energy(x) / energy_of<2>(body.elements[0].block, x, &active), 1, 1e-12);
    for (const int threads : {2, 3, 8}) {
      InternalForces<2> shared(body, threads);
      ASSERT_TRUE(shared.set_activation(activation));
      for (int repeat = 0; repeat < trials(20); ++repeat) {
        PointsOf<2> force = PointsOf<2>::Zero(2, body.node_count());
        shared.add_elastic_forces(x, force);
        ASSERT_EQ(std::memcmp(force.data(), expected.data(), sizeof(double) * static_cast<std::size_t>(force.size())), 0)
            << threads << " threads";
        ASSERT_EQ(shared.elastic_energy(x), alone.elastic_energy(x)) << threads << " threads";
      }
    }
  }
}

}  // namespace
}  // namespace hydrostat::physics::element_parts_test
