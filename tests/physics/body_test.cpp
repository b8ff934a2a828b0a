#include "physics/body.h"

#include <gtest/gtest.h>

#include "tests/physics/lattice_scene.h"

namespace hydrostat::physics {
namespace {

TEST(MakeBody, HoldsTheMassAndVolumeOfWhatFillsTheLattice) {
  const Lattice lattice = make_lattice(3, 2, 4, 0.1);
  Material material;
  material.density = 800;
  const Body body =
      make_body(lattice.nodes, lattice.tets, lattice.edges, Eigen::VectorXd::Constant(lattice.tets.cols(), 0.5), material);
  EXPECT_NEAR(body.rest_volume.sum(), 0.024, 1e-15);       // [m3] of the whole tets
  EXPECT_NEAR(body.mass.sum(), 0.5 * 800 * 0.024, 1e-12);  // [kg] of the filled half
  EXPECT_NEAR(volume(body, body.rest), 0.024, 1e-15);
  EXPECT_GT(body.mass.minCoeff(), 0);
}

TEST(MakeBody, SharesEachTetsVolumeAmongItsSixEdges) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Body body = random_body(seed);
    const Material material;
    // k l0^2 = 6 E V_e, and the V_e add up to the filled volume, which the masses know.
    const double energy = body.edge_stiffness.dot(body.rest_length.cwiseAbs2().matrix());
    EXPECT_NEAR(energy / (6 * material.youngs_modulus * body.mass.sum() / material.density), 1, 1e-12);
    EXPECT_LT((body.edge_damping - material.damping_time * body.edge_stiffness).norm(), 1e-9);
  }
}

TEST(MakeBody, NamesTheSixEdgesOfEachTet) {
  const Body body = random_body(5);
  constexpr int kEnds[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};
  for (int t = 0; t < body.tet_count(); ++t) {
    for (int k = 0; k < 6; ++k) {
      const auto [low, high] = std::minmax(body.tets(kEnds[k][0], t), body.tets(kEnds[k][1], t));
      EXPECT_EQ(body.edges(0, body.tet_edges(k, t)), low);
      EXPECT_EQ(body.edges(1, body.tet_edges(k, t)), high);
    }
  }
}

TEST(Jacobians, AreTheDeterminantOfAnAffineMap) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const Body body = random_body(seed);
    const Eigen::Matrix3d map = Eigen::Matrix3d::Identity() + random_points(random, 3, 0.4);
    const Eigen::VectorXd jacobian = jacobians(body, map * body.rest);
    EXPECT_LT((jacobian.array() - map.determinant()).abs().maxCoeff(), 1e-12);
    EXPECT_NEAR(volume(body, map * body.rest), map.determinant() * volume(body, body.rest), 1e-14);
  }
}

TEST(AngularMomentum, OfARigidTurnIsInertiaTimesItsRate) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const Body body = random_body(seed);
    const Eigen::Vector3d rate = random_points(random, 1, 5), drift = random_points(random, 1, 2),
                          about = random_points(random, 1, 1);
    const Eigen::Vector3d centre = centre_of_mass(body, body.rest);
    Eigen::Matrix3Xd v(3, body.node_count());
    for (int i = 0; i < body.node_count(); ++i) v.col(i) = drift + rate.cross(body.rest.col(i) - centre);
    EXPECT_LT((momentum(body, v) - body.mass.sum() * drift).norm(), 1e-12);
    const Eigen::Vector3d expected =
        inertia(body, body.rest, centre) * rate + body.mass.sum() * (centre - about).cross(drift);
    EXPECT_LT((angular_momentum(body, body.rest, v, about) - expected).norm(), 1e-11);
  }
}

}  // namespace
}  // namespace hydrostat::physics
