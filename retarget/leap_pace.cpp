#include "retarget/leap_pace.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "retarget/gravity.h"
#include "retarget/smooth.h"

namespace hydrostat::retarget {
namespace {

constexpr double kInTheAir = 0.1;      // bearing below which nothing is down
constexpr double kFalls = 0.5;         // of gravity
constexpr double kSmoothHz = 10;       // of the centre of mass, as preparation smooths it
constexpr double kPush = 0.2;          // per g of sideways acceleration at full load, against sliding by sqrt(g L)
constexpr double kLeastLoad = 0.2;     // of the weight: what the air counts as

}  // namespace

bool leaps(const Eigen::VectorXd& bearing, const Motion& com) {
  const Eigen::RowVectorXd up = accelerations(smooth(com, kSmoothHz)).row(1);
  return ((bearing.transpose().array() < kInTheAir) && (up.array() < -kFalls * kGravity)).any();
}

Eigen::MatrixXd leaping_pace(const Eigen::MatrixXd& ground, const Eigen::VectorXd& bearing, const Motion& com, double length) {
  const Eigen::Index frames = ground.cols();
  const double wave_squared = kGravity * length;
  const Eigen::MatrixXd acceleration = accelerations(smooth(com, kSmoothHz));
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(frames, frames), right = Eigen::MatrixXd::Zero(frames, 2);
  for (Eigen::Index f = 0; f < frames; ++f) {
    const Eigen::Index before = (f + frames - 1) % frames;
    // The ground under frame f runs at the mean of the pace before and after it.
    const double slide = bearing[f] / wave_squared;
    for (const Eigen::Index a : {before, f}) {
      for (const Eigen::Index b : {before, f}) normal(a, b) += slide / 4;
      right.row(a) += slide / 2 * ground.col(f).transpose();
    }
    // Pushed by a = com'' - pace', in weights of the load.
    const double load = bearing[f] * std::max(0.0, 1 + acceleration(1, f) / kGravity) + kLeastLoad;
    const double push = kPush / std::pow(kGravity * load, 2), rate = com.rate_hz;
    normal(f, f) += push * rate * rate;
    normal(before, before) += push * rate * rate;
    normal(f, before) -= push * rate * rate;
    normal(before, f) -= push * rate * rate;
    const Eigen::RowVector2d own(acceleration(0, f), acceleration(2, f));
    right.row(f) += push * rate * own;
    right.row(before) -= push * rate * own;
  }
  return normal.ldlt().solve(right).transpose();
}

}  // namespace hydrostat::retarget
