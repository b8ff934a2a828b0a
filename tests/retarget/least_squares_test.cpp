#include "retarget/least_squares.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <array>
#include <limits>
#include <random>
#include <string>

namespace hydrostat::retarget::least_squares_test {
namespace {

/// A random problem whose last `free` columns are one unbounded block; bounds that many entries run into.
BoundedLeastSquares random_problem(unsigned seed, int bounded, int free, int rows, double density) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0, 1);
  const int columns = bounded + free;
  BoundedLeastSquares problem;
  std::vector<Eigen::Triplet<double>> entries;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      if (uniform(random) < density || r == c) entries.emplace_back(r, c, normal(random) + (r == c ? 2 : 0));
    }
  }
  problem.jacobian.resize(rows, columns);
  problem.jacobian.setFromTriplets(entries.begin(), entries.end());
  problem.target = Eigen::VectorXd::NullaryExpr(rows, [&] { return 3 * normal(random); });
  problem.lower = Eigen::VectorXd::Constant(columns, -std::numeric_limits<double>::infinity());
  problem.upper = -problem.lower;
  for (int c = 0; c < bounded; ++c) {
    problem.lower[c] = -uniform(random);
    problem.upper[c] = c % 3 == 0 ? std::numeric_limits<double>::infinity() : uniform(random);
    problem.column_blocks.push_back(c);
  }
  problem.column_blocks.push_back(bounded);
  if (free > 0) problem.column_blocks.push_back(columns);
  for (int r = 0; r < rows; r += 2) problem.row_blocks.push_back(r);
  problem.row_blocks.push_back(rows);
  return problem;
}

Eigen::VectorXd middle_start(const BoundedLeastSquares& problem) {
  return Eigen::VectorXd::Zero(problem.jacobian.cols()).cwiseMax(problem.lower).cwiseMin(problem.upper);
}

double cost(const BoundedLeastSquares& problem, const Eigen::VectorXd& x) {
  return 0.5 * (problem.jacobian * x - problem.target).squaredNorm();
}

/// Exact minimisation along one entry after the other until nothing moves: it needs no active set at all.
Eigen::VectorXd by_coordinates(const BoundedLeastSquares& problem) {
  const Eigen::MatrixXd jacobian = problem.jacobian, hessian = jacobian.transpose() * jacobian;
  const Eigen::VectorXd linear = jacobian.transpose() * problem.target;
  Eigen::VectorXd x = middle_start(problem);
  for (int sweep = 0; sweep < 200000; ++sweep) {
    double moved = 0;
    for (Eigen::Index c = 0; c < x.size(); ++c) {
      const double wanted = x[c] - (hessian.col(c).dot(x) - linear[c]) / hessian(c, c);
      const double next = std::clamp(wanted, problem.lower[c], problem.upper[c]);
      moved = std::max(moved, std::abs(next - x[c]));
      x[c] = next;
    }
    if (moved < 1e-13) break;
  }
  return x;
}

void expect_optimal(const BoundedLeastSquares& problem, const BoundedSolution& solution) {
  EXPECT_TRUE(solution.converged);
  EXPECT_LT(solution.kkt_residual, 1e-8);
  EXPECT_TRUE((solution.x.array() >= problem.lower.array()).all());  // bounds are exact, not kept to a tolerance
  EXPECT_TRUE((solution.x.array() <= problem.upper.array()).all());
  const Eigen::VectorXd gradient = problem.jacobian.transpose() * (problem.jacobian * solution.x - problem.target);
  const double slack = 1e-7 * (problem.jacobian.transpose() * problem.target).lpNorm<Eigen::Infinity>();
  for (Eigen::Index c = 0; c < solution.x.size(); ++c) {
    if (solution.x[c] > problem.lower[c]) {
      EXPECT_LT(gradient[c], slack) << "entry " << c << " would gain by shrinking";
    }
    if (solution.x[c] < problem.upper[c]) {
      EXPECT_GT(gradient[c], -slack) << "entry " << c << " would gain by growing";
    }
  }
}

TEST(BoundedLeastSquares, MeetsTheConditionsOfKarushKuhnAndTucker) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const BoundedLeastSquares problem = random_problem(seed, 3 + static_cast<int>(seed), static_cast<int>(seed % 4), 60, 0.4);
    const BoundedSolution solution = solve(problem, middle_start(problem));
    expect_optimal(problem, solution);
    int clamped = 0;
    for (Eigen::Index c = 0; c < solution.x.size(); ++c) clamped += solution.x[c] == problem.lower[c] || solution.x[c] == problem.upper[c];
    if (seed > 2) {
      EXPECT_GT(clamped, 0);
    }
  }
}

TEST(BoundedLeastSquares, AgreesWithDescentAlongCoordinates) {
  for (unsigned seed = 0; seed < 30; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const BoundedLeastSquares problem = random_problem(seed, 4 + static_cast<int>(seed % 20), 3, 40, 0.5);
    EXPECT_LT((solve(problem, middle_start(problem)).x - by_coordinates(problem)).lpNorm<Eigen::Infinity>(), 1e-7);
  }
}

TEST(BoundedLeastSquares, SaddlePointFormFindsTheSameEntries) {
  for (unsigned seed = 0; seed < 24; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    constexpr int kCoupled = 12, kBounded = 30;
    const int free = std::array{0, 3, 20}[seed % 3], columns = kBounded + free;
    BoundedLeastSquares problem = random_problem(seed, kBounded, free, kCoupled + columns, seed % 2 == 0 ? 0.5 : 0.1);
    // Below the coupled rows one entry a row, some columns with two.
    std::mt19937 random(seed);
    std::vector<Eigen::Triplet<double>> entries;
    for (int r = 0; r < kCoupled; ++r) {
      for (decltype(problem.jacobian)::InnerIterator it(problem.jacobian, r); it; ++it)
        entries.emplace_back(r, it.col(), 100 * it.value());
    }
    for (int c = 0; c < columns; ++c)
      entries.emplace_back(kCoupled + c, c == 5 ? 4 : c, c == 5 ? 0.3 : 0.1 + static_cast<double>(random() % 3));
    entries.emplace_back(kCoupled + 4, 4, 0.0);
    problem.jacobian.resize(kCoupled + columns + 1, columns);
    entries.emplace_back(kCoupled + columns, 5, 0.7);
    problem.jacobian.setFromTriplets(entries.begin(), entries.end());
    problem.target.conservativeResize(kCoupled + columns + 1);
    problem.target[kCoupled + columns] = 0.4;
    problem.row_blocks.back() = kCoupled + columns + 1;
    const BoundedSolution usual = solve(problem, middle_start(problem));
    problem.coupled_rows = kCoupled;
    const BoundedSolution saddle = solve(problem, middle_start(problem));
    expect_optimal(problem, saddle);
    EXPECT_LT((saddle.x - usual.x).lpNorm<Eigen::Infinity>(), 1e-8);
  }
}

TEST(BoundedLeastSquares, NoChoiceOfClampedEntriesIsBetter) {
  for (unsigned seed = 0; seed < 25; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const int bounded = 5;
    const BoundedLeastSquares problem = random_problem(seed, bounded, 0, 9, 0.9);
    const double found = cost(problem, solve(problem, middle_start(problem)).x);
    double best = std::numeric_limits<double>::infinity();
    for (int code = 0; code < 243; ++code) {  // three ways for each entry
      Eigen::VectorXd x = Eigen::VectorXd::Zero(bounded);
      std::vector<int> free;
      bool possible = true;
      for (int c = 0, rest = code; c < bounded; ++c, rest /= 3) {
        if (rest % 3 == 0) {
          free.push_back(c);
          continue;
        }
        x[c] = rest % 3 == 1 ? problem.lower[c] : problem.upper[c];
        possible = possible && std::isfinite(x[c]);
      }
      if (!possible) continue;
      const Eigen::MatrixXd jacobian = problem.jacobian;
      const Eigen::VectorXd left = problem.target - jacobian * x;
      if (!free.empty()) {
        const Eigen::MatrixXd columns = jacobian(Eigen::all, free);
        const Eigen::VectorXd values = columns.colPivHouseholderQr().solve(left);
        for (std::size_t k = 0; k < free.size(); ++k) x[free[k]] = values[static_cast<Eigen::Index>(k)];
      }
      if ((x.array() < problem.lower.array()).any() || (x.array() > problem.upper.array()).any()) continue;
      best = std::min(best, cost(problem, x));
    }
    EXPECT_NEAR(found, best, 1e-9 * best);
  }
}

TEST(BoundedLeastSquares, LargerProblemsConvergeFromAnyCorner) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const BoundedLeastSquares problem = random_problem(seed, 300, 6, 500, 0.01);
    Eigen::VectorXd start = middle_start(problem);
    if (seed % 2 == 0) start.head(300) = problem.lower.head(300);
    const BoundedSolution solution = solve(problem, start);
    expect_optimal(problem, solution);
  }
}

/// Six rows that hundreds of nearly equal non-negative forces share, each held to zero by a weak row: active sets cycle here.
BoundedLeastSquares shared_load(unsigned seed, int forces) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  BoundedLeastSquares problem;
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(6 + forces, forces);
  for (int k = 0; k < forces; ++k) {
    const Eigen::Vector3d force(0.6 * uniform(random), 1, 0.6 * uniform(random)), arm(0.5 * uniform(random), -0.3, 0.2 * uniform(random));
    rows.col(k).head<6>() << 60 * force, 60 * arm.cross(force);
    rows(6 + k, k) = 0.1;
  }
  problem.jacobian = rows.sparseView();
  problem.target = Eigen::VectorXd::Zero(6 + forces);
  for (int r = 0; r < 6; ++r) problem.target[r] = 60 * (r == 1 ? 1 : 0.4 * uniform(random));
  problem.lower = Eigen::VectorXd::Zero(forces);
  problem.upper = Eigen::VectorXd::Constant(forces, std::numeric_limits<double>::infinity());
  problem.row_blocks = {0, 6};
  for (int k = 0; k < forces; ++k) problem.row_blocks.push_back(7 + k);
  for (int k = 0; k <= forces; ++k) problem.column_blocks.push_back(k);
  return problem;
}

TEST(BoundedLeastSquares, SharesALoadAmongHundredsOfForces) {
  for (unsigned seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const int forces = 10 + 5 * static_cast<int>(seed);
    const BoundedSolution solution = solve(shared_load(seed, forces), Eigen::VectorXd::Constant(forces, 1e-3));
    expect_optimal(shared_load(seed, forces), solution);
  }
}

TEST(BoundedLeastSquares, WithoutBoundsIsTheNormalEquation) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const BoundedLeastSquares problem = random_problem(seed, 0, 7, 20, 0.6);
    const Eigen::VectorXd expected = Eigen::MatrixXd(problem.jacobian).colPivHouseholderQr().solve(problem.target);
    EXPECT_LT((solve(problem, Eigen::VectorXd::Zero(7)).x - expected).norm(), 1e-9 * expected.norm());
  }
}

TEST(BoundedLeastSquares, RowsWithoutAnUnknownStayAsTheyAre) {
  BoundedLeastSquares problem = random_problem(1, 4, 0, 8, 0.8);
  problem.jacobian.row(3) *= 0;
  problem.jacobian.prune(0.0);
  problem.row_blocks = {0, 1, 2, 3, 4, 5, 6, 7, 8};
  expect_optimal(problem, solve(problem, middle_start(problem)));
}

TEST(BoundedLeastSquares, NothingUnknownIsAProblemToo) {
  BoundedLeastSquares problem;
  problem.jacobian.resize(6, 0);
  problem.target = Eigen::VectorXd::Ones(6);
  problem.row_blocks = {0, 6};
  problem.column_blocks = {0};
  const BoundedSolution solution = solve(problem, Eigen::VectorXd());
  EXPECT_TRUE(solution.converged);
  EXPECT_EQ(solution.x.size(), 0);
  EXPECT_EQ(solution.kkt_residual, 0);
}

}  // namespace
}  // namespace hydrostat::retarget::least_squares_test
