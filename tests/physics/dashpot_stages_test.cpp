#include "physics/dashpot_stages.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <unsupported/Eigen/MatrixFunctions>

#include "physics/system_matrix.h"
#include "tests/physics/lattice_scene.h"

namespace hydrostat::physics::dashpot_stages_test {
namespace {

constexpr unsigned kSeeds = 8;

template <typename Dimension>
class Stages : public testing::Test {};
TYPED_TEST_SUITE(Stages, BothDimensions, DimensionName);

/// A bent body that moves anyhow under forces from anywhere, so slowly that it does not turn.
template <int Dim>
struct Moving {
  explicit Moving(unsigned seed) : random(seed), body(random_body<Dim>(seed)) {
    x = random_rotation<Dim>(random) * body.rest + random_points<Dim>(random, body.node_count(), 0.01);
    v = random_points<Dim>(random, body.node_count(), 1e-10);
    force = random_points<Dim>(random, body.node_count(), 2e-9);
  }
  /// M^-1 D [1/s].
  Eigen::MatrixXd rates() const {
    SystemMatrixOf<Dim> matrix(body);
    matrix.set_zero();
    matrix.add_damping(body, x, 1);
    Eigen::MatrixXd damping = matrix.lower().template selfadjointView<Eigen::Lower>() * Eigen::MatrixXd::Identity(x.size(), x.size());
    for (Eigen::Index k = 0; k < damping.rows(); ++k) damping.row(k) /= body.mass[k / Dim];
    return damping;
  }
  double largest_rate() const { return rates().eigenvalues().real().maxCoeff(); }
  PointsOf<Dim> velocity_after(double h, int stages, const PointsOf<Dim>& from) const {
    DashpotStages<Dim> dashpots(body);
    PointsOf<Dim> mean = force;
    dashpots.add_mean_forces(x, from, h, stages, mean);
    return from + h * mean * body.mass.cwiseInverse().asDiagonal();
  }

  std::mt19937 random;
  BodyOf<Dim> body;
  PointsOf<Dim> x, v, force;  // [m], [m/s], [N]
};

TYPED_TEST(Stages, ChangeNeitherMomentumWhateverTheirNumberAndTheSubstep) {
  constexpr int Dim = TypeParam::kDim;
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    Moving<Dim> moving(seed);
    const double rate = moving.largest_rate();
    DashpotStages<Dim> dashpots(moving.body);
    for (const int stages : {3, 5, 7, 15, 31}) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", stages " + std::to_string(stages));
      PointsOf<Dim> mean = moving.force;
      dashpots.add_mean_forces(moving.x, 1e10 * moving.v, 0.8 * DashpotStages<Dim>::reach(stages) / rate, stages, mean);
      const PointsOf<Dim> pulls = mean - moving.force;
      SpinOf<Dim> moment = SpinOf<Dim>::Zero();
      for (int i = 0; i < moving.body.node_count(); ++i) moment += cross<Dim>(moving.x.col(i), pulls.col(i));
      EXPECT_GT(pulls.norm(), 0.1);
      EXPECT_LT(pulls.rowwise().sum().norm(), 1e-11 * pulls.norm());
      EXPECT_LT(moment.norm(), 1e-11 * pulls.norm());
    }
  }
}

TYPED_TEST(Stages, ComeNearWhatDashpotsDoByTheSquareOfTheSubstep) {
  constexpr int Dim = TypeParam::kDim;
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    const Moving<Dim> moving(seed);
    const Eigen::MatrixXd rates = moving.rates();
    const double duration = 4 / moving.largest_rate();
    // v' = a - A v as one linear system with the acceleration a in its last column.
    Eigen::MatrixXd system = Eigen::MatrixXd::Zero(rates.rows() + 1, rates.rows() + 1);
    system.topLeftCorner(rates.rows(), rates.rows()) = -rates;
    const PointsOf<Dim> acceleration = moving.force * moving.body.mass.cwiseInverse().asDiagonal();
    system.topRightCorner(rates.rows(), 1) = acceleration.reshaped();
    Eigen::VectorXd start(rates.rows() + 1);
    start << moving.v.reshaped(), 1;
    const Eigen::VectorXd exact = ((duration * system).exp() * start).head(rates.rows());
    for (const int stages : {3, 7}) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", stages " + std::to_string(stages));
      const auto error_in = [&](int parts) {
        PointsOf<Dim> v = moving.v;
        for (int k = 0; k < parts; ++k) v = moving.velocity_after(duration / parts, stages, v);
        return (v.reshaped() - exact).norm();
      };
      const double error = error_in(16);
      EXPECT_LT(error, 5e-3 * exact.norm());
      EXPECT_NEAR(std::log2(error / error_in(32)), 2, 0.2);
    }
  }
}

TYPED_TEST(Stages, LeaveAMotionInWhichDashpotsBalanceTheForces) {
  constexpr int Dim = TypeParam::kDim;
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    Moving<Dim> moving(seed);
    moving.force.setZero();
    add_damping_forces<Dim>(moving.body, moving.x, moving.v, moving.force);
    moving.force *= -1;
    const double rate = moving.largest_rate();
    for (const int stages : {3, 9, 15}) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", stages " + std::to_string(stages));
      const PointsOf<Dim> v = moving.velocity_after(0.9 * DashpotStages<Dim>::reach(stages) / rate, stages, moving.v);
      EXPECT_LT((v - moving.v).norm(), 1e-10 * moving.v.norm());
    }
  }
}

TYPED_TEST(Stages, TurnABodyWithoutStretchingIt) {
  constexpr int Dim = TypeParam::kDim;
  constexpr double kTurn = 0.05;  // a substep
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    for (const int stages : {3, 5, 15}) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", stages " + std::to_string(stages));
      Moving<Dim> moving(seed);
      moving.body.edge_damping = Eigen::VectorXd::Ones(moving.body.edge_count());
      moving.x = moving.body.rest;
      const double h = 0.8 * DashpotStages<Dim>::reach(stages) / moving.largest_rate();
      const SpinOf<Dim> rate = kTurn / h * random_spin<Dim>(moving.random, 1).normalized();
      DashpotStages<Dim> dashpots(moving.body);
      PointsOf<Dim> x = moving.body.rest;
      // What holds it together meanwhile is as much as it pulls outward, so that dashpots alone are to be seen.
      const VectorOf<Dim> centre = centre_of_mass(moving.body, x);
      PointsOf<Dim> v = rigid_velocity<Dim>(moving.body, x, VectorOf<Dim>::Zero(), rate);
      for (int k = 0; k < 100; ++k) {
        PointsOf<Dim> mean(Dim, x.cols());
        for (int i = 0; i < x.cols(); ++i) {
          mean.col(i) = moving.body.mass[i] * turning<Dim>(rate, turning<Dim>(rate, x.col(i) - centre));
        }
        if (k == 0) v -= 0.5 * h * mean * moving.body.mass.cwiseInverse().asDiagonal();  // half a substep before
        dashpots.add_mean_forces(x, v, h, stages, mean);
        v += h * mean * moving.body.mass.cwiseInverse().asDiagonal();
        x += h * v;
      }
      for (int e = 0; e < moving.body.edge_count(); ++e) {
        const double length = (x.col(moving.body.edges(1, e)) - x.col(moving.body.edges(0, e))).norm();
        EXPECT_NEAR(length, moving.body.rest_length[e], 0.003 * moving.body.rest_length[e]);  // straight on they would grow by an eighth
      }
    }
  }
}

/// By what one substep makes of the motion of two nodes that one dashpot ties: of the product z of substep and rate.
double share_left(double z, int stages) {
  BodyOf<2> body;
  body.rest = PointsOf<2>{{0, 1}, {0, 0}};
  body.mass = Eigen::Vector2d(2, 2);
  body.edges = Eigen::Matrix2Xi{{0}, {1}};
  body.rest_length = body.edge_damping = Eigen::VectorXd::Ones(1);
  DashpotStages<2> dashpots(body);
  const PointsOf<2> v{{-1, 1}, {0, 0}};
  PointsOf<2> force = PointsOf<2>::Zero(2, 2);
  dashpots.add_mean_forces(body.rest, v, z, stages, force);  // the rate is 1/s
  return 1 + z * force(0, 1) / 2;
}

TEST(Stages, BrakeWithoutTurningAMotionRoundAndLeaveTheElasticSubstepItsLength) {
  for (int stages = 3; stages <= 31; stages += 2) {
    SCOPED_TRACE("stages " + std::to_string(stages));
    const double reach = DashpotStages<2>::reach(stages);
    for (int k = 1; k <= 400; ++k) {
      const double z = reach * k / 400, left = share_left(z, stages), phi = (1 - left) / z;
      ASSERT_GT(left, 0) << z;
      ASSERT_LT(left, 1) << z;
      ASSERT_GT(2 / phi - z, 2 - 1e-9) << z;
    }
    EXPECT_GT(std::abs(share_left(1.5 * reach, stages)), 1);  // no more than it says
  }
}

TYPED_TEST(Stages, LeaveHeldNodesTheirVelocityAndTellWhatPullsAtThem) {
  constexpr int Dim = TypeParam::kDim;
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Moving<Dim> moving(seed);
    moving.body.held = {0, 2};
    moving.v.col(0).setZero();
    moving.v.col(2).setZero();
    const double h = 6 / moving.largest_rate();
    DashpotStages<Dim> dashpots(moving.body);
    PointsOf<Dim> mean = moving.force;
    dashpots.add_mean_forces(moving.x, moving.v, h, 9, mean);
    // The same with held nodes that are too heavy to move.
    moving.body.held.clear();
    moving.body.mass[0] = moving.body.mass[2] = 1e12;
    PointsOf<Dim> heavy = moving.force;
    DashpotStages<Dim>(moving.body).add_mean_forces(moving.x, moving.v, h, 9, heavy);
    EXPECT_LT((mean - heavy).norm(), 1e-8 * mean.norm());
  }
}

TYPED_TEST(Stages, TellHowMuchMoreTheyBrakeInAnotherShapeOfTheBody) {
  constexpr int Dim = TypeParam::kDim;
  std::mt19937 random(1);
  const BodyOf<Dim> body = bar<Dim>(4, 2, 2, 0.1);
  DashpotStages<Dim> dashpots(body);
  EXPECT_NEAR(dashpots.stiffening(random_rotation<Dim>(random) * body.rest), 1, 1e-12);
  EXPECT_NEAR(dashpots.stiffening(2 * body.rest), 1, 1e-12);
  const VectorOf<Dim> line = random_points<Dim>(random, 1, 1).col(0).normalized();
  EXPECT_GT(dashpots.stiffening(line * line.transpose() * body.rest), 1.3);  // all edges lie along one line
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Moving<Dim> moving(seed);
    for (const double amplitude : {0.02, 0.05}) {
      const double at_rest = [&] {
        moving.x = moving.body.rest;
        return moving.largest_rate();
      }();
      moving.x += random_points<Dim>(moving.random, moving.body.node_count(), amplitude);
      // An estimate: the margin of the substep is for what it lacks.
      EXPECT_LT(moving.largest_rate(), 1.25 * at_rest * DashpotStages<Dim>(moving.body).stiffening(moving.x));
    }
  }
}

}  // namespace
}  // namespace hydrostat::physics::dashpot_stages_test
