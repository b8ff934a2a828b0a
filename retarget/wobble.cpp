#include "retarget/wobble.h"

#include <cmath>
#include <numeric>

#include "retarget/morphs.h"
#include "retarget/performance.h"

namespace hydrostat::retarget {
namespace {

constexpr double kSharpness = 4;  // of the limit: an amplitude of half of it loses 1.5 %

/// Nodes at which something drives a mode, and how they turn.
class DrivenNodes {
 public:
  DrivenNodes(const Wobble& wobble, const ControlMesh& mesh) : nodes_(driven(wobble)), turns_(mesh, nodes_) {}

  const std::vector<int>& nodes() const { return nodes_; }
  std::vector<Eigen::Quaterniond> turns_at(const Eigen::Ref<const Eigen::Matrix3Xd>& x) const {
    return turns_.at(x, Eigen::Quaterniond::Identity());
  }

 private:
  static std::vector<int> driven(const Wobble& wobble) {
    std::vector<int> nodes;
    for (int n = 0; 3 * n < wobble.drive.rows(); ++n) {
      if (!wobble.drive.middleRows<3>(3 * n).isZero(0)) nodes.push_back(n);
    }
    return nodes;
  }

  std::vector<int> nodes_;
  NodeTurns turns_;
};

/// Holds skin over the ground, frame by frame.
class GroundKeeper {
 public:
  GroundKeeper(const Performer& performer, const Motion& motion)
      : performer_(performer), motion_(motion), turns_(performer.mesh, every_node(performer.mesh)) {}

  /// By how much the amplitudes of a frame are to be scaled, in 0..1, so that no vertex that is over the ground goes below.
  double share_of(Eigen::Index frame, const Eigen::VectorXd& amplitudes) const {
    const double farthest = amplitudes.lpNorm<1>();  // that any vertex is moved
    const physics::Ground& ground = performer_.scene.ground;
    const Embedding& skin = performer_.embedding;
    std::vector<Eigen::Quaterniond> turns;
    double share = 1;
    for (Eigen::Index v = 0; v < skin.nodes.cols() && farthest > 0; ++v) {
      Eigen::Vector3d place = Eigen::Vector3d::Zero();
      for (int k = 0; k < 4; ++k) place += skin.weights(k, v) * motion_.at(frame).col(skin.nodes(k, v));
      const double height = ground.normal.dot(place) - ground.offset;
      if (height >= farthest) continue;
      const Eigen::Vector3d offset = performer_.wobble.shapes.middleRows<3>(3 * v) * amplitudes;
      if (offset.isZero(0)) continue;
      if (turns.empty()) turns = turns_.at(motion_.at(frame), Eigen::Quaterniond::Identity());
      Eigen::Index heaviest = 0;
      skin.weights.col(v).maxCoeff(&heaviest);
      const double sinks = -ground.normal.dot(turns[static_cast<std::size_t>(skin.nodes(heaviest, v))] * offset);
      if (sinks > std::max(0.0, height)) share = std::min(share, std::max(0.0, height) / sinks);
    }
    return share;
  }

 private:
  static std::vector<int> every_node(const ControlMesh& mesh) {
    std::vector<int> nodes(static_cast<std::size_t>(mesh.node_count()));
    std::iota(nodes.begin(), nodes.end(), 0);
    return nodes;
  }

  const Performer& performer_;
  const Motion& motion_;
  NodeTurns turns_;
};

}  // namespace

Eigen::Vector2d oscillated(const Eigen::Vector2d& from, double w, double d, double h, double a0, double a1) {
  const double slope = (a1 - a0) / h, rise = slope / (w * w);  // of the place that it swings about
  const double middle = (a0 - 2 * d * w * rise) / (w * w);
  const double damped = w * std::sqrt(1 - d * d), decay = std::exp(-d * w * h);
  const double c = std::cos(damped * h), s = std::sin(damped * h);
  const double cosine = from[0] - middle, sine = (from[1] - rise + d * w * cosine) / damped;
  const double swing = decay * (cosine * c + sine * s);
  return {swing + middle + rise * h, decay * damped * (sine * c - cosine * s) - d * w * swing + rise};
}

Eigen::MatrixXd wobble_loads(const Wobble& wobble, const Performer& performer, const Motion& motion) {
  const Eigen::MatrixXd accelerations = retarget::accelerations(motion);
  const DrivenNodes driven(wobble, performer.mesh);
  Eigen::MatrixXd loads = Eigen::MatrixXd::Zero(wobble.count(), motion.count());
  for (Eigen::Index f = 0; f < motion.count(); ++f) {
    const std::vector<Eigen::Quaterniond> turns = driven.turns_at(motion.at(f));
    for (std::size_t i = 0; i < turns.size(); ++i) {
      const int n = driven.nodes()[i];
      const Eigen::Vector3d pull = performer.scene.gravity - accelerations.col(f).segment<3>(3 * n);
      loads.col(f) += wobble.drive.middleRows<3>(3 * n).transpose() * (turns[i].conjugate() * pull);
    }
  }
  return loads;
}

Eigen::MatrixXd swung(const Wobble& wobble, const Eigen::MatrixXd& loads, double rate_hz) {
  Eigen::MatrixXd amplitudes(wobble.count(), loads.cols());
  for (Eigen::Index k = 0; k < wobble.count(); ++k) {
    const double w = 2 * M_PI * wobble.frequency_hz[k];
    Eigen::Vector2d now = wobble.start.row(k);
    amplitudes(k, 0) = now[0];
    for (Eigen::Index f = 1; f < loads.cols(); ++f) {
      now = oscillated(now, w, kWobbleDamping, 1 / rate_hz, loads(k, f - 1) - wobble.mean_load[k],
                       loads(k, f) - wobble.mean_load[k]);
      amplitudes(k, f) = now[0];
    }
  }
  return amplitudes;
}

void limit_wobble(const Wobble& wobble, Eigen::Ref<Eigen::VectorXd> amplitudes) {
  const double share = amplitudes.cwiseAbs().cwiseQuotient(wobble.most).sum();
  amplitudes *= std::pow(1 + std::pow(share, kSharpness), -1 / kSharpness);
}

Eigen::MatrixXd wobble_of(const Performer& performer, const Motion& motion) {
  const Wobble& wobble = performer.wobble;
  Eigen::MatrixXd amplitudes = swung(wobble, wobble_loads(wobble, performer, motion), motion.rate_hz);
  const GroundKeeper keeper(performer, motion);
  for (Eigen::Index f = 0; f < amplitudes.cols(); ++f) {
    limit_wobble(wobble, amplitudes.col(f));
    if (performer.scene.has_ground) amplitudes.col(f) *= keeper.share_of(f, amplitudes.col(f));
  }
  return amplitudes;
}

}  // namespace hydrostat::retarget
