#include "retarget/coupling.h"

#include <ceres/ceres.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <thread>
#include <vector>

#include "retarget/error.h"
#include "retarget/grid.h"
#include "retarget/morphs.h"

namespace hydrostat::retarget {
namespace {

constexpr int kMostAnchors = 8;
using Anchors = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMostAnchors>;

/// A node and a bone that owns it.
struct Hold {
  int node;
  int bone;
  double weight;
};

struct Rig {
  std::vector<Hold> holds;
  Anchors directions;      // [m] from a node to its anchors, bind pose
  double anchor_distance;  // [m]
};

/// The corners of a cube [-1, 1]^3, or every other of them.
Anchors corners(bool symmetric) {
  Anchors directions(3, 4);
  directions << 1, 1, -1, -1, 1, -1, 1, -1, 1, -1, -1, 1;
  if (!symmetric) return directions;
  directions.resize(3, kMostAnchors);
  for (int k = 0; k < kMostAnchors; ++k) directions.col(k) = (2 * corner_step(k).array() - 1).cast<double>();
  return directions;
}

Rig hang_on_bones(const ControlMesh& mesh, const CouplingOptions& options) {
  Rig rig;
  rig.anchor_distance = options.anchor_distance * std::cbrt(mesh.cell_size.prod());
  rig.directions = corners(options.symmetric);
  rig.directions *= rig.anchor_distance / std::sqrt(3.0);
  for (int n = 0; n < mesh.node_count(); ++n) {
    const double least = std::min(options.least_weight, mesh.bone_weights.col(n).maxCoeff());
    double held = 0;
    const std::size_t first = rig.holds.size();
    for (int b = 0; b < mesh.bone_weights.rows(); ++b) {
      if (mesh.bone_weights(b, n) < least) continue;
      rig.holds.push_back({n, b, mesh.bone_weights(b, n)});
      held += mesh.bone_weights(b, n);
    }
    for (std::size_t h = first; h < rig.holds.size(); ++h) rig.holds[h].weight /= held;
  }
  return rig;
}

/// Distance constraints of a node to its anchors on one bone, together as strong as four of the bone's weight. Residual:
/// sqrt(4 weight / anchors) (|x - p| - length) / anchor distance.
class AnchorCost : public ceres::CostFunction {
 public:
  Anchors anchors;                                                        // [m] world
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostAnchors, 1> lengths;  // [m]
  double strength = 1;                                                   // [1/m]

  void hold(int count) {
    set_num_residuals(count);
    mutable_parameter_block_sizes()->assign(1, 3);
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Map<const Eigen::Vector3d> x(parameters[0]);
    for (Eigen::Index k = 0; k < anchors.cols(); ++k) {
      const Eigen::Vector3d way = x - anchors.col(k);
      const double distance = way.norm();
      residuals[k] = strength * (distance - lengths[k]);
      if (!jacobians || !jacobians[0]) continue;
      Eigen::Vector3d::Map(jacobians[0] + 3 * k) =
          distance > 0 ? Eigen::Vector3d(strength / distance * way) : Eigen::Vector3d::Zero();
    }
    return true;
  }
};

/// An edge of the mesh keeps its length. Residual: sqrt(elasticity) (|a - b| / length - 1).
class EdgeCost : public ceres::SizedCostFunction<1, 3, 3> {
 public:
  double length = 1;    // [m]
  double strength = 0;  // [-]

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Vector3d way =
        Eigen::Map<const Eigen::Vector3d>(parameters[0]) - Eigen::Map<const Eigen::Vector3d>(parameters[1]);
    const double distance = way.norm();
    residuals[0] = strength * (distance / length - 1);
    if (!jacobians) return true;
    const Eigen::Vector3d slope =
        distance > 0 ? Eigen::Vector3d(strength / (length * distance) * way) : Eigen::Vector3d::Zero();
    if (jacobians[0]) Eigen::Vector3d::Map(jacobians[0]) = slope;
    if (jacobians[1]) Eigen::Vector3d::Map(jacobians[1]) = -slope;
    return true;
  }
};

/// The problem of one frame, kept from frame to frame: only anchors, lengths and the first guess change.
class FrameSolver {
 public:
  FrameSolver(const ControlMesh& mesh, const Rig& rig, const CouplingOptions& options)
      : mesh_(mesh),
        rig_(rig),
        positions_(mesh.nodes),
        anchors_(rig.holds.size()),
        edges_(static_cast<std::size_t>(mesh.edges.cols())),
        problem_(unowned()) {
    for (std::size_t h = 0; h < anchors_.size(); ++h) {
      const auto count = static_cast<int>(rig.directions.cols());
      anchors_[h].hold(count);
      anchors_[h].strength = std::sqrt(4.0 / count * rig.holds[h].weight) / rig.anchor_distance;
      problem_.AddResidualBlock(&anchors_[h], nullptr, positions_.col(rig.holds[h].node).data());
    }
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      edges_[e].strength = std::sqrt(options.elasticity);
      const Eigen::Vector2i ends = mesh.edges.col(static_cast<Eigen::Index>(e));
      problem_.AddResidualBlock(&edges_[e], nullptr, positions_.col(ends[0]).data(), positions_.col(ends[1]).data());
    }
    solver_options_.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    solver_options_.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
    solver_options_.num_threads = 1;
    solver_options_.max_num_iterations = options.max_iterations;
    solver_options_.function_tolerance = 1e-8;
    solver_options_.parameter_tolerance = 1e-8;
    solver_options_.gradient_tolerance = 1e-12;
    solver_options_.logging_type = ceres::SILENT;
  }

  /// Node positions [m] for bones that moved by `motion` since the bind pose, in which the nodes lie at `bind_pose` [m].
  /// False where the iterations did not suffice.
  bool solve(const std::vector<Eigen::Affine3d>& motion, const Eigen::Matrix3Xd& bind_pose) {
    positions_.setZero();
    for (std::size_t h = 0; h < anchors_.size(); ++h) {
      const auto& [node, bone, weight] = rig_.holds[h];
      const Eigen::Affine3d& move = motion[static_cast<std::size_t>(bone)];
      const Anchors ways = move.linear() * rig_.directions;
      const Eigen::Vector3d hub = move * bind_pose.col(node);
      anchors_[h].anchors = ways.colwise() + hub;
      anchors_[h].lengths = ways.colwise().norm();
      positions_.col(node) += weight * hub;
    }
    set_edge_lengths(motion, bind_pose);
    ceres::Solver::Summary summary;
    ceres::Solve(solver_options_, &problem_, &summary);
    return summary.termination_type == ceres::CONVERGENCE;
  }

  const Eigen::Matrix3Xd& positions() const { return positions_; }

 private:
  static ceres::Problem::Options unowned() {
    ceres::Problem::Options options;
    options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    return options;
  }

  /// The length that an edge's bones give it, the mean over the owners of both ends.
  void set_edge_lengths(const std::vector<Eigen::Affine3d>& motion, const Eigen::Matrix3Xd& bind_pose) {
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      const int a = mesh_.edges(0, static_cast<Eigen::Index>(e));
      const int b = mesh_.edges(1, static_cast<Eigen::Index>(e));
      const Eigen::Vector3d way = bind_pose.col(b) - bind_pose.col(a);
      double length = 0;
      for (int bone = 0; bone < mesh_.bone_weights.rows(); ++bone) {
        const double weight = 0.5 * (mesh_.bone_weights(bone, a) + mesh_.bone_weights(bone, b));
        if (weight > 0) length += weight * (motion[static_cast<std::size_t>(bone)].linear() * way).norm();
      }
      edges_[e].length = length > 0 ? length : way.norm();
    }
  }

  const ControlMesh& mesh_;
  const Rig& rig_;
  Eigen::Matrix3Xd positions_;
  std::vector<AnchorCost> anchors_;
  std::vector<EdgeCost> edges_;
  ceres::Problem problem_;
  ceres::Solver::Options solver_options_;
};

/// By how much a move of the nodes changes the volume of the tets that it moves much, per volume.
double volume_change(const ControlMesh& mesh, const Eigen::Matrix3Xd& move) {
  const auto volume = [&](const Eigen::Matrix3Xd& places, Eigen::Index t) {
    const Eigen::Vector4i tet = mesh.tets.col(t);
    const Eigen::Vector3d a = places.col(tet[0]);
    return (places.col(tet[1]) - a).cross(places.col(tet[2]) - a).dot(places.col(tet[3]) - a);
  };
  const Eigen::Matrix3Xd moved = mesh.nodes + move;
  const double much = 0.1 * move.colwise().norm().maxCoeff();
  double change = 0, whole = 0;
  for (Eigen::Index t = 0; t < mesh.tets.cols(); ++t) {
    const Eigen::Vector4i tet = mesh.tets.col(t);
    if (move(Eigen::all, tet).colwise().norm().maxCoeff() < much) continue;
    change += std::abs(volume(moved, t) - volume(mesh.nodes, t));
    whole += volume(mesh.nodes, t);
  }
  return whole > 0 ? change / whole : 0;
}

/// What the morph targets make of the bind pose's nodes, frame by frame.
class MorphedNodes {
 public:
  MorphedNodes(const Character& character, const ControlMesh& mesh, const Embedding& skin_embedding,
               const CouplingOptions& options, double length)
      : nodes_(mesh.nodes), weights_(character.clip.morph_weights) {
    if (weights_.size() == 0) return;
    carried = carried_by_nodes(character.skin.morphs, mesh, skin_embedding);
    bool is_any_carried = false;
    for (std::size_t k = 0; k < carried.size(); ++k) {
      const Eigen::Matrix3Xd move = weights_.row(static_cast<Eigen::Index>(k)).cwiseAbs().maxCoeff() * carried[k];
      const bool is_large = move.colwise().norm().maxCoeff() >= options.least_morph * length;
      const bool keeps_volume = volume_change(mesh, move) <= options.most_volume_change;
      if (is_large && !keeps_volume) left_large.push_back(character.skin.morphs[k].name);
      if (!is_large || !keeps_volume) carried[k].setZero();
      is_any_carried = is_any_carried || (is_large && keeps_volume);
    }
    if (!is_any_carried) carried.clear();
  }

  Eigen::Matrix3Xd at(Eigen::Index frame) const {
    Eigen::Matrix3Xd nodes = nodes_;
    for (std::size_t k = 0; k < carried.size(); ++k) nodes += weights_(static_cast<Eigen::Index>(k), frame) * carried[k];
    return nodes;
  }

  std::vector<Eigen::Matrix3Xd> carried;
  std::vector<std::string> left_large;

 private:
  const Eigen::Matrix3Xd& nodes_;
  const Eigen::MatrixXd& weights_;
};

struct FrameError {
  double squared_sum = 0;  // [m²]
  double max = 0;          // [m]
  bool converged = false;
};

}  // namespace

std::string broken_rule(const CouplingOptions& options) {
  if (!(options.anchor_distance > 0)) return "anchor_distance must be above 0";
  if (!(options.elasticity >= 0)) return "elasticity must be 0 or above";
  if (!(options.least_weight >= 0 && options.least_weight < 1)) return "least_weight must be from 0 to below 1";
  if (!(options.least_morph >= 0)) return "least_morph must be 0 or above";
  if (!(options.most_volume_change >= 0)) return "most_volume_change must be 0 or above";
  if (options.max_iterations < 1) return "max_iterations must be 1 or more";
  if (options.threads < 1) return "threads must be 1 or more";
  return "";
}

CoupledMotion couple(const Character& character, const ControlMesh& mesh, const Embedding& skin_embedding,
                     const CouplingOptions& options) {
  const auto& [skeleton, skin, clip] = character;
  if (clip.frames() == 0) throw Error("", "clip '" + clip.name + "'", "the clip has no frame", "Choose a clip that moves.");
  CoupledMotion coupled;
  coupled.motion.rate_hz = clip.rate_hz;
  coupled.motion.frames.resize(3 * mesh.node_count(), clip.frames());

  std::vector<Eigen::Affine3d> to_bone(static_cast<std::size_t>(skeleton.count()));
  for (std::size_t b = 0; b < to_bone.size(); ++b) to_bone[b] = skeleton.bind_pose[b].inverse();
  const Rig rig = hang_on_bones(mesh, options);
  const double length = (skin.vertices.rowwise().maxCoeff() - skin.vertices.rowwise().minCoeff()).maxCoeff();
  MorphedNodes nodes(character, mesh, skin_embedding, options, length);
  std::vector<FrameError> errors(static_cast<std::size_t>(clip.frames()));
  auto solve_every = [&](int first, int step) {
    FrameSolver solver(mesh, rig, options);
    SkinnedMesh carried = skin;  // with what the nodes carry of the morph targets: the error is the body's
    for (int f = first; f < clip.frames(); f += step) {
      const std::vector<Eigen::Affine3d>& pose = clip.bone_pose[static_cast<std::size_t>(f)];
      std::vector<Eigen::Affine3d> motion(to_bone.size());
      for (std::size_t b = 0; b < motion.size(); ++b) motion[b] = pose[b] * to_bone[b];
      FrameError& error = errors[static_cast<std::size_t>(f)];
      const Eigen::Matrix3Xd bind_pose = nodes.at(f);
      error.converged = solver.solve(motion, bind_pose);
      if (!nodes.carried.empty()) carried.vertices = skin.vertices + embedded_positions(skin_embedding, bind_pose - mesh.nodes);
      coupled.motion.at(f) = solver.positions();
      const Eigen::VectorXd squared =
          (embedded_positions(skin_embedding, solver.positions()) - skin_positions(skeleton, carried, pose))
              .colwise()
              .squaredNorm();
      error.squared_sum = squared.sum();
      error.max = std::sqrt(squared.maxCoeff());
    }
  };
  const int threads = std::min(options.threads, clip.frames());
  std::vector<std::thread> crew;
  for (int t = 1; t < threads; ++t) crew.emplace_back(solve_every, t, threads);
  solve_every(0, threads);
  for (std::thread& member : crew) member.join();
  coupled.node_morphs = std::move(nodes.carried);
  coupled.left_large_morphs = std::move(nodes.left_large);

  double squared_sum = 0;
  for (int f = 0; f < clip.frames(); ++f) {
    const FrameError& error = errors[static_cast<std::size_t>(f)];
    squared_sum += error.squared_sum;
    coupled.unconverged_frames += !error.converged;
    if (error.max / length <= coupled.error_max_length) continue;
    coupled.error_max_length = error.max / length;
    coupled.worst_frame = f;
  }
  coupled.error_rms_length = std::sqrt(squared_sum / static_cast<double>(skin.vertices.cols() * clip.frames())) / length;
  return coupled;
}

}  // namespace hydrostat::retarget
