#include "retarget/picture_effects.h"

#include <numeric>

#include "retarget/cpu_seconds.h"
#include "retarget/wobble_plan.h"

namespace hydrostat::retarget {
namespace {

constexpr double kFramesPerSecond = 60;  // at which the skin is asked for

}  // namespace

Eigen::MatrixXd embedded_motion(const Performer& performer, const Motion& motion) {
  Eigen::MatrixXd skin(3 * performer.embedding.count(), motion.count());
  for (Eigen::Index f = 0; f < motion.count(); ++f) skin.col(f) = embedded_positions(performer.embedding, motion.at(f)).reshaped();
  return skin;
}

Eigen::MatrixXd wobbled_motion(const Performer& performer, const Motion& motion) {
  Eigen::MatrixXd skin = embedded_motion(performer, motion);
  const Wobble& wobble = performer.wobble;
  if (!wobble.is_on()) return skin;
  const Eigen::MatrixXd amplitudes = wobble_of(performer, motion);
  std::vector<int> nodes(static_cast<std::size_t>(performer.mesh.node_count()));
  std::iota(nodes.begin(), nodes.end(), 0);
  const NodeTurns turns_of(performer.mesh, nodes);
  for (Eigen::Index f = 0; f < motion.count(); ++f) {
    const std::vector<Eigen::Quaterniond> turns = turns_of.at(motion.at(f), Eigen::Quaterniond::Identity());
    const Eigen::VectorXd offsets = wobble.shapes * amplitudes.col(f);
    for (Eigen::Index v = 0; v < performer.embedding.count(); ++v) {
      Eigen::Index heaviest = 0;
      performer.embedding.weights.col(v).maxCoeff(&heaviest);
      const auto node = static_cast<std::size_t>(performer.embedding.nodes(heaviest, v));
      skin.col(f).segment<3>(3 * v) += turns[node] * offsets.segment<3>(3 * v);
    }
  }
  return skin;
}

double embedding_ms_per_sim_s(const Performer& performer) {
  const Eigen::Matrix3Xd nodes = performer.prepared.target.at(0);
  return 1e3 * kFramesPerSecond * seconds_of([&] { embedded_positions(performer.embedding, nodes); });
}

double wobble_ms_per_sim_s(const Performer& performer) {
  return performer.wobble.is_on() ? 1e3 * wobble_seconds(performer) * performer.prepared.target.rate_hz : 0;
}

}  // namespace hydrostat::retarget
