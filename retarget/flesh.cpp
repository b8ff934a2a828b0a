#include "retarget/flesh.h"

#include <Eigen/Geometry>
#include <Eigen/Sparse>
#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/box_tree.h"
#include "physics/element_stiffness.h"
#include "physics/nearest_on_face.h"
#include "retarget/gravity.h"
#include "retarget/limbs.h"
#include "retarget/mesh_places.h"
#include "retarget/vibration.h"

namespace hydrostat::retarget {
namespace {

constexpr double kFinest = 4000;        // nodes that the finer mesh is meant to have, at most
constexpr double kMostPlaces = 20000;   // of its lattice, filled or not
constexpr double kInner = 0.5;          // share of the way from bone to skin that goes with the bone
constexpr double kGroundReach = 0.03;   // of L: skin that comes as near to the ground does not swing
constexpr double kOwned = 0.1;          // share of a node's bone weights from which on it has regard to a bone
constexpr double kPoissonsRatio = 0.45;
constexpr double kMostShear = 0.8;      // of the skin's flesh, in Frobenius' norm: below 1 nothing turns inside out

/// A straight piece of a bone.
struct BonePiece {
  int bone;
  Eigen::Vector3d from, to;  // [m]
};

/// Bones that move skin: from their joint to those of their children, or, at an end of the skeleton, to the middle of their skin.
std::vector<BonePiece> bone_pieces(const Rig& rig) {
  const Skeleton& skeleton = rig.skeleton;
  const Eigen::VectorXi owners = dominant_bones(rig.skin);
  std::vector<BonePiece> pieces;
  for (int b = 0; b < skeleton.count(); ++b) {
    if (!skeleton.weighted[static_cast<std::size_t>(b)]) continue;
    const Eigen::Vector3d joint = skeleton.bind_pose[static_cast<std::size_t>(b)].translation();
    bool has_child = false;
    for (int c = b + 1; c < skeleton.count(); ++c) {
      if (skeleton.parents[static_cast<std::size_t>(c)] != b || !skeleton.weighted[static_cast<std::size_t>(c)]) continue;
      has_child = true;
      pieces.push_back({b, joint, skeleton.bind_pose[static_cast<std::size_t>(c)].translation()});
    }
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double count = 0;
    for (Eigen::Index v = 0; v < owners.size(); ++v) {
      if (owners[v] != b) continue;
      sum += rig.skin.vertices.col(v);
      ++count;
    }
    if (!has_child && count > 0) pieces.push_back({b, joint, sum / count});
  }
  return pieces;
}

double distance_to(const BonePiece& piece, const Eigen::Vector3d& point) {
  const Eigen::Vector3d along = piece.to - piece.from;
  const double squared = along.squaredNorm();
  const double t = squared > 0 ? std::clamp((point - piece.from).dot(along) / squared, 0.0, 1.0) : 0;
  return (point - piece.from - t * along).norm();
}

/// How far points are from a surface.
class SurfaceDistance {
 public:
  explicit SurfaceDistance(const SkinnedMesh& skin) : skin_(skin) {
    Eigen::Matrix3Xd low(3, skin.triangles.cols()), high = low;
    for (Eigen::Index t = 0; t < skin.triangles.cols(); ++t) {
      const Eigen::Matrix3d corners = skin.vertices(Eigen::all, skin.triangles.col(t));
      low.col(t) = corners.rowwise().minCoeff();
      high.col(t) = corners.rowwise().maxCoeff();
    }
    extent_ = (high.rowwise().maxCoeff() - low.rowwise().minCoeff()).norm();
    tree_.grow(low, high);
  }

  /// [m]; `guess` [m] > 0: where the search begins.
  double to(const Eigen::Vector3d& point, double guess) const {
    for (double reach = guess;; reach *= 2) {
      double best = std::numeric_limits<double>::infinity();
      tree_.visit(point.array() - reach, point.array() + reach, [&](int t) {
        const Eigen::Matrix3d corners = skin_.vertices(Eigen::all, skin_.triangles.col(t));
        Eigen::Vector3d weights;
        physics::nearest_on_face<3>(point, corners, weights);
        best = std::min(best, (corners * weights - point).norm());
      });
      if (best <= reach || reach > 4 * extent_) return best;
    }
  }

 private:
  const SkinnedMesh& skin_;
  physics::BoxTree<3> tree_;
  double extent_ = 0;
};

/// Cells of half the size of the control mesh's, or larger ones where these would be too many.
Eigen::Vector3i finer_lattice(const ControlMesh& mesh, const SkinnedMesh& skin) {
  const Eigen::Matrix<double, 3, 4> tet = mesh.nodes(Eigen::all, mesh.tets.col(0));  // spans its cell
  const Eigen::Vector3d cell = tet.rowwise().maxCoeff() - tet.rowwise().minCoeff();
  const Eigen::Vector3d extent = skin.vertices.rowwise().maxCoeff() - skin.vertices.rowwise().minCoeff();
  const Eigen::Vector3d cells = (extent.array() / cell.array()).round().max(1);
  const double room = std::min(kFinest / static_cast<double>(mesh.nodes.cols()), kMostPlaces / cells.prod());
  return (std::clamp(std::cbrt(room), 1.0, 2.0) * cells).array().round().cast<int>();
}

void hold_inside(const Rig& rig, const std::vector<BonePiece>& pieces, Flesh& flesh) {
  const SurfaceDistance surface(rig.skin);
  for (Eigen::Index n = 0; n < flesh.mesh.nodes.cols(); ++n) {
    const Eigen::Vector3d place = flesh.mesh.nodes.col(n);
    double to_bone = std::numeric_limits<double>::infinity();
    for (const BonePiece& piece : pieces) {
      if (flesh.mesh.bone_weights(piece.bone, n) >= kOwned) to_bone = std::min(to_bone, distance_to(piece, place));
    }
    if (!std::isfinite(to_bone)) continue;
    const double to_skin = surface.to(place, flesh.mesh.cell_size.minCoeff());
    if (to_bone <= kInner * (to_bone + to_skin)) flesh.held[static_cast<std::size_t>(n)] = 1;
  }
}

/// The nodes of all tets that a bone runs through.
void hold_along(const std::vector<BonePiece>& pieces, Flesh& flesh) {
  const double step = 0.5 * flesh.mesh.cell_size.minCoeff();
  std::vector<Eigen::Vector3d> places;
  std::vector<int> bones;
  for (const BonePiece& piece : pieces) {
    const auto steps = static_cast<int>(std::ceil((piece.to - piece.from).norm() / step));
    for (int s = 0; s <= steps; ++s) {
      places.emplace_back(piece.from + (steps > 0 ? static_cast<double>(s) / steps : 0.0) * (piece.to - piece.from));
      bones.push_back(piece.bone);
    }
  }
  const auto count = static_cast<Eigen::Index>(places.size());
  Eigen::Matrix3Xd points(3, count);
  Eigen::MatrixXd owners = Eigen::MatrixXd::Zero(flesh.mesh.bone_weights.rows(), count);
  for (Eigen::Index i = 0; i < count; ++i) {
    points.col(i) = places[static_cast<std::size_t>(i)];
    owners(bones[static_cast<std::size_t>(i)], i) = 1;
  }
  const Places found = locate(flesh.mesh, flesh.mesh.bone_weights, points, owners);
  for (Eigen::Index i = 0; i < count; ++i) {
    if (!found.is_inside[static_cast<std::size_t>(i)]) continue;
    for (const int n : found.nodes.col(i)) flesh.held[static_cast<std::size_t>(n)] = 1;
  }
}

/// The nodes that carry skin which the clip brings to the ground, or that touches it by plan.
void hold_on_ground(const Performer& performer, Flesh& flesh) {
  const physics::Ground& ground = performer.scene.ground;
  const Motion& clip = performer.clip_skin;
  std::vector<char> touches(static_cast<std::size_t>(flesh.skin.nodes.cols()), 0);
  for (Eigen::Index f = 0; f < clip.count(); ++f) {
    for (std::size_t v = 0; v < touches.size(); ++v) {
      const double height = ground.normal.dot(clip.at(f).col(static_cast<Eigen::Index>(v))) - ground.offset;
      if (height < kGroundReach * performer.length) touches[v] = 1;
    }
  }
  for (const Patch& patch : performer.prepared.contacts.patches) {
    for (const int p : patch.points) touches[static_cast<std::size_t>(performer.contacts.vertices[p])] = 1;
  }
  for (std::size_t v = 0; v < touches.size(); ++v) {
    if (!touches[v]) continue;
    for (const int n : flesh.skin.nodes.col(static_cast<Eigen::Index>(v))) flesh.held[static_cast<std::size_t>(n)] = 1;
  }
}

/// Stiffness and mass of what is not held.
struct FreeFlesh {
  Eigen::VectorXi place;  // n: of a node among those that are free, -1 of one that is held
  Eigen::SparseMatrix<double> stiffness;
  Eigen::VectorXd mass;  // of each coordinate
};

FreeFlesh free_flesh(const Flesh& flesh, double density, double youngs_modulus) {
  const ControlMesh& mesh = flesh.mesh;
  const physics::ElementMesh<3> cells{mesh.nodes, mesh.cell_nodes, {{density, youngs_modulus, kPoissonsRatio}},
                                      mesh.tet_fill(Eigen::seqN(0, mesh.cells, mesh.tets.cols() / mesh.cells))};
  const physics::ElementBlock<3> block = physics::make_element_block(cells, physics::ElasticLaw::kCorotatedLinear);
  FreeFlesh result{Eigen::VectorXi::Constant(mesh.nodes.cols(), -1), {}, {}};
  int count = 0;
  for (Eigen::Index n = 0; n < result.place.size(); ++n) {
    if (!flesh.held[static_cast<std::size_t>(n)]) result.place[n] = count++;
  }
  std::vector<Eigen::Triplet<double>> entries;
  for (int e = 0; e < block.element_count(); ++e) {
    const physics::ElementMatrix own = physics::element_stiffness<3>(block, e, mesh.nodes, nullptr, physics::Definiteness::kExact);
    for (int a = 0; a < 24; ++a) {
      for (int b = 0; b < 24; ++b) {
        const int i = result.place[block.nodes(a / 3, e)], j = result.place[block.nodes(b / 3, e)];
        if (i >= 0 && j >= 0) entries.emplace_back(3 * i + a % 3, 3 * j + b % 3, own(a, b));
      }
    }
  }
  result.stiffness.resize(3 * count, 3 * count);
  result.stiffness.setFromTriplets(entries.begin(), entries.end());
  Eigen::VectorXd mass = Eigen::VectorXd::Zero(mesh.nodes.cols());
  physics::add_lumped_mass(block, mass);
  result.mass.resize(3 * count);
  for (Eigen::Index n = 0; n < mass.size(); ++n) {
    if (result.place[n] >= 0) result.mass.segment<3>(3 * result.place[n]).setConstant(mass[n]);
  }
  return result;
}

/// The greatest norm of the gradient of offsets (3 x n) [1/m] in a tet of the mesh.
double greatest_gradient(const ControlMesh& mesh, const Eigen::Ref<const Eigen::Matrix3Xd>& offsets) {
  double greatest = 0;
  for (const auto nodes : mesh.tets.colwise()) {
    Eigen::Matrix3d spans, moves;
    for (int k = 0; k < 3; ++k) {
      spans.col(k) = mesh.nodes.col(nodes[k + 1]) - mesh.nodes.col(nodes[0]);
      moves.col(k) = offsets.col(nodes[k + 1]) - offsets.col(nodes[0]);
    }
    greatest = std::max(greatest, (moves * spans.inverse()).norm());
  }
  return greatest;
}

}  // namespace

Flesh make_flesh(const Performer& performer, const Rig& rig) {
  Flesh flesh;
  BodyOptions options;
  options.lattice = finer_lattice(performer.mesh, rig.skin);
  flesh.mesh = build_control_mesh(rig.skeleton, rig.skin, options);
  flesh.skin = embed_skin(flesh.mesh, rig.skin);
  flesh.held.assign(static_cast<std::size_t>(flesh.mesh.nodes.cols()), 0);
  const std::vector<BonePiece> pieces = bone_pieces(rig);
  hold_inside(rig, pieces, flesh);
  hold_along(pieces, flesh);
  hold_on_ground(performer, flesh);
  return flesh;
}

Wobble flesh_modes(const Performer& performer, const Rig& rig, const Flesh& flesh, Eigen::Index count) {
  const double density = performer.scene.body.mass.sum() / std::pow(performer.size, 3);
  const FreeFlesh free = free_flesh(flesh, density, density * kGravity * performer.length / kFleshSoftness);
  const Vibration vibration = lowest_modes(free.stiffness, free.mass, count);
  const Eigen::Index kept = vibration.squared_frequency.size();
  const Places places = locate(performer.mesh, rig.bone_weights, flesh.mesh.nodes, flesh.mesh.bone_weights);
  Wobble wobble;
  wobble.frequency_hz = vibration.squared_frequency.cwiseSqrt() / (2 * M_PI);
  wobble.shapes.resize(performer.skin.vertices.size(), kept);
  wobble.drive = Eigen::MatrixXd::Zero(performer.mesh.nodes.size(), kept);
  wobble.most.resize(kept);
  wobble.mean_load = Eigen::VectorXd::Zero(kept);
  wobble.start = Eigen::MatrixX2d::Zero(kept, 2);
  for (Eigen::Index k = 0; k < kept; ++k) {
    Eigen::Matrix3Xd offsets = Eigen::Matrix3Xd::Zero(3, flesh.mesh.nodes.cols());
    for (Eigen::Index n = 0; n < offsets.cols(); ++n) {
      const int place = free.place[n];
      if (place < 0) continue;
      offsets.col(n) = vibration.shapes.col(k).segment<3>(3 * place);
      const Eigen::Vector3d weighed = free.mass[3 * place] * offsets.col(n);
      for (int c = 0; c < 4; ++c)
        wobble.drive.col(k).segment<3>(3 * places.nodes(c, n)) += places.weights(c, n) * weighed;
    }
    const Eigen::Matrix3Xd skin = embedded_positions(flesh.skin, offsets);
    const double largest = std::max(skin.colwise().norm().maxCoeff(), 1e-9 * offsets.colwise().norm().maxCoeff());
    wobble.shapes.col(k) = skin.reshaped() / largest;
    wobble.drive.col(k) *= largest;
    wobble.most[k] = kMostShear * largest / std::max(greatest_gradient(flesh.mesh, offsets), 1e-300);
  }
  return wobble;
}

}  // namespace hydrostat::retarget
