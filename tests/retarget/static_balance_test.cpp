#include "retarget/static_balance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace hydrostat::retarget::static_balance_test {
namespace {

/// Nodes in a row along z, standing on four feet (points) around (0, 0), for some frames of a walk that turns.
struct Stand {
  Motion nodes, points;
  Eigen::VectorXd mass;

  Stand(double from_z, double to_z, double turn_per_frame, unsigned seed) {
    constexpr int kNodes = 40, kFrames = 12;
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> across(-0.1, 0.1), weight(0.5, 1.5);
    Eigen::Matrix3Xd body(3, kNodes), feet(3, 6);
    mass.resize(kNodes);
    for (int i = 0; i < kNodes; ++i) {
      body.col(i) << across(random), 0.3, from_z + (to_z - from_z) * i / (kNodes - 1);
      mass[i] = weight(random);
    }
    feet << -0.2, 0.2, -0.2, 0.2, 0, 0,  //
        0, 0, 0, 0, 0.3, 0.3,            //
        -0.3, -0.3, 0.3, 0.3, -2, 2;     // the last two are in the air
    for (Motion* motion : {&nodes, &points}) {
      motion->rate_hz = 30;
      motion->frames.resize(motion == &nodes ? body.size() : feet.size(), kFrames);
    }
    for (int f = 0; f < kFrames; ++f) {
      const Eigen::Matrix3d turn = Eigen::AngleAxisd(f * turn_per_frame, Eigen::Vector3d::UnitY()).toRotationMatrix();
      const Eigen::Vector3d way(0.05 * f, 0, 0.02 * f);
      nodes.at(f) = (turn * body).colwise() + way;
      points.at(f) = (turn * feet).colwise() + way;
    }
  }

  StaticBalance balance() const { return balance_statically(nodes, points, mass, 0.05); }
  /// Of the centre of mass along the body, with these shares, in the first frame.
  double centre(const Eigen::VectorXd& shares) const {
    const Eigen::VectorXd left = mass.cwiseProduct(shares);
    return (nodes.at(0) * left).z() / left.sum();
  }
};

TEST(BalanceStatically, LeavesABodyAloneThatStands) {
  for (unsigned seed = 1; seed <= 8; ++seed) {
    const StaticBalance balance = Stand(-0.5, 0.4, 0.1, seed).balance();
    EXPECT_EQ(balance.overhang, 0);
    EXPECT_TRUE(balance.stands);
    EXPECT_TRUE((balance.mass_shares.array() == 1).all());
  }
}

TEST(BalanceStatically, TakesMassFromWhatHangsOverAndNoneFromTheRest) {
  for (unsigned seed = 1; seed <= 8; ++seed) {
    for (const double turn : {0.0, 0.2}) {  // the overhang goes round with the body
      const Stand stand(-1.1, 0.3, turn, seed);
      const double before = -0.3 - stand.centre(Eigen::VectorXd::Ones(40));
      ASSERT_GT(before, 0.02);
      const StaticBalance balance = stand.balance();
      EXPECT_NEAR(balance.overhang, before, 0.05 * before);
      EXPECT_TRUE(balance.stands);
      EXPECT_NEAR(stand.centre(balance.mass_shares), -0.3 + 0.25 * 0.6, 0.01);
      EXPECT_GE(balance.mass_shares.minCoeff(), 0.2);
      for (int i = 1; i < 40; ++i) EXPECT_GE(balance.mass_shares[i], balance.mass_shares[i - 1] - 1e-12);
      EXPECT_EQ(balance.mass_shares[39], 1);
    }
  }
}

TEST(BalanceStatically, TellsWhereNoMassThatIsLeftWouldStand) {
  const StaticBalance balance = Stand(-3, -1, 0, 1).balance();
  EXPECT_FALSE(balance.stands);
  EXPECT_GT(balance.overhang, 1);
}

TEST(BalanceStatically, HasNothingToSayOfWhatTouchesNothing) {
  Stand stand(-3, -1, 0, 1);
  stand.points.frames.array() += 1;
  EXPECT_EQ(stand.balance().overhang, 0);
  EXPECT_TRUE(stand.balance().stands);
}

}  // namespace
}  // namespace hydrostat::retarget::static_balance_test
