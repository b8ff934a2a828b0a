#include "retarget/contact_cones.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>
#include <string>

#include "tests/retarget/box_creature.h"
#include "tests/sanitizers.h"

namespace hydrostat::retarget::contact_cones_test {
namespace {

constexpr double kWeight = 30;

struct Problem {
  Eigen::MatrixXd hessian, rows;
  Eigen::VectorXd b;
};

Eigen::MatrixXd random_matrix(std::mt19937& random, Eigen::Index rows, Eigen::Index columns) {
  std::normal_distribution<double> normal;
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return normal(random); });
}

Problem random_problem(unsigned seed) {
  std::mt19937 random(seed);
  const Eigen::Index muscles = 1 + static_cast<Eigen::Index>(random() % 12),
                     sides = static_cast<Eigen::Index>(random() % 30);
  const Eigen::MatrixXd root = random_matrix(random, muscles, muscles);
  Problem problem;
  problem.hessian = root * root.transpose() + 0.1 * Eigen::MatrixXd::Identity(muscles, muscles);
  problem.b = random_matrix(random, muscles, 1);
  problem.rows = random_matrix(random, sides, muscles + 1);
  return problem;
}

TEST(ContactCones, SolutionsAreMinima) {
  for (unsigned seed = 0; seed < 300; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Problem p = random_problem(seed);
    const Eigen::Index muscles = p.b.size();
    const Eigen::VectorXd w = solve_within_cones(p.hessian, p.b, p.rows, kWeight);
    const Eigen::VectorXd excess = (p.rows.leftCols(muscles) * w + p.rows.col(muscles)).cwiseMin(0);
    const Eigen::VectorXd gradient = p.hessian * w - p.b + kWeight * kWeight * p.rows.leftCols(muscles).transpose() * excess;
    EXPECT_LT(gradient.norm(), 1e-8 * (1 + kWeight * kWeight * p.rows.squaredNorm() * (1 + w.norm())));
  }
}

// Here the second step ends inside all cones, with no row left to press; beside the two muscles that matter stand as many as
// a creature has.
TEST(ContactCones, AStepThatEndsInsideAllConesIsTaken) {
  Problem problem{Eigen::MatrixXd(2, 2), Eigen::MatrixXd(3, 3), Eigen::Vector2d(8, -3)};
  problem.hessian << 1, 0.9, 0.9, 1;
  problem.rows << 0, 3, -4, 1, 3, 0, 3, -3, 2;
  const Eigen::VectorXd few = solve_within_cones(problem.hessian, problem.b, problem.rows, 10);
  constexpr Eigen::Index kMuscles = 117;
  Problem many{Eigen::MatrixXd::Identity(kMuscles, kMuscles), Eigen::MatrixXd::Zero(3, kMuscles + 1),
               Eigen::VectorXd::Zero(kMuscles)};
  many.hessian.topLeftCorner<2, 2>() = problem.hessian;
  many.rows.leftCols<2>() = problem.rows.leftCols<2>();
  many.rows.rightCols<1>() = problem.rows.rightCols<1>();
  many.b.head<2>() = problem.b;
  const Eigen::VectorXd found = solve_within_cones(many.hessian, many.b, many.rows, 10);
  EXPECT_LT((found.head<2>() - few).norm(), 1e-12);
  EXPECT_TRUE(found.tail(kMuscles - 2).isZero(0));
}

TEST(ContactCones, NothingChangesInsideTheCones) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    Problem p = random_problem(seed);
    const Eigen::VectorXd free = p.hessian.llt().solve(p.b);
    p.rows.col(p.b.size()) = Eigen::VectorXd::Constant(p.rows.rows(), 0.01) - p.rows.leftCols(p.b.size()) * free;
    EXPECT_EQ(solve_within_cones(p.hessian, p.b, p.rows, kWeight),
              solve_within_cones(p.hessian, p.b, Eigen::MatrixXd(0, p.b.size() + 1), kWeight));
  }
}

struct Standing {
  BoxCreature creature = make_box_creature();
  int points = creature.scene.contact_points.count();
  double mu = creature.scene.ground.friction;
  std::vector<ContactState> touching = std::vector<ContactState>(static_cast<std::size_t>(points), ContactState::kStick);
  std::vector<bool> bearing = std::vector<bool>(static_cast<std::size_t>(points), true);
  Eigen::MatrixXd approach = Eigen::MatrixXd::Zero(3 * creature.scene.body.node_count(), 2);
  Eigen::VectorXd idle = Eigen::VectorXd::Zero(2);

  Eigen::MatrixXd rows(const Eigen::Matrix3Xd& force) const {
    Eigen::MatrixXd result;
    cone_rows(creature.scene, touching, bearing, force, approach, idle, result);
    return result;
  }
};

TEST(ContactCones, LeaveRoomInsideAndNoneOutside) {
  Standing s;
  for (unsigned seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    Eigen::Matrix3Xd force = random_matrix(random, 3, s.points);
    force.row(1) = force.row(1).cwiseAbs();
    for (int p = 0; p < s.points; ++p) {  // onto the cone
      const double sideways = std::hypot(force(0, p), force(2, p));
      const double share = 0.999 * s.mu * force(1, p) / sideways;
      force(0, p) *= share, force(2, p) *= share;
    }
    EXPECT_GT(s.rows(force).col(2).minCoeff(), 0);
    const int pulled = static_cast<int>(random() % static_cast<unsigned>(s.points));
    Eigen::Matrix3Xd pulls = force, slips = force;
    pulls(1, pulled) = -0.01;
    slips.col(pulled) *= 1.5;
    slips(1, pulled) = force(1, pulled);
    EXPECT_EQ(s.rows(pulls).col(2).minCoeff(), 0);
    if (std::max(std::abs(slips(0, pulled)), std::abs(slips(2, pulled))) > s.mu * slips(1, pulled)) {
      EXPECT_EQ(s.rows(slips).col(2).minCoeff(), 0);
    }
  }
}

TEST(ContactCones, AskNothingOfWhatDoesNotBear) {
  Standing s;
  const Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, s.points);
  EXPECT_EQ(s.rows(force).rows(), 5 * s.points);
  s.touching[0] = ContactState::kSlide;
  s.touching[1] = ContactState::kOff;
  s.bearing[2] = false;
  EXPECT_EQ(s.rows(force).rows(), 5 * (s.points - 3) + 1);
}

TEST(ContactCones, APointThatIsPressedDownGivesMore) {
  Standing s;
  const Eigen::Vector3d way(0.3, -2, 0.1);
  s.approach.col(0) = way.replicate(s.creature.scene.body.node_count(), 1);
  s.idle << 0.5, 7;  // the forces came of half of the first muscle; the second moves nothing
  const Eigen::Matrix3Xd force = Eigen::Vector3d(0, 1, 0).replicate(1, s.points);
  const Eigen::MatrixXd rows = s.rows(force);
  for (int p = 0; p < s.points; ++p) {
    EXPECT_NEAR(rows.row(5 * p) * Eigen::Vector3d(0.5, 7, 1), 1, 1e-12);
    EXPECT_NEAR(rows.row(5 * p) * Eigen::Vector3d(1.5, 0, 1), 3, 1e-12);
    EXPECT_NEAR(rows.row(5 * p) * Eigen::Vector3d(-0.5, 0, 1), -1, 1e-12);
  }
}

}  // namespace
}  // namespace hydrostat::retarget::contact_cones_test
