#include "io/stage_records.h"

#include <stdexcept>

#include "io/packed_result.h"
#include "physics/element_body.h"

namespace hydrostat::io {
namespace {

constexpr const char* kTargetTitle = "hydrostat.target";
constexpr const char* kTargetVersion = "4";
constexpr const char* kRigTitle = "hydrostat.rig";
constexpr const char* kRigVersion = "1";
constexpr const char* kAppearanceTitle = "hydrostat.appearance";
constexpr const char* kAppearanceVersion = "1";
constexpr const char* kMorphsTitle = "hydrostat.morphs";
constexpr const char* kMorphsVersion = "1";

/// Skin weights one after the other.
struct Influences {
  Eigen::MatrixXi places;  // 2 x I: which vertex, which bone
  Eigen::VectorXd weights;
};

Influences in_a_row(const retarget::SkinnedMesh& skin) {
  Eigen::Index total = 0, i = 0;
  for (const auto& influences : skin.skin_weights) total += static_cast<Eigen::Index>(influences.size());
  Influences row{Eigen::MatrixXi(2, total), Eigen::VectorXd(total)};
  for (std::size_t v = 0; v < skin.skin_weights.size(); ++v) {
    for (const auto& influence : skin.skin_weights[v]) {
      row.places.col(i) << static_cast<int>(v), influence.bone;
      row.weights[i++] = influence.weight;
    }
  }
  return row;
}

/// Throws std::out_of_range for influences on vertices that there are not.
void hand_out(const Influences& row, retarget::SkinnedMesh& skin) {
  if (row.places.rows() != 2 || row.places.cols() != row.weights.size()) throw std::out_of_range("influences");
  skin.skin_weights.assign(static_cast<std::size_t>(skin.vertices.cols()), {});
  for (Eigen::Index i = 0; i < row.weights.size(); ++i)
    skin.skin_weights.at(static_cast<std::size_t>(row.places(0, i))).push_back({row.places(1, i), row.weights[i]});
}

}  // namespace

// The fields of each type by their names in the files. A type within another comes before it.

void name_fields(RecordArchive& archive, retarget::Motion& motion) {
  archive.fields("rate_hz", motion.rate_hz, "frames", motion.frames, "loop", motion.loop, "travel", motion.travel, "yaw",
                 motion.yaw);
}

void name_fields(RecordArchive& archive, retarget::Skeleton& skeleton) {
  archive.fields("names", skeleton.names, "parents", skeleton.parents, "bind_pose", skeleton.bind_pose, "weighted",
                 skeleton.weighted);
}

void name_fields(RecordArchive& archive, retarget::MorphTarget& morph) {
  archive.fields("name", morph.name, "vertices", morph.vertices, "offsets", morph.offsets);
}

void name_fields(RecordArchive& archive, retarget::MovingMorphs& morphs) {
  archive.list("targets", "target", morphs.targets);
  archive.fields("weights", morphs.weights, "rate_hz", morphs.rate_hz, "loop", morphs.loop);
}

void name_fields(RecordArchive& archive, retarget::SkinnedMesh& skin) {
  Influences row = in_a_row(skin);
  archive.fields("vertices", skin.vertices, "triangles", skin.triangles);
  archive.fields("influence_places", row.places, "influence_weights", row.weights);
  archive.list("morphs", "morph", skin.morphs);
  if (archive.is_loading()) hand_out(row, skin);
}

void name_fields(RecordArchive& archive, retarget::Clip& clip) {
  archive.fields("name", clip.name, "index", clip.index, "duration_s", clip.duration_s, "range_s", clip.range_s,
                 "key_rate_hz", clip.key_rate_hz, "rate_hz", clip.rate_hz, "morph_weights", clip.morph_weights);
  archive.list("frames", "frame", clip.bone_pose);
}

void name_fields(RecordArchive& archive, retarget::Character& character) {
  archive.fields("skeleton", character.skeleton, "skin", character.skin, "clip", character.clip);
}

void name_fields(RecordArchive& archive, ImportedCharacter& imported) {
  archive.fields("character", imported.character, "warnings", imported.warnings);
}

void name_fields(RecordArchive& archive, retarget::Rig& rig) {
  archive.fields("skeleton", rig.skeleton, "skin", rig.skin, "bone_weights", rig.bone_weights);
}

void name_fields(RecordArchive& archive, retarget::ControlMesh& mesh) {
  archive.fields("nodes", mesh.nodes, "tets", mesh.tets, "edges", mesh.edges, "tet_fill", mesh.tet_fill, "origin",
                 mesh.origin, "cell_size", mesh.cell_size, "cell_nodes", mesh.cell_nodes, "cell_places", mesh.cell_places,
                 "vertex_cells", mesh.vertex_cells, "bone_weights", mesh.bone_weights, "cells", mesh.cells, "bridged_cells",
                 mesh.bridged_cells, "copied_cells", mesh.copied_cells, "pieces", mesh.pieces);
}

void name_fields(RecordArchive& archive, retarget::Embedding& embedding) {
  archive.fields("tets", embedding.tets, "nodes", embedding.nodes, "weights", embedding.weights, "max_miss",
                 embedding.max_miss);
}

void name_fields(RecordArchive& archive, retarget::ContactPoints& contacts) {
  archive.fields("vertices", contacts.vertices, "bones", contacts.bones, "embedding", contacts.embedding);
}

void name_fields(RecordArchive& archive, physics::ElementMaterial& material) {
  archive.fields("density", material.density, "youngs_modulus", material.youngs_modulus, "poissons_ratio",
                 material.poissons_ratio);
}

struct ElementRecord {
  Eigen::MatrixXi nodes;
  Eigen::VectorXd fill;
  std::vector<physics::ElementMaterial> materials;
  physics::ElasticLaw law = physics::ElasticLaw::kStableNeoHookean;
};

void name_fields(RecordArchive& archive, ElementRecord& elements) {
  archive.fields("nodes", elements.nodes, "fill", elements.fill, "law", elements.law);
  archive.list("materials", "material", elements.materials);
}

/// What the elements are made from; loading makes them again.
void name_elements(RecordArchive& archive, physics::Body& body) {
  std::vector<ElementRecord> records;
  for (const physics::BodyElements<3>& elements : body.elements)
    records.push_back({elements.block.nodes, elements.fill, elements.materials, elements.block.law});
  archive.list("elements", "block", records);
  if (!archive.is_loading()) return;
  body.elements.clear();
  for (const ElementRecord& record : records) {
    body.elements.push_back(
        physics::make_body_elements<3>({body.rest, record.nodes, record.materials, record.fill}, record.law));
  }
}

void name_fields(RecordArchive& archive, physics::Scene& scene) {
  physics::Body& body = scene.body;
  archive.fields("rest", body.rest, "mass", body.mass, "edges", body.edges, "rest_length", body.rest_length,
                 "edge_stiffness", body.edge_stiffness, "edge_damping", body.edge_damping, "tets", body.tets, "tet_edges",
                 body.tet_edges, "rest_volume", body.rest_volume, "volume_stiffness", body.volume_stiffness);
  name_elements(archive, body);
  archive.fields("point_nodes", scene.contact_points.nodes, "point_weights", scene.contact_points.weights, "ground_normal",
                 scene.ground.normal, "ground_offset", scene.ground.offset, "friction", scene.ground.friction, "has_ground",
                 scene.has_ground, "gravity", scene.gravity);
}

void name_fields(RecordArchive& archive, retarget::Creature& creature) {
  archive.fields("character", creature.character, "scale", creature.scale, "mesh", creature.mesh, "skin", creature.skin,
                 "contacts", creature.contacts, "scene", creature.scene, "length", creature.length, "size", creature.size,
                 "is_mirror_image", creature.is_mirror_image, "youngs_modulus", creature.youngs_modulus, "warnings", creature.warnings);
}

void name_fields(RecordArchive& archive, retarget::CouplingReport& report) {
  archive.fields("error_rms_length", report.error_rms_length, "error_max_length", report.error_max_length);
}

void name_fields(RecordArchive& archive, retarget::ImportedMotion& imported) {
  archive.fields("nodes", imported.nodes, "skin_points", imported.skin_points, "skin", imported.skin, "morphs",
                 imported.morphs, "coupling", imported.coupling, "root_motion", imported.root_motion, "warnings", imported.warnings);
}

void name_fields(RecordArchive& archive, retarget::Patch& patch) {
  archive.fields("name", patch.name, "points", patch.points, "on_leg", patch.on_leg);
}

void name_fields(RecordArchive& archive, retarget::ContactSchedule& contacts) {
  archive.list("patches", "patch", contacts.patches);
  archive.list("states", "patch", contacts.state, "/state");
  archive.fields("touching", contacts.touching, "sliding_x", contacts.sliding_x, "sliding_z", contacts.sliding_z);
}

void name_fields(RecordArchive& archive, retarget::PreparationReport& report) {
  archive.fields("smooth_shift", report.smooth_shift_rms_length, "foot_shift", report.foot_shift_rms_length, "volume_shift",
                 report.volume_shift_rms_length, "momentum_shift", report.momentum_shift_rms_length, "total_shift",
                 report.total_shift_rms_length, "missing_wrench_rms", report.missing_wrench_rms_mg, "missing_wrench_max",
                 report.missing_wrench_max_mg, "flight", report.flight_s, "min_jacobian", report.min_jacobian,
                 "volume_error", report.volume_error_rms);
}

void name_fields(RecordArchive& archive, retarget::PreparedTarget& prepared) {
  archive.fields("target", prepared.target, "contacts", prepared.contacts, "missing_wrench", prepared.missing_wrench,
                 "mass_shares", prepared.mass_shares, "stiffness", prepared.stiffness, "support_friction", prepared.support_friction,
                 "firmness", prepared.firmness, "rests_first", prepared.ends.first, "rests_last", prepared.ends.last, "report",
                 prepared.report, "warnings", prepared.warnings);
}

void name_fields(RecordArchive& archive, retarget::InverseReport& report) {
  archive.fields("miss", report.miss_rms_length, "root_residual", report.root_residual_mg, "kkt_residual",
                 report.kkt_residual, "saturated", report.saturated, "max_strain", report.max_strain, "p95_strain",
                 report.p95_strain, "limit", report.limit);
}

void name_fields(RecordArchive& archive, retarget::InverseDynamics& inverse) {
  archive.fields("activation", inverse.activation, "penalty_force", inverse.penalty_force, "contact_force",
                 inverse.contact_force, "miss", inverse.miss, "report", inverse.report);
}

void name_fields(RecordArchive& archive, retarget::ReplayReport& report) {
  archive.fields("cycles", report.cycles, "duration", report.duration_s, "fell", report.fell, "fall_time",
                 report.fall_time_s, "fall_cause", report.fall_cause, "shape", report.shape_rms_length, "clip_shape",
                 report.clip_shape_rms_length, "world", report.world_rms_length, "drift", report.drift_per_cycle_length,
                 "heading", report.heading_deg_per_cycle, "travel", report.travel_per_cycle_length, "clip_travel",
                 report.clip_travel_per_cycle_length, "slip", report.slip_per_stance_length, "held_slip",
                 report.held_slip_per_stance_length, "sole_gap", report.sole_gap_length, "penetration", report.penetration_max_size, "volume_error", report.volume_error_max,
                 "momentum_residual", report.momentum_residual_mg, "angular_residual", report.angular_residual_mgl,
                 "external_assist", report.external_assist_mg, "external_assist_time", report.external_assist_time_s,
                 "inverted_elements", report.inverted_elements, "guard_steps", report.guard_steps, "feedback", report.feedback_rms, "correction", report.correction_rms, "correction_buzz",
                 report.correction_buzz_rms, "style_range", report.style_range, "style_range_least", report.style_range_least, "real_time_factor", report.real_time_factor,
                 "apex_rise", report.apex_rise_length, "clip_apex_rise", report.clip_apex_rise_length);
}

void name_fields(RecordArchive& archive, retarget::Replay& replay) {
  retarget::ReplayCourse& course = replay.course;
  archive.fields("motion", replay.motion, "report", replay.report, "time", course.time_s, "height", course.height, "heading",
                 course.heading_deg, "correction", course.correction, "saturated", course.saturated, "volume_ratio",
                 course.volume_ratio, "slip_speed", course.slip_speed, "com", course.com, "target_com", course.target_com,
                 "diverged", replay.termination);
  archive.list("patches", "patch", course.patch_state);
}

void name_fields(RecordArchive& archive, retarget::Feedback& feedback) {
  archive.fields("effort", feedback.effort, "horizon", feedback.horizon, "root_weight", feedback.root_weight, "regulator",
                 feedback.regulator);
}

void name_fields(RecordArchive& archive, retarget::Performances& performances) {
  archive.fields("naive", performances.naive, "open_loop", performances.open_loop, "closed_loop", performances.closed_loop,
                 "feedback", performances.feedback, "lapse", performances.lapse,
                 "wished_lapse", performances.wished_lapse, "trials_lost", performances.trials_lost);
}

void name_fields(RecordArchive& archive, retarget::SourceReport& report) {
  archive.fields("file", report.file, "sha256", report.sha256, "clip", report.clip, "root_motion", report.root_motion,
                 "duration", report.duration_s, "rate", report.rate_hz, "scale", report.scale);
}

void name_fields(RecordArchive& archive, retarget::BodyReport& report) {
  archive.fields("nodes", report.nodes, "elements", report.elements, "constraints", report.constraints, "vertices",
                 report.vertices, "pieces", report.pieces, "bridged_cells", report.bridged_cells, "copied_cells",
                 report.copied_cells, "mass", report.mass_kg, "length", report.length_m, "size", report.size_m,
                 "youngs_modulus", report.youngs_modulus_pa);
}

void name_fields(RecordArchive& archive, PerformedTarget& target) {
  archive.fields("muscle_fields", target.performer.muscles.fields, "prepared", target.performer.prepared, "clip_points",
                 target.performer.clip_points, "clip_skin", target.performer.clip_skin, "source", target.report.source,
                 "body", target.report.body, "coupling", target.report.coupling, "preparation", target.report.preparation,
                 "inverse", target.report.inverse, "signal_error", target.report.signals.error_rms_l0, "warnings",
                 target.report.warnings);
}

void name_fields(RecordArchive& archive, Image& image) { archive.fields("name", image.name, "bytes", image.bytes); }

void name_fields(RecordArchive& archive, TextureMap& map) {
  archive.fields("image", map.image, "uv_set", map.uv_set, "wrap_u", map.wrap_u, "wrap_v", map.wrap_v, "magnify_filter",
                 map.magnify_filter, "minify_filter", map.minify_filter, "strength", map.strength, "offset", map.offset,
                 "scale", map.scale, "turn", map.turn);
}

void name_fields(RecordArchive& archive, Material& material) {
  archive.fields("name", material.name, "base_colour", material.base_colour, "metallic", material.metallic, "roughness",
                 material.roughness, "emissive", material.emissive, "alpha_mode", material.alpha_mode, "alpha_cutoff",
                 material.alpha_cutoff, "double_sided", material.double_sided, "unlit", material.unlit, "base_colour_map",
                 material.base_colour_map, "metallic_roughness_map", material.metallic_roughness_map, "normal_map",
                 material.normal_map, "occlusion_map", material.occlusion_map, "emissive_map", material.emissive_map);
}

void name_fields(RecordArchive& archive, Appearance::Part& part) {
  archive.fields("material", part.material, "vertices", part.vertices, "triangles", part.triangles, "normals", part.normals,
                 "tangents", part.tangents, "colours", part.colours);
  archive.list("uv_sets", "uvs", part.uvs);
}

void name_fields(RecordArchive& archive, Appearance& appearance) {
  archive.list("parts", "part", appearance.parts);
  archive.list("materials", "material", appearance.materials);
  archive.list("images", "image", appearance.images);
}

template <typename Result>
Record record_of(const Result& result) {
  Record record;
  RecordArchive archive = RecordArchive::saving_to(record);
  Result copy = result;  // the fields are named as those that loading writes to
  name_fields(archive, copy);
  return record;
}

template <typename Result>
Result result_of(const Record& record) {
  Result result;
  RecordArchive archive = RecordArchive::loading_from(record);
  name_fields(archive, result);
  return result;
}

#define HYDROSTAT_RECORD(Result)                   \
  template Record record_of(const Result& result); \
  template Result result_of<Result>(const Record& record);
HYDROSTAT_RECORD(ImportedCharacter)
HYDROSTAT_RECORD(retarget::Creature)
HYDROSTAT_RECORD(retarget::ImportedMotion)
HYDROSTAT_RECORD(retarget::PreparedTarget)
HYDROSTAT_RECORD(retarget::InverseDynamics)
HYDROSTAT_RECORD(retarget::Performances)
HYDROSTAT_RECORD(PerformedTarget)
HYDROSTAT_RECORD(Appearance)
HYDROSTAT_RECORD(retarget::Rig)
HYDROSTAT_RECORD(retarget::MovingMorphs)
#undef HYDROSTAT_RECORD

std::string rig_bytes(const retarget::Rig& rig) { return packed(record_of(rig), kRigTitle, kRigVersion); }

retarget::Rig parse_rig(const std::string& bytes, const std::string& file, Eigen::Index nodes, Eigen::Index vertices) {
  retarget::Rig rig = read_packed(bytes, file, kRigTitle, kRigVersion, result_of<retarget::Rig>);
  const Eigen::Index bones = rig.skeleton.count();
  bool fits = rig.bone_weights.cols() == nodes && rig.bone_weights.rows() == bones && rig.skin.vertices.cols() == vertices &&
              rig.skin.triangles.size() > 0 && rig.skin.triangles.minCoeff() >= 0 &&
              rig.skin.triangles.maxCoeff() < vertices &&
              static_cast<Eigen::Index>(rig.skeleton.parents.size()) == bones &&
              static_cast<Eigen::Index>(rig.skeleton.bind_pose.size()) == bones &&
              static_cast<Eigen::Index>(rig.skeleton.weighted.size()) == bones;
  for (std::size_t b = 0; fits && b < rig.skeleton.parents.size(); ++b)
    fits = rig.skeleton.parents[b] >= -1 && rig.skeleton.parents[b] < static_cast<int>(b);
  for (std::size_t v = 0; fits && v < rig.skin.skin_weights.size(); ++v) {
    for (const auto& influence : rig.skin.skin_weights[v]) fits = fits && influence.bone >= 0 && influence.bone < bones;
  }
  if (!fits) throw not_of("body.json", file);
  return rig;
}

std::string target_bytes(const PerformedTarget& target) { return packed(record_of(target), kTargetTitle, kTargetVersion); }

PerformedTarget parse_target(const std::string& bytes, const std::string& file) {
  return read_packed(bytes, file, kTargetTitle, kTargetVersion, result_of<PerformedTarget>);
}

namespace {

bool is_in(int index, std::size_t count) { return index >= 0 && static_cast<std::size_t>(index) < count; }

template <typename Derived>
bool are_in(const Eigen::DenseBase<Derived>& indices, Eigen::Index count) {
  return indices.size() == 0 || (indices.minCoeff() >= 0 && indices.maxCoeff() < count);
}

bool fits(const Appearance::Part& part, const Appearance& appearance, Eigen::Index vertices) {
  const Eigen::Index drawn = part.vertices.size();
  const auto of_all = [&](const auto& values) { return values.cols() == 0 || values.cols() == drawn; };
  bool sound = are_in(part.vertices, vertices) && are_in(part.triangles, drawn) && of_all(part.normals) &&
               of_all(part.tangents) && of_all(part.colours);
  for (const Eigen::Matrix2Xd& uvs : part.uvs) sound = sound && uvs.cols() == drawn;
  return sound && (part.material == -1 || is_in(part.material, appearance.materials.size()));
}

bool fits(const Material& material, const Appearance& appearance) {
  for (const TextureMap* map : maps_of(material)) {
    if (map->image != -1 && !is_in(map->image, appearance.images.size())) return false;
  }
  return true;
}

}  // namespace

std::string appearance_bytes(const Appearance& appearance) {
  return packed(record_of(appearance), kAppearanceTitle, kAppearanceVersion);
}

Appearance parse_appearance(const std::string& bytes, const std::string& file, Eigen::Index vertices) {
  Appearance appearance = read_packed(bytes, file, kAppearanceTitle, kAppearanceVersion, result_of<Appearance>);
  bool sound = true;
  for (const Appearance::Part& part : appearance.parts) sound = sound && fits(part, appearance, vertices);
  for (const Material& material : appearance.materials) sound = sound && fits(material, appearance);
  if (!sound) throw not_of("body.json", file);
  return appearance;
}

std::string morphs_bytes(const retarget::MovingMorphs& morphs) {
  return packed(record_of(morphs), kMorphsTitle, kMorphsVersion);
}

retarget::MovingMorphs parse_morphs(const std::string& bytes, const std::string& file, Eigen::Index vertices) {
  retarget::MovingMorphs morphs = read_packed(bytes, file, kMorphsTitle, kMorphsVersion, result_of<retarget::MovingMorphs>);
  bool sound = morphs.rate_hz > 0 && morphs.weights.cols() > 0 && morphs.weights.allFinite() &&
               morphs.weights.rows() == static_cast<Eigen::Index>(morphs.targets.size());
  for (const retarget::MorphTarget& morph : morphs.targets)
    sound = sound && are_in(morph.vertices, vertices) && morph.offsets.cols() == morph.vertices.size() && morph.offsets.allFinite();
  if (!sound) throw not_of("body.json", file);
  return morphs;
}

}  // namespace hydrostat::io
