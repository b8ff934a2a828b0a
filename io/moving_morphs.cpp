#include "io/moving_morphs.h"

#include <algorithm>
#include <map>

#include "io/principal_directions.h"

namespace hydrostat::io {
namespace {

constexpr Eigen::Index kMostTurning = 4;
constexpr Eigen::Index kMorphSamples = 64;  // frames that the targets are fitted to
constexpr double kMorphsEnough = 0.02;      // of the RMS offset
constexpr double kUnseen = 1e-4;            // of the body's longest side, RMS

/// The vertices that some target moves, how the body turns at each, and where the targets take them.
class MorphedSkin {
 public:
  MorphedSkin(const retarget::MovingMorphs& morphs, const retarget::Embedding& embedding, const retarget::ControlMesh& body,
              const retarget::Motion& motion, const std::vector<Eigen::Quaterniond>& turns)
      : embedding_(embedding), weights_(static_cast<Eigen::Index>(morphs.targets.size()), motion.count()) {
    for (const retarget::MorphTarget& target : morphs.targets) {
      for (const int v : target.vertices) place_.try_emplace(v, 0);
    }
    std::map<int, int> node_place;
    for (auto& [vertex, place] : place_) {
      place = static_cast<int>(vertices_.size());
      vertices_.push_back(vertex);
      for (const int node : embedding.nodes.col(vertex)) node_place.try_emplace(node, 0);
    }
    std::vector<int> nodes;
    for (auto& [node, place] : node_place) {
      place = static_cast<int>(nodes.size());
      nodes.push_back(node);
    }
    for (const int vertex : vertices_) {
      carriers_.push_back(embedding.nodes.col(vertex).unaryExpr([&](int node) { return node_place.at(node); }));
    }
    for (const retarget::MorphTarget& target : morphs.targets) {
      Eigen::Matrix3Xd offsets = Eigen::Matrix3Xd::Zero(3, count());
      for (Eigen::Index i = 0; i < target.vertices.size(); ++i)
        offsets.col(place_.at(target.vertices[i])) = target.offsets.col(i);
      offsets_.push_back(std::move(offsets));
    }
    const retarget::NodeTurns node_turns(body, nodes);
    for (Eigen::Index f = 0; f < motion.count(); ++f) {
      const Eigen::Quaterniond& turn = turns[static_cast<std::size_t>(f)];
      std::vector<Eigen::Quaterniond>& own = own_turns_.emplace_back(node_turns.at(motion.at(f), turn));
      for (Eigen::Quaterniond& node : own) node = turn.conjugate() * node;
      weights_.col(f) = morphs.at(static_cast<double>(f) / motion.rate_hz);
    }
  }

  Eigen::Index count() const { return static_cast<Eigen::Index>(vertices_.size()); }
  Eigen::Index frames() const { return weights_.cols(); }
  const Eigen::MatrixXd& weights() const { return weights_; }
  const std::vector<Eigen::Matrix3Xd>& offsets() const { return offsets_; }

  /// How the body turns at a vertex against the turn that all share.
  Eigen::Quaterniond turn_at(Eigen::Index vertex, Eigen::Index frame) const {
    const std::vector<Eigen::Quaterniond>& own = own_turns_[static_cast<std::size_t>(frame)];
    const Eigen::Vector4i& nodes = carriers_[static_cast<std::size_t>(vertex)];
    const auto weights = embedding_.weights.col(vertices_[static_cast<std::size_t>(vertex)]);
    Eigen::Index heaviest = 0;
    weights.maxCoeff(&heaviest);
    const Eigen::Vector4d leading = own[static_cast<std::size_t>(nodes[heaviest])].coeffs();
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
    for (int k = 0; k < 4; ++k) {
      const Eigen::Vector4d part = own[static_cast<std::size_t>(nodes[k])].coeffs();
      sum += (part.dot(leading) < 0 ? -weights[k] : weights[k]) * part;
    }
    return Eigen::Quaterniond(Eigen::Vector4d(sum.normalized()));
  }

  /// The targets' sum in a frame, not yet turned.
  Eigen::Matrix3Xd worn(Eigen::Index frame) const {
    Eigen::Matrix3Xd sum = Eigen::Matrix3Xd::Zero(3, count());
    for (std::size_t k = 0; k < offsets_.size(); ++k) sum += weights_(static_cast<Eigen::Index>(k), frame) * offsets_[k];
    return sum;
  }

  /// Offsets of all the skin's vertices from those of the moved ones.
  Eigen::Matrix3Xd on_skin(const Eigen::Matrix3Xd& offsets) const {
    Eigen::Matrix3Xd all = Eigen::Matrix3Xd::Zero(3, embedding_.nodes.cols());
    all(Eigen::all, vertices_) = offsets;
    return all;
  }

 private:
  const retarget::Embedding& embedding_;
  Eigen::MatrixXd weights_;
  std::map<int, int> place_;  // of each moved vertex of the skin
  std::vector<int> vertices_;
  std::vector<Eigen::Vector4i> carriers_;  // places among the nodes
  std::vector<Eigen::Matrix3Xd> offsets_;  // of each target
  std::vector<std::vector<Eigen::Quaterniond>> own_turns_;  // frames x nodes, against the turn that all share
};

Eigen::Index sample(Eigen::Index s, Eigen::Index samples, Eigen::Index frames) {
  return samples > 1 ? s * (frames - 1) / (samples - 1) : 0;
}

/// The mean turn at a vertex while targets are worn.
std::vector<Eigen::Matrix3d> mean_turns(const MorphedSkin& skin) {
  const Eigen::Index samples = std::min(skin.frames(), kMorphSamples);
  std::vector<Eigen::Matrix3d> means;
  for (Eigen::Index v = 0; v < skin.count(); ++v) {
    const Eigen::Vector4d first = skin.turn_at(v, 0).coeffs();
    Eigen::Vector4d sum = 1e-9 * first;
    for (Eigen::Index s = 0; s < samples; ++s) {
      const Eigen::Index f = sample(s, samples, skin.frames());
      const Eigen::Vector4d turn = skin.turn_at(v, f).coeffs();
      sum += skin.weights().col(f).squaredNorm() * (turn.dot(first) < 0 ? -turn : turn);
    }
    means.push_back(Eigen::Quaterniond(Eigen::Vector4d(sum.normalized())).toRotationMatrix());
  }
  return means;
}

}  // namespace

PlayedMorphs play_morphs(const retarget::MovingMorphs& morphs, const retarget::Embedding& skin_embedding,
                         const retarget::ControlMesh& body, const retarget::Motion& motion,
                         const std::vector<Eigen::Quaterniond>& turns) {
  PlayedMorphs played;
  if (morphs.targets.empty()) return played;
  const MorphedSkin skin(morphs, skin_embedding, body, motion, turns);
  const std::vector<Eigen::Matrix3d> means = mean_turns(skin);
  for (std::size_t k = 0; k < morphs.targets.size(); ++k) {
    Eigen::Matrix3Xd turned = skin.offsets()[k];
    for (Eigen::Index v = 0; v < turned.cols(); ++v) turned.col(v) = (means[static_cast<std::size_t>(v)] * turned.col(v)).eval();
    played.names.push_back(morphs.targets[k].name);
    played.shapes.push_back(skin.on_skin(turned));
  }
  const auto left_at = [&](Eigen::Index f) {
    Eigen::Matrix3Xd left = skin.worn(f);
    for (Eigen::Index v = 0; v < left.cols(); ++v)
      left.col(v) = ((skin.turn_at(v, f).toRotationMatrix() - means[static_cast<std::size_t>(v)]) * left.col(v)).eval();
    return Eigen::VectorXd(left.reshaped());
  };
  const Eigen::Index samples = std::min(skin.frames(), kMorphSamples);
  Eigen::MatrixXd left(3 * skin.count(), samples);
  double worn = 0;
  for (Eigen::Index s = 0; s < samples; ++s) {
    left.col(s) = left_at(sample(s, samples, skin.frames()));
    worn += skin.worn(sample(s, samples, skin.frames())).squaredNorm();
  }
  const double unseen = kUnseen * (body.nodes.rowwise().maxCoeff() - body.nodes.rowwise().minCoeff()).maxCoeff();
  const double enough = std::max(kMorphsEnough * kMorphsEnough * worn, unseen * unseen * static_cast<double>(samples * skin.count()));
  const Eigen::MatrixXd directions = principal_directions(left, enough, kMostTurning);
  played.weights.resize(skin.weights().rows() + directions.cols(), skin.frames());
  played.weights.topRows(skin.weights().rows()) = skin.weights();
  for (Eigen::Index f = 0; f < skin.frames() && directions.cols() > 0; ++f)
    played.weights.col(f).tail(directions.cols()) = directions.transpose() * left_at(f);
  for (Eigen::Index k = 0; k < directions.cols(); ++k) {
    auto course = played.weights.row(skin.weights().rows() + k);
    const double largest = std::max(course.cwiseAbs().maxCoeff(), 1e-12);
    course /= largest;
    played.names.push_back("turning " + std::to_string(k + 1));
    played.shapes.push_back(skin.on_skin(largest * directions.col(k).reshaped(3, skin.count())));
  }
  return played;
}

}  // namespace hydrostat::io
