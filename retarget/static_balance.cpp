#include "retarget/static_balance.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "retarget/best_fit_rotation.h"

namespace hydrostat::retarget {
namespace {

constexpr int kDirections = 16;
constexpr double kInside = 0.25;     // of the support's width: so far inside lies the centre of mass that was outside
constexpr double kLeastShare = 0.2;
constexpr int kBalanceRounds = 8;          // a body that hangs over a corner does so in more than one direction

/// How far the nodes (N x directions) and the support reach in each direction, mean over the frames in which there is any.
struct Reach {
  Eigen::MatrixXd nodes;
  Eigen::VectorXd support;
  bool is_any = false;

  double width(int k) const { return support[k] + support[(k + kDirections / 2) % kDirections]; }
};

Reach mean_reach(const Motion& nodes, const Motion& points, const Eigen::VectorXd& mass, double height) {
  Reach reach;
  reach.nodes = Eigen::MatrixXd::Zero(nodes.frames.rows() / 3, kDirections);
  reach.support = Eigen::VectorXd::Zero(kDirections);
  int frames = 0;
  for (Eigen::Index f = 0; f < nodes.count(); ++f) {
    const auto x = nodes.at(f), p = points.at(f);
    if (!(p.row(1).minCoeff() < height)) continue;
    ++frames;
    const Eigen::Vector3d ahead = best_fit_rotation(nodes.at(0), x, mass).col(2);
    const double turn = std::atan2(ahead.x(), ahead.z());
    const Eigen::Vector3d origin = x.rowwise().mean();
    for (int k = 0; k < kDirections; ++k) {
      const double angle = 2 * M_PI * k / kDirections + turn;
      const Eigen::Vector3d direction(std::sin(angle), 0, std::cos(angle));
      reach.nodes.col(k) += (x.colwise() - origin).transpose() * direction;
      double furthest = -std::numeric_limits<double>::infinity();
      for (Eigen::Index j = 0; j < p.cols(); ++j) {
        if (p(1, j) < height) furthest = std::max(furthest, direction.dot(p.col(j) - origin));
      }
      reach.support[k] += furthest;
    }
  }
  reach.is_any = frames > 0;
  reach.nodes /= std::max(1, frames);
  reach.support /= std::max(1, frames);
  return reach;
}

/// Shares that bring the centre of mass to `levers` of mean zero with the least sum of squares of what they take; the least ones
/// where nothing does.
Eigen::VectorXd shares_for(const Eigen::VectorXd& levers, const Eigen::VectorXd& mass) {
  const auto shares = [&](double slope) -> Eigen::VectorXd { return (1 - slope * levers.array()).max(kLeastShare).min(1); };
  const auto moment = [&](double slope) { return shares(slope).cwiseProduct(mass).dot(levers); };
  double low = 0, high = 1 / levers.cwiseAbs().maxCoeff();
  for (int k = 0; k < 20 && moment(high) > 0; ++k) high *= 2;
  for (int k = 0; k < 60; ++k) {
    const double middle = 0.5 * (low + high);
    (moment(middle) > 0 ? low : high) = middle;
  }
  return shares(high);
}

}  // namespace

StaticBalance balance_statically(const Motion& nodes, const Motion& points, const Eigen::VectorXd& mass, double height) {
  StaticBalance balance;
  balance.mass_shares = Eigen::VectorXd::Ones(mass.size());
  const Reach reach = mean_reach(nodes, points, mass, height);
  if (!reach.is_any) return balance;
  for (int round = 0; round <= kBalanceRounds; ++round) {
    const Eigen::VectorXd left = mass.cwiseProduct(balance.mass_shares);
    const Eigen::VectorXd overhangs = reach.nodes.transpose() * left / left.sum() - reach.support;
    int worst = 0;
    const double overhang = overhangs.maxCoeff(&worst);
    if (round == 0) balance.overhang = std::max(0.0, overhang);
    balance.stands = overhang <= 0;
    if (balance.stands || round == kBalanceRounds) break;
    const Eigen::VectorXd levers = reach.nodes.col(worst).array() - reach.support[worst] + kInside * reach.width(worst);
    balance.mass_shares = balance.mass_shares.cwiseMin(shares_for(levers, left.cwiseQuotient(balance.mass_shares)));
  }
  return balance;
}

}  // namespace hydrostat::retarget
