#include "physics/body.h"

#include <gtest/gtest.h>

#include <map>

#include "physics/face_key.h"
#include "tests/physics/lattice_scene.h"

namespace hydrostat::physics::body_test {
namespace {

template <typename Dimension>
class MakeBody : public testing::Test {};
TYPED_TEST_SUITE(MakeBody, BothDimensions, DimensionName);
template <typename Dimension>
class WholeBody : public testing::Test {};
TYPED_TEST_SUITE(WholeBody, BothDimensions, DimensionName);

TYPED_TEST(MakeBody, HoldsTheMassAndVolumeOfWhatFillsTheLattice) {
  constexpr int Dim = TypeParam::kDim;
  const Lattice<Dim> lattice = make_lattice<Dim>(3, 2, 4, 0.1);
  Material material;
  material.density = 800;
  const Eigen::VectorXd half = Eigen::VectorXd::Constant(lattice.tets.cols(), 0.5);
  const BodyOf<Dim> body = make_body<Dim>(lattice.nodes, lattice.tets, lattice.edges, half, material);
  const double whole = Dim == 3 ? 0.024 : 0.06;            // [m3]; in 2D one metre deep
  EXPECT_NEAR(body.rest_volume.sum(), whole, 1e-15);       // of the whole tets
  EXPECT_NEAR(body.mass.sum(), 0.5 * 800 * whole, 1e-12);  // [kg] of the filled half
  EXPECT_NEAR(volume(body, body.rest), whole, 1e-15);
  EXPECT_GT(body.mass.minCoeff(), 0);
}

TYPED_TEST(MakeBody, SharesEachTetsVolumeAmongItsEdges) {
  constexpr int Dim = TypeParam::kDim;
  for (unsigned seed = 0; seed < trials(20u); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const BodyOf<Dim> body = random_body<Dim>(seed);
    const Material material;
    // k l0^2 = n E V_e, and the V_e add up to the filled volume, which the masses know.
    const double energy = body.edge_stiffness.dot(body.rest_length.cwiseAbs2().matrix());
    EXPECT_NEAR(energy / (kEdgesPerTet<Dim> * material.youngs_modulus * body.mass.sum() / material.density), 1, 1e-12);
    EXPECT_LT((body.edge_damping - material.damping_time * body.edge_stiffness).norm(), 1e-9);
  }
}

TYPED_TEST(MakeBody, NamesTheEdgesOfEachTet) {
  constexpr int Dim = TypeParam::kDim;
  const BodyOf<Dim> body = random_body<Dim>(5);
  const std::vector<std::pair<int, int>> ends =
      Dim == 3 ? std::vector<std::pair<int, int>>{{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}
               : std::vector<std::pair<int, int>>{{0, 1}, {0, 2}, {1, 2}};
  for (int t = 0; t < body.tet_count(); ++t) {
    for (int k = 0; k < kEdgesPerTet<Dim>; ++k) {
      const auto [low, high] = std::minmax(body.tets(ends[k].first, t), body.tets(ends[k].second, t));
      EXPECT_EQ(body.edges(0, body.tet_edges(k, t)), low);
      EXPECT_EQ(body.edges(1, body.tet_edges(k, t)), high);
    }
  }
}

TYPED_TEST(MakeBody, ResistsEvenStretchAsASolidOfItsYoungsModulusAndPoissonsRatioOfAQuarterOrAThird) {
  constexpr int Dim = TypeParam::kDim;
  constexpr double kStretch = 1e-5;
  Material material;
  material.bulk_factor = 0;  // springs alone
  const BodyOf<Dim> body = bar<Dim>(3, 3, 3, 0.1, material);
  // Energy of a dilation: 9/2 K e^2 a volume with K = E / (3 (1 - 2 nu)), in plane stress 2 K e^2 with K = E / (2 (1 - nu)).
  const double expected = (Dim == 3 ? 3.0 : 1.5) * material.youngs_modulus * kStretch * kStretch * body.rest_volume.sum();
  EXPECT_NEAR(elastic_energy(body, (1 + kStretch) * body.rest, passive(body)) / expected, 1, 1e-9);
}

TYPED_TEST(WholeBody, HasOneKeyForBothSidesOfAFaceAndASurfaceOfWhatHasOneSide) {
  constexpr int Dim = TypeParam::kDim;
  const BodyOf<Dim> body = random_body<Dim>(3);
  std::map<std::array<int, Dim>, int> sides;
  for (int t = 0; t < body.tet_count(); ++t) {
    for (int opposite = 0; opposite <= Dim; ++opposite) ++sides[key_of_face<Dim>(body, {t, opposite})];
  }
  std::size_t outer = 0;
  for (const auto& [key, count] : sides) {
    EXPECT_TRUE(std::is_sorted(key.begin(), key.end()));
    EXPECT_LE(count, 2);
    outer += count == 1;
  }
  const std::vector<SurfaceFace> surface = surface_faces(body);
  EXPECT_EQ(surface.size(), outer);
  EXPECT_LT(outer, sides.size());
  for (const SurfaceFace& face : surface) EXPECT_EQ(sides[key_of_face(body, face)], 1);
}

TYPED_TEST(WholeBody, HasTheJacobiansOfAnAffineMap) {
  constexpr int Dim = TypeParam::kDim;
  for (unsigned seed = 0; seed < trials(20u); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const BodyOf<Dim> body = random_body<Dim>(seed);
    const BlockOf<Dim> map = BlockOf<Dim>::Identity() + random_points<Dim>(random, Dim, 0.4);
    const Eigen::VectorXd jacobian = jacobians(body, map * body.rest);
    EXPECT_LT((jacobian.array() - map.determinant()).abs().maxCoeff(), 1e-12);
    EXPECT_NEAR(volume(body, map * body.rest), map.determinant() * volume(body, body.rest), 1e-14);
  }
}

TYPED_TEST(WholeBody, HasTheAngularMomentumOfItsInertiaTimesItsRateOfTurning) {
  constexpr int Dim = TypeParam::kDim;
  for (unsigned seed = 0; seed < trials(20u); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const BodyOf<Dim> body = random_body<Dim>(seed);
    const SpinOf<Dim> rate = random_spin<Dim>(random, 5);
    const VectorOf<Dim> drift = random_points<Dim>(random, 1, 2), about = random_points<Dim>(random, 1, 1);
    const VectorOf<Dim> centre = centre_of_mass(body, body.rest);
    const PointsOf<Dim> v = rigid_velocity<Dim>(body, body.rest, drift, rate);
    EXPECT_LT((momentum(body, v) - body.mass.sum() * drift).norm(), 1e-11);
    const SpinOf<Dim> expected =
        inertia(body, body.rest, centre) * rate + body.mass.sum() * cross<Dim>(centre - about, drift);
    EXPECT_LT((angular_momentum(body, body.rest, v, about) - expected).norm(), 1e-11);
  }
}

}  // namespace
}  // namespace hydrostat::physics::body_test
