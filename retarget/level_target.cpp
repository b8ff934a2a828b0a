#include "retarget/level_target.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "retarget/balance.h"
#include "retarget/contacts.h"
#include "retarget/mesh_places.h"
#include "retarget/sag.h"
#include "retarget/shape_projection.h"

namespace hydrostat::retarget {
namespace {

using Triplets = std::vector<Eigen::Triplet<double>>;

constexpr double kJumps = 1e-3;       // per squared change of the deformation from tet to tet, in cells
constexpr double kAlike = 1;          // per squared difference of the deformation from the solved creature's there, in cells
constexpr double kInsideShare = 0.3;  // of the inside beside the skin, where nodes are placed

/// Share of the skin's area that each vertex stands for.
Eigen::VectorXd vertex_shares(const SkinnedMesh& skin) {
  Eigen::VectorXd shares = Eigen::VectorXd::Zero(skin.vertices.cols());
  for (const auto corners : skin.triangles.colwise()) {
    const Eigen::Vector3d origin = skin.vertices.col(corners[0]);
    const double area = (skin.vertices.col(corners[1]) - origin).cross(skin.vertices.col(corners[2]) - origin).norm();
    for (const int v : corners) shares[v] += area;
  }
  shares.array() += 1e-6 * shares.mean();
  return shares / shares.sum();
}

/// 4 x 3: the places of a tet's corners, as rows, times its transpose are the deformation's transpose.
Eigen::Matrix<double, 4, 3> gradients_of(const ControlMesh& mesh, Eigen::Index t) {
  Eigen::Matrix3d spans;
  for (int k = 0; k < 3; ++k) spans.col(k) = mesh.nodes.col(mesh.tets(k + 1, t)) - mesh.nodes.col(mesh.tets(0, t));
  Eigen::Matrix<double, 4, 3> result;
  result.bottomRows<3>() = spans.inverse();
  result.row(0) = -result.bottomRows<3>().colwise().sum();
  return result;
}

/// Adds the squared changes of the deformation over the faces between tets.
void add_jumps(const ControlMesh& mesh, Triplets& terms) {
  std::map<std::array<int, 3>, Eigen::Index> first;  // tet at a face
  std::vector<std::pair<Eigen::Index, Eigen::Index>> pairs;
  for (Eigen::Index t = 0; t < mesh.tets.cols(); ++t) {
    for (int left_out = 0; left_out < 4; ++left_out) {
      std::array<int, 3> face{};
      for (int k = 0, n = 0; k < 4; ++k) {
        if (k != left_out) face[static_cast<std::size_t>(n++)] = mesh.tets(k, t);
      }
      std::sort(face.begin(), face.end());
      const auto [place, is_new] = first.emplace(face, t);
      if (!is_new) pairs.emplace_back(place->second, t);
    }
  }
  const double weight = kJumps * std::pow(mesh.cell_size.mean(), 2) / static_cast<double>(pairs.size());
  for (const auto& [a, b] : pairs) {
    Eigen::Matrix<double, 8, 3> jump;
    jump << gradients_of(mesh, a), -gradients_of(mesh, b);
    const Eigen::Matrix<double, 8, 8> products = weight * jump * jump.transpose();
    for (int r = 0; r < 8; ++r) {
      for (int c = 0; c < 8; ++c)
        terms.emplace_back(mesh.tets(r % 4, r < 4 ? a : b), mesh.tets(c % 4, c < 4 ? a : b), products(r, c));
    }
  }
}

/// About each node the mean of the deformation, transposed, of the tets that meet there: 9 x N.
Eigen::MatrixXd node_deformation(const ControlMesh& mesh, const Eigen::Ref<const Eigen::Matrix3Xd>& x) {
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(9, mesh.node_count());
  Eigen::RowVectorXd count = Eigen::RowVectorXd::Zero(mesh.node_count());
  for (Eigen::Index t = 0; t < mesh.tets.cols(); ++t) {
    const Eigen::Matrix3d deformation = gradients_of(mesh, t).transpose() * x(Eigen::all, mesh.tets.col(t)).transpose();
    for (const int i : mesh.tets.col(t)) {
      sum.col(i) += deformation.reshaped();
      ++count[i];
    }
  }
  return sum.array().rowwise() / count.array();
}

/// Asks of the level's tets to be deformed as the solved creature is there. A coarse mesh that goes by its skin alone strains
/// itself far beyond what muscles can follow.
class Likeness {
 public:
  Likeness(const Performer& solved, const Rig& rig, const ControlMesh& mesh)
      : solved_(solved), mesh_(mesh), weight_(kAlike * std::pow(mesh.cell_size.mean(), 2) / static_cast<double>(mesh.tets.cols())) {
    Eigen::Matrix3Xd middles(3, mesh.tets.cols());
    Eigen::MatrixXd bones(mesh.bone_weights.rows(), mesh.tets.cols());
    for (Eigen::Index t = 0; t < mesh.tets.cols(); ++t) {
      middles.col(t) = mesh.nodes(Eigen::all, mesh.tets.col(t)).rowwise().mean();
      bones.col(t) = mesh.bone_weights(Eigen::all, mesh.tets.col(t)).rowwise().mean();
    }
    places_ = locate(solved.mesh, rig.bone_weights, middles, bones);
  }
  void add_to(Triplets& terms) const {
    for (Eigen::Index t = 0; t < mesh_.tets.cols(); ++t) {
      const Eigen::Matrix<double, 4, 3> gradients = gradients_of(mesh_, t);
      const Eigen::Matrix4d products = weight_ * gradients * gradients.transpose();
      for (int r = 0; r < 4; ++r) {
        for (int c = 0; c < 4; ++c) terms.emplace_back(mesh_.tets(r, t), mesh_.tets(c, t), products(r, c));
      }
    }
  }
  /// Of a frame, N x 3.
  void add_to(Eigen::MatrixXd& right, Eigen::Index f) const {
    const Eigen::MatrixXd deformation = node_deformation(solved_.mesh, solved_.prepared.target.at(f));
    for (Eigen::Index t = 0; t < mesh_.tets.cols(); ++t) {
      const Eigen::Vector<double, 9> wanted = deformation(Eigen::all, places_.nodes.col(t)) * places_.weights.col(t);
      right(mesh_.tets.col(t), Eigen::all) += weight_ * gradients_of(mesh_, t) * wanted.reshaped(3, 3);
    }
  }

 private:
  const Performer& solved_;
  const ControlMesh& mesh_;
  double weight_;
  Places places_;
};

/// The target on the nodes of the level.
Motion carried_motion(const Performer& solved, const Rig& rig, const Creature& level) {
  const ControlMesh& mesh = level.mesh;
  const Motion& target = solved.prepared.target;
  const Places inside = locate(solved.mesh, rig.bone_weights, mesh.nodes, mesh.bone_weights);
  const Eigen::VectorXd shares = vertex_shares(rig.skin);
  Triplets terms;
  add_jumps(mesh, terms);
  const Likeness likeness(solved, rig, mesh);
  likeness.add_to(terms);
  for (Eigen::Index v = 0; v < level.skin.count(); ++v) {
    for (int r = 0; r < 4; ++r) {
      for (int c = 0; c < 4; ++c) {
        terms.emplace_back(level.skin.nodes(r, v), level.skin.nodes(c, v),
                           shares[v] * level.skin.weights(r, v) * level.skin.weights(c, v));
      }
    }
  }
  const double inner = kInsideShare / mesh.node_count();
  for (int i = 0; i < mesh.node_count(); ++i) {
    if (inside.is_inside[static_cast<std::size_t>(i)]) terms.emplace_back(i, i, inner);
  }
  Eigen::SparseMatrix<double> normal(mesh.node_count(), mesh.node_count());
  normal.setFromTriplets(terms.begin(), terms.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(normal);

  Motion carried = target;
  carried.frames.resize(3 * mesh.node_count(), target.count());
  for (Eigen::Index f = 0; f < target.count(); ++f) {
    const Eigen::Matrix3Xd skin = embedded_positions(solved.embedding, target.at(f));
    Eigen::MatrixXd right = Eigen::MatrixXd::Zero(mesh.node_count(), 3);
    for (Eigen::Index v = 0; v < skin.cols(); ++v) {
      for (int r = 0; r < 4; ++r)
        right.row(level.skin.nodes(r, v)) += shares[v] * level.skin.weights(r, v) * skin.col(v).transpose();
    }
    for (int i = 0; i < mesh.node_count(); ++i) {
      if (!inside.is_inside[static_cast<std::size_t>(i)]) continue;
      for (int c = 0; c < 4; ++c)
        right.row(i) += inner * inside.weights(c, i) * target.at(f).col(inside.nodes(c, i)).transpose();
    }
    likeness.add_to(right, f);
    carried.at(f) = factor.solve(right).transpose();
  }
  return carried;
}

/// What the patches do, for the contact points of the level: those of the same bone.
ContactSchedule carried_contacts(const ContactSchedule& solved, const Skeleton& skeleton, const Creature& level) {
  ContactSchedule contacts;
  std::vector<Eigen::Index> kept;
  for (std::size_t k = 0; k < solved.patches.size(); ++k) {
    Patch patch{solved.patches[k].name, {}, solved.patches[k].on_leg};
    for (int p = 0; p < level.contacts.bones.size(); ++p) {
      if (skeleton.names[static_cast<std::size_t>(level.contacts.bones[p])] == patch.name) patch.points.push_back(p);
    }
    if (patch.points.empty()) continue;
    contacts.patches.push_back(std::move(patch));
    contacts.state.push_back(solved.state[k]);
    kept.push_back(static_cast<Eigen::Index>(k));
  }
  contacts.sliding_x = solved.sliding_x(kept, Eigen::all);
  contacts.sliding_z = solved.sliding_z(kept, Eigen::all);
  contacts.touching.resize(level.contacts.vertices.size(), solved.touching.cols());
  return contacts;
}

/// Volume, contacts and balance of the target as the preparation leaves them. size [m] is D.
void project(const Creature& level, double size, PreparedTarget& prepared) {
  const PrepareOptions options;
  const physics::Scene scene = preparation_scene(level);
  const auto mark = [&](double height) {
    mark_touching(point_motion(scene.contact_points, prepared.target), height * size, prepared.contacts);
  };
  mark(options.contacts.load_height);
  const std::vector<std::vector<Hold>> holds =
      find_holds(prepared.contacts, point_motion(scene.contact_points, prepared.target));
  const Eigen::MatrixXd floor =
      floors(prepared.contacts, prepared.target.loop, options.clearance * size, options.clearance_frames);
  ShapeProjector projector(scene, level.length, true, prepared.firmness);
  Motion wanted = prepared.target;
  const Eigen::VectorXd reach = Eigen::VectorXd::Constant(wanted.count(), std::numeric_limits<double>::infinity());
  prepared.target = project_frames(wanted, holds, floor, reach, projector, options.smooth_hz);
  mark(kTouching);
  for (int round = 0; round < options.rounds && !scene.gravity.isZero(0); ++round) {
    const Shift shift =
        find_shift(prepared.target, scene, prepared.contacts, level.length, prepared.support_friction, 60, {}, {}, prepared.ends);
    wanted = shifted(wanted, shift, scene.body);
    prepared.target = project_frames(wanted, holds, floor, reach, projector, options.smooth_hz);
    fall_freely(prepared.contacts, scene, prepared.target);
    mark(kTouching);
  }
}

}  // namespace

PreparedTarget carried_target(const Performer& solved, const Rig& rig, const Creature& level) {
  PreparedTarget prepared = solved.prepared;
  prepared.mass_shares.resize(0);  // they are the solved mesh's; the level's masses have them already
  prepared.stiffness = 1;
  prepared.target = carried_motion(solved, rig, level);
  prepared.contacts = carried_contacts(solved.prepared.contacts, rig.skeleton, level);
  project(level, solved.size, prepared);
  prepared.stiffness = stiffness_to_bear(sag(preparation_scene(level), prepared, level.length));
  return prepared;
}

Motion carried_clip_points(const Performer& solved, const ContactPoints& contacts) {
  const MotionCurve curve(solved.clip_skin);
  Motion points = solved.clip_points;
  points.frames.resize(3 * contacts.vertices.size(), points.count());
  Eigen::Matrix3Xd x, v;
  for (Eigen::Index f = 0; f < points.count(); ++f) {
    curve.at(static_cast<double>(f) / points.rate_hz, x, v);
    points.at(f) = x(Eigen::all, contacts.vertices);
  }
  return points;
}

}  // namespace hydrostat::retarget
