#include "retarget/skin_distance.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

namespace hydrostat::retarget::skin_distance_test {
namespace {

constexpr int kNodes = 9, kVertices = 20;

Embedding random_embedding(std::mt19937& random) {
  std::uniform_int_distribution<int> node(0, kNodes - 1);
  std::uniform_real_distribution<double> share(0.1, 1);
  Embedding embedding{Eigen::VectorXi::Zero(kVertices), Eigen::Matrix4Xi(4, kVertices), Eigen::Matrix4Xd(4, kVertices), 0};
  for (int v = 0; v < kVertices; ++v) {
    for (int k = 0; k < 4; ++k) {
      embedding.nodes(k, v) = node(random);
      embedding.weights(k, v) = share(random);
    }
    embedding.weights.col(v) /= embedding.weights.col(v).sum();
  }
  return embedding;
}

/// Every node goes straight at its own speed.
Motion straight_motion(std::mt19937 random, double rate_hz, double duration_s) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto drawn = [&] { return Eigen::VectorXd::NullaryExpr(3 * kNodes, [&] { return uniform(random); }).eval(); };
  const Eigen::VectorXd place = drawn(), speed = drawn();
  Motion motion;
  motion.rate_hz = rate_hz;
  motion.frames.resize(3 * kNodes, std::lround(duration_s * rate_hz) + 1);
  for (Eigen::Index f = 0; f < motion.count(); ++f) motion.frames.col(f) = place + static_cast<double>(f) / rate_hz * speed;
  return motion;
}

class SkinDistanceOf : public testing::TestWithParam<unsigned> {
 protected:
  std::mt19937 random_{GetParam()};
  Embedding embedding_ = random_embedding(random_);
  Motion motion_ = straight_motion(random_, 60, 0.5);
};

TEST_P(SkinDistanceOf, AMotionToItselfIsNone) {
  const SkinDistance found = skin_distance({motion_, embedding_}, {motion_, embedding_});
  ASSERT_EQ(found.time_s.size(), 31);
  EXPECT_DOUBLE_EQ(found.time_s[30], 0.5);
  EXPECT_EQ(found.distance_m.maxCoeff(), 0);
  EXPECT_LT(found.shape_m.maxCoeff(), 1e-14);
}

TEST_P(SkinDistanceOf, ARigidMoveIsNoShape) {
  const Eigen::Vector3d away = Eigen::Vector3d::Random();
  Motion moved = motion_, turned = motion_;
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(2.1, Eigen::Vector3d(0.6, 0, 0.8)).toRotationMatrix();
  for (Eigen::Index f = 0; f < motion_.count(); ++f) {
    moved.at(f) = motion_.at(f).colwise() + away;
    turned.at(f) = (turn * motion_.at(f)).colwise() + away;
  }
  const SkinDistance by_move = skin_distance({motion_, embedding_}, {moved, embedding_});
  EXPECT_LT((by_move.distance_m.array() - away.norm()).abs().maxCoeff(), 1e-14);
  EXPECT_LT(by_move.shape_m.maxCoeff(), 1e-14);
  const SkinDistance by_turn = skin_distance({motion_, embedding_}, {turned, embedding_});
  EXPECT_GT(by_turn.distance_m.minCoeff(), 0.05);
  EXPECT_LT(by_turn.shape_m.maxCoeff(), 1e-13);
}

TEST_P(SkinDistanceOf, AShapeIsNeverFartherThanTheSkinItself) {
  std::mt19937 other(GetParam() + 1000);
  const Motion elsewhere = straight_motion(other, 60, 0.5);
  const SkinDistance found = skin_distance({motion_, embedding_}, {elsewhere, embedding_});
  const SkinDistance back = skin_distance({elsewhere, embedding_}, {motion_, embedding_});
  EXPECT_TRUE((found.shape_m.array() <= found.distance_m.array()).all());
  EXPECT_GT(found.shape_m.minCoeff(), 0.01);
  EXPECT_LT((found.distance_m - back.distance_m).norm(), 1e-14);
}

TEST_P(SkinDistanceOf, OtherRatesAreMetBetweenTheirFrames) {
  for (const double rate : {24.0, 30.0, 61.0, 240.0}) {
    const Motion other = straight_motion(random_, rate, 2);  // the same motion, for longer
    const SkinDistance found = skin_distance({motion_, embedding_}, {other, embedding_});
    EXPECT_EQ(found.time_s.size(), 31) << rate;
    EXPECT_LT(found.distance_m.maxCoeff(), 1e-13) << rate;
    const SkinDistance back = skin_distance({other, embedding_}, {motion_, embedding_});
    EXPECT_LE(back.time_s[back.time_s.size() - 1], 0.5 + 1e-12) << rate;
    EXPECT_LT(back.distance_m.maxCoeff(), 1e-13) << rate;
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, SkinDistanceOf, testing::Range(0u, 5u));

}  // namespace
}  // namespace hydrostat::retarget::skin_distance_test
