#include "retarget/creature.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "physics/element_body.h"
#include "physics/element_calibration.h"
#include "retarget/com_path.h"
#include "retarget/error.h"
#include "retarget/gravity.h"
#include "retarget/loop.h"
#include "retarget/mirror.h"

namespace hydrostat::retarget {
namespace {

constexpr double kLargest = 30, kSmallest = 0.01;  // [m] of a creature's longest extent
constexpr double kSkinRate = 30;                   // [Hz] that will do to look at
constexpr double kLoopTolerance = 0.02;            // of L
constexpr double kRecoveredStillSpeed = 0.6;       // of the RMS speed: the pace of a clip in place is known that well
constexpr const char* kFromFeet = "from feet";
constexpr double kOwnTravel = 0.05;                // of L: less is a clip in place, which is there to be repeated
constexpr double kOrigins = 256;                   // [m] between the places that a clip may be brought from
constexpr double kFlight = 0.05;                   // of D above the ground
constexpr double kRoughFlight = 0.01;              // of L: about the same, before there is a body
constexpr Eigen::Index kMirrorFrames = 60;         // of a clip, at most, that are looked at for its mirror image
constexpr Eigen::Index kLoopVertices = 500;        // of a skin, at most, that tell of a loop

void scale_character(Character& character, double scale) {
  const auto scaled = [scale](const Eigen::Affine3d& pose) {
    Eigen::Affine3d result = pose;
    result.translation() *= scale;
    return result;
  };
  character.skin.vertices *= scale;
  for (MorphTarget& morph : character.skin.morphs) morph.offsets *= scale;
  for (Eigen::Affine3d& pose : character.skeleton.bind_pose) pose = scaled(pose);
  for (auto& frame : character.clip.bone_pose) {
    for (Eigen::Affine3d& pose : frame) pose = scaled(pose);
  }
}

physics::Body spring_body(const ControlMesh& mesh, double density, double youngs_modulus, double damping_time) {
  physics::Material material;
  material.density = density;
  material.youngs_modulus = youngs_modulus;
  material.damping_time = damping_time;
  return physics::make_body(mesh.nodes, mesh.tets, mesh.edges, mesh.tet_fill, material);
}

physics::Body element_body(const Creature& creature, const CreatureOptions& options) {
  const ControlMesh& mesh = creature.mesh;
  const std::vector<physics::ElementMaterial> materials{{options.density, creature.youngs_modulus, options.poissons_ratio}};
  const physics::ElementMesh<3> cells{mesh.nodes, mesh.cell_nodes, materials,
                                      mesh.tet_fill(Eigen::seqN(0, mesh.cells, mesh.tets.cols() / mesh.cells))};
  const physics::ElementMesh<3> tets{mesh.nodes, mesh.tets, materials, mesh.tet_fill};
  physics::ElementMesh<3> elements = options.hexahedra ? cells : tets;
  if (options.calibrated && !options.hexahedra) {
    elements.materials.front().youngs_modulus *= physics::unlocking_factor<3>(tets, cells);
  }
  physics::ElementBodyOptions body_options;
  body_options.law = options.material == BodyMaterial::kCorotatedLinear ? physics::ElasticLaw::kCorotatedLinear
                                                                        : physics::ElasticLaw::kStableNeoHookean;
  body_options.damping_time = options.damping_time * std::sqrt(creature.length);
  return physics::make_body<3>(elements, mesh.tets, body_options);
}

/// Takes a clip that begins far from its origin to it, by whole multiples of a power of two so that nothing is rounded. Returns how
/// far away it was [m].
double bring_to_origin(Character& character) {
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  if (character.clip.bone_pose.empty() || character.clip.bone_pose.front().empty()) return 0;
  for (const Eigen::Affine3d& pose : character.clip.bone_pose.front()) shift += pose.translation();
  shift = kOrigins * (shift / static_cast<double>(character.clip.bone_pose.front().size()) / kOrigins).array().round();
  if (shift.isZero(0)) return 0;
  for (auto& frame : character.clip.bone_pose) {
    for (Eigen::Affine3d& pose : frame) pose.translation() -= shift;
  }
  return shift.norm();
}

/// The clip as a loop, where it is one and is not meant to be played once. Points' masses, L and a flight's least height [m].
Motion looped(const Motion& clip, const Eigen::VectorXd& mass, double length, double flight_height) {
  const Motion loop = close_loop(clip, mass, kLoopTolerance * length);
  const bool is_for_once = loop.travel.norm() > kOwnTravel * length && was_made_to_be_played_once(clip, mass, flight_height);
  return is_for_once ? clip : loop;
}

/// Whether the clip is a loop and not meant to be played once, by a few of the skin's vertices.
bool is_loop(const Character& character, double length) {
  const auto& [skeleton, skin, clip] = character;
  SkinnedMesh few;
  std::vector<Eigen::Index> kept;
  for (Eigen::Index v = 0; v < skin.vertices.cols(); v += (skin.vertices.cols() + kLoopVertices - 1) / kLoopVertices) {
    kept.push_back(v);
    few.skin_weights.push_back(skin.skin_weights[static_cast<std::size_t>(v)]);
  }
  few.vertices = skin.vertices(Eigen::all, kept);
  Motion motion;
  motion.rate_hz = clip.rate_hz;
  motion.frames.resize(few.vertices.size(), clip.frames());
  for (Eigen::Index f = 0; f < clip.frames(); ++f)
    motion.at(f) = skin_positions(skeleton, few, clip.bone_pose[static_cast<std::size_t>(f)], {});
  return looped(motion, Eigen::VectorXd::Ones(few.vertices.cols()), length, kRoughFlight * length).loop;
}

/// The axis across which the body is its own mirror image, in the bind pose and in every moment of a clip that is a loop: what turns it a
/// little adds up there, and what is played once has its own times.
std::optional<int> mirror_axis_of_loop(const Character& character, double length) {
  const Eigen::Index frames = character.clip.frames(), looked_at = std::min(frames, kMirrorFrames);
  if (looked_at < 2 || !is_loop(character, length)) return std::nullopt;
  Motion skin;
  skin.frames.resize(character.skin.vertices.size(), looked_at);
  for (Eigen::Index k = 0; k < looked_at; ++k) skin.at(k) = skin_positions(character, k * (frames - 1) / (looked_at - 1));
  const std::optional<int> across = mirror_axis(skin, length);
  return across && is_mirror_image(character.skin.vertices, *across, length) ? across : std::nullopt;
}

/// The skin's vertices with the moves that made the clip a loop with its travel on the ground. `loop` is the clip as
/// close_loop leaves it.
Motion skin_motion(const Character& character, const Motion& loop, const RootMotionResult& root, double ground) {
  const auto vertices_at = [&](Eigen::Index f) { return skin_positions(character, f); };
  const Eigen::Index frames = loop.count();
  const Eigen::Index stride = loop.rate_hz > 1.5 * kSkinRate && (!loop.loop || frames % 2 == 0) ? 2 : 1;
  Motion skin;
  skin.rate_hz = loop.rate_hz / static_cast<double>(stride);
  skin.loop = loop.loop;
  skin.travel = loop.travel + root.travel;
  skin.yaw = loop.yaw;
  skin.frames.resize(character.skin.vertices.size(), (frames + stride - 1) / stride);
  Eigen::Matrix3Xd defect = Eigen::Matrix3Xd::Zero(3, character.skin.vertices.cols());
  if (loop.loop) defect = closure_defect(loop, vertices_at(0), vertices_at(frames));
  for (Eigen::Index k = 0; k < skin.count(); ++k) {
    const Eigen::Index f = k * stride;
    const Eigen::Vector3d move = root.offset.col(f) - Eigen::Vector3d(0, ground, 0);
    skin.at(k) = (vertices_at(f) + closure_move(loop, static_cast<double>(f) / static_cast<double>(frames), defect)).colwise() + move;
  }
  return skin;
}

}  // namespace

PrepareOptions prepare_options(const ImportedMotion& imported) {
  PrepareOptions options;
  if (imported.root_motion == kFromFeet) options.contacts.still_speed = kRecoveredStillSpeed;
  return options;
}

physics::Scene preparation_scene(const Creature& creature) {
  physics::Scene scene = creature.scene;
  if (scene.body.elements.empty()) return scene;
  const physics::ElementMaterial& material = scene.body.elements.front().materials.front();
  scene.body = spring_body(creature.mesh, material.density, creature.youngs_modulus, 0);
  scene.body.mass = creature.scene.body.mass;
  return scene;
}

std::vector<int> bones_of(const ContactPoints& contacts) { return {contacts.bones.data(), contacts.bones.data() + contacts.bones.size()}; }

Creature make_creature(const Character& character, const CreatureOptions& options) {
  Creature creature;
  creature.character = character;
  const Eigen::Vector3d extent = character.skin.vertices.rowwise().maxCoeff() - character.skin.vertices.rowwise().minCoeff();
  if (options.height_m > 0) {
    creature.scale = options.height_m / extent.y();
  } else if (extent.maxCoeff() > kLargest || extent.maxCoeff() < kSmallest) {
    creature.scale = 1 / extent.maxCoeff();
    char text[200];
    std::snprintf(text, sizeof text, "the character is %.3g m long, which is no creature's size: scaled to 1 m (--height decides)", extent.maxCoeff());
    creature.warnings.push_back(text);
  }
  if (creature.scale != 1) scale_character(creature.character, creature.scale);
  creature.length = extent.maxCoeff() * creature.scale;
  if (const double away = bring_to_origin(creature.character); away > 0) {
    char text[120];
    std::snprintf(text, sizeof text, "the clip begins far from its origin: the creature is moved by %.0f m to stand near it", away);
    creature.warnings.push_back(text);
  }

  const std::optional<int> across = mirror_axis_of_loop(creature.character, creature.length);
  creature.is_mirror_image = across.has_value();
  BodyOptions body_options;
  body_options.nodes = options.nodes;
  body_options.mirror_axis = across;
  creature.mesh = build_control_mesh(creature.character.skeleton, creature.character.skin, body_options);
  creature.skin = embed_skin(creature.mesh, creature.character.skin);
  creature.contacts = contact_points(creature.mesh, creature.character.skeleton, creature.character.skin, creature.is_mirror_image);

  creature.youngs_modulus = options.density * kGravity * creature.length / options.softness;
  creature.scene.body = options.material == BodyMaterial::kSprings
                            ? spring_body(creature.mesh, options.density, creature.youngs_modulus,
                                          options.damping_time * std::sqrt(creature.length))
                            : element_body(creature, options);
  creature.scene.contact_points = {creature.contacts.embedding.nodes, creature.contacts.embedding.weights};
  creature.scene.ground.friction = options.friction;
  creature.size = std::cbrt(creature.scene.body.mass.sum() / options.density);
  return creature;
}

ImportedMotion import_motion(const Creature& creature, const CreatureOptions& options) {
  const Character& character = creature.character;
  CouplingOptions coupling_options;
  coupling_options.threads = options.threads;
  coupling_options.symmetric = creature.is_mirror_image;
  const CoupledMotion coupled = couple(character, creature.mesh, creature.skin, coupling_options);
  ImportedMotion result;
  result.coupling.error_rms_length = coupled.error_rms_length;
  result.coupling.error_max_length = coupled.error_max_length;

  // Nodes and skin points go through one loop closure and one recovery of travel, so they stay together.
  const Eigen::Index nodes = creature.mesh.nodes.cols(), points = creature.contacts.vertices.size(), frames = coupled.motion.count();
  Motion both = coupled.motion;
  both.frames.conservativeResize(3 * (nodes + points), Eigen::NoChange);
  for (Eigen::Index f = 0; f < frames; ++f) {
    const Eigen::Matrix3Xd skin = skin_positions(character, f);
    for (Eigen::Index p = 0; p < points; ++p) both.frames.col(f).segment<3>(3 * (nodes + p)) = skin.col(creature.contacts.vertices[p]);
  }
  Eigen::VectorXd mass = Eigen::VectorXd::Zero(nodes + points);
  mass.head(nodes) = creature.scene.body.mass;
  both = looped(both, mass, creature.length, kFlight * creature.size);
  Motion skin_points = both;
  skin_points.frames = both.frames.bottomRows(3 * points);
  Motion com = both;
  com.frames = com_path(both, mass);
  const RootMotionResult root = recover_root_motion(skin_points, com, creature.length, options.root_motion);
  result.root_motion = root.recovered ? kFromFeet : options.root_motion == RootMotion::kNone ? "none" : "clip";
  const Motion loop = both;
  for (Eigen::Index f = 0; f < both.count(); ++f) {
    for (Eigen::Index i = 0; i < nodes + points; ++i) both.frames.col(f).segment<3>(3 * i) += root.offset.col(f);
  }
  both.travel += root.travel;
  const double ground = ground_height([&] {
    Motion moved = both;
    moved.frames = both.frames.bottomRows(3 * points);
    return moved;
  }());
  for (Eigen::Index r = 1; r < both.frames.rows(); r += 3) both.frames.row(r).array() -= ground;
  result.nodes = both;
  result.nodes.frames = both.frames.topRows(3 * nodes);
  result.skin_points = both;
  result.skin_points.frames = both.frames.bottomRows(3 * points);
  result.skin = skin_motion(character, loop, root, ground);
  for (const std::string& name : coupled.left_large_morphs) {
    result.warnings.push_back("morph target '" + name +
                              "' is large and changes the body's volume: the skin wears it, but contact and balance know nothing of it");
  }
  result.morphs = {left_by_nodes(character.skin.morphs, coupled.node_morphs, creature.skin),
                   closed_weights(character.clip.morph_weights, loop), loop.rate_hz, loop.loop};
  return result;
}

}  // namespace hydrostat::retarget
