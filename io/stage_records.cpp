#include "io/stage_records.h"

#include <stdexcept>

#include "retarget/error.h"

namespace hydrostat::io {
namespace {

using retarget::ContactState;

constexpr const char* kTargetTitle = "hydrostat.target";
constexpr const char* kTargetVersion = "1";

// The fields of a type are named once, in its `visit`, for an archive that either saves or loads them.

class Saver {
 public:
  Record record;

  template <typename Derived>
  void operator()(const std::string& name, const Eigen::PlainObjectBase<Derived>& values) {
    if constexpr (std::is_same_v<typename Derived::Scalar, double>) {
      record.matrices[name] = values.derived();
    } else {
      record.index_matrices[name] = values.derived().template cast<int>();
    }
  }
  void operator()(const std::string& name, double value) { record.scalars[name] = value; }
  void operator()(const std::string& name, const std::string& value) { record.strings[name] = value; }
  void operator()(const std::string& name, const std::vector<std::string>& values) {
    record.scalars[name] = static_cast<double>(values.size());
    for (std::size_t i = 0; i < values.size(); ++i) record.strings[name + "/" + std::to_string(i)] = values[i];
  }
  template <typename Number>
  void numbers(const std::string& name, const std::vector<Number>& values) {
    Eigen::MatrixXi column(static_cast<Eigen::Index>(values.size()), 1);
    for (std::size_t i = 0; i < values.size(); ++i) column(static_cast<Eigen::Index>(i), 0) = static_cast<int>(values[i]);
    record.index_matrices[name] = column;
  }
  void poses(const std::string& name, const std::vector<Eigen::Affine3d>& values) {
    Eigen::MatrixXd columns(12, static_cast<Eigen::Index>(values.size()));
    for (std::size_t i = 0; i < values.size(); ++i) {
      const Eigen::Matrix<double, 3, 4> pose = values[i].affine();
      columns.col(static_cast<Eigen::Index>(i)) = Eigen::Map<const Eigen::VectorXd>(pose.data(), 12);
    }
    record.matrices[name] = columns;
  }
  template <typename Entry>
  std::size_t count(const std::string& name, const std::vector<Entry>& values) {
    record.scalars[name] = static_cast<double>(values.size());
    return values.size();
  }
};

class Loader {
 public:
  explicit Loader(const Record& record) : record_(record) {}

  template <typename Derived>
  void operator()(const std::string& name, Eigen::PlainObjectBase<Derived>& values) {
    if constexpr (std::is_same_v<typename Derived::Scalar, double>) {
      values.derived() = record_.matrices.at(name);
    } else {
      values.derived() = record_.index_matrices.at(name).cast<typename Derived::Scalar>();
    }
  }
  template <typename Number>
  requires std::is_arithmetic_v<Number> || std::is_enum_v<Number>
  void operator()(const std::string& name, Number& value) { value = static_cast<Number>(record_.scalars.at(name)); }
  void operator()(const std::string& name, std::string& value) { value = record_.strings.at(name); }
  void operator()(const std::string& name, std::vector<std::string>& values) {
    values.resize(static_cast<std::size_t>(record_.scalars.at(name)));
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = record_.strings.at(name + "/" + std::to_string(i));
  }
  template <typename Number>
  void numbers(const std::string& name, std::vector<Number>& values) {
    const Eigen::MatrixXi& column = record_.index_matrices.at(name);
    values.resize(static_cast<std::size_t>(column.size()));
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<Number>(column(static_cast<Eigen::Index>(i), 0));
  }
  void poses(const std::string& name, std::vector<Eigen::Affine3d>& values) {
    const Eigen::MatrixXd& columns = record_.matrices.at(name);
    values.resize(static_cast<std::size_t>(columns.cols()));
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = Eigen::Affine3d(Eigen::Map<const Eigen::Matrix<double, 3, 4>>(columns.col(static_cast<Eigen::Index>(i)).data()));
    }
  }
  template <typename Entry>
  std::size_t count(const std::string& name, std::vector<Entry>& values) {
    values.resize(static_cast<std::size_t>(record_.scalars.at(name)));
    return values.size();
  }

 private:
  const Record& record_;
};

template <typename Archive>
void visit(Archive& archive, const std::string& at, retarget::Motion& motion) {
  archive(at + "rate_hz", motion.rate_hz);
  archive(at + "frames", motion.frames);
  archive(at + "loop", motion.loop);
  archive(at + "travel", motion.travel);
  archive(at + "yaw", motion.yaw);
}

template <typename Archive>
void visit(Archive& archive, const std::string& at, retarget::Skeleton& skeleton) {
  archive(at + "names", skeleton.names);
  archive.numbers(at + "parents", skeleton.parents);
  archive.poses(at + "bind_pose", skeleton.bind_pose);
  archive.numbers(at + "weighted", skeleton.weighted);
}

/// Influences one after the other: which vertex, which bone, which weight.
void visit_influences(Saver& saver, const std::string& at, retarget::SkinnedMesh& skin) {
  std::size_t total = 0;
  for (const auto& influences : skin.skin_weights) total += influences.size();
  Eigen::MatrixXi places(2, static_cast<Eigen::Index>(total));
  Eigen::VectorXd weights(static_cast<Eigen::Index>(total));
  Eigen::Index k = 0;
  for (std::size_t v = 0; v < skin.skin_weights.size(); ++v) {
    for (const auto& influence : skin.skin_weights[v]) {
      places.col(k) << static_cast<int>(v), influence.bone;
      weights[k++] = influence.weight;
    }
  }
  saver(at + "influence_places", places);
  saver(at + "influence_weights", weights);
}

void visit_influences(Loader& loader, const std::string& at, retarget::SkinnedMesh& skin) {
  Eigen::MatrixXi places;
  Eigen::VectorXd weights;
  loader(at + "influence_places", places);
  loader(at + "influence_weights", weights);
  skin.skin_weights.resize(static_cast<std::size_t>(skin.vertices.cols()));
  for (Eigen::Index k = 0; k < weights.size(); ++k) {
    skin.skin_weights[static_cast<std::size_t>(places(0, k))].push_back({places(1, k), weights[k]});
  }
}

template <typename Archive>
void visit(Archive& archive, const std::string& at, retarget::SkinnedMesh& skin) {
  archive(at + "vertices", skin.vertices);
  archive(at + "triangles", skin.triangles);
  visit_influences(archive, at, skin);
}

template <typename Archive>
void visit(Archive& archive, const std::string& at, retarget::Clip& clip) {
  archive(at + "name", clip.name);
  archive(at + "index", clip.index);
  archive(at + "duration_s", clip.duration_s);
  archive(at + "range_s", clip.range_s);
  archive(at + "key_rate_hz", clip.key_rate_hz);
  archive(at + "rate_hz", clip.rate_hz);
  const std::size_t frames = archive.count(at + "frames", clip.bone_pose);
  for (std::size_t f = 0; f < frames; ++f) archive.poses(at + "frame/" + std::to_string(f), clip.bone_pose[f]);
}

template <typename Archive>
void visit(Archive& archive, const std::string& at, retarget::Character& character) {
  visit(archive, at + "skeleton/", character.skeleton);
  visit(archive, at + "skin/", character.skin);
  visit(archive, at + "clip/", character.clip);
}

template <typename Archive>
void visit(Archive& archive, const std::string& at, ImportedCharacter& imported) {
  visit(archive, at + "character/", imported.character);
  archive(at + "warnings", imported.warnings);
}

template <typename Archive>
void visit(Archive& archive, const std::string& at, retarget::ControlMesh& mesh) {
  archive(at + "nodes", mesh.nodes);
  archive(at + "tets", mesh.tets);
  archive(at + "edges", mesh.edges);
  archive(at + "tet_fill", mesh.tet_fill);
  archive(at + "origin", mesh.origin);
  archive(at + "cell_size", mesh.cell_size);
  archive(at + "cell_places", mesh.cell_places);
  archive(at + "vertex_cells", mesh.vertex_cells);
  archive(at + "bone_weights", mesh.bone_weights);
  archive(at + "cells", mesh.cells);
  archive(at + "bridged_cells", mesh.bridged_cells);
  archive(at + "copied_cells", mesh.copied_cells);
  archive(at + "pieces", mesh.pieces);
}

template <typename Archive>
void visit(Archive& archive, const std::string& at, retarget::Embedding& embedding) {
  archive(at + "tets", embedding.tets);
  archive(at + "nodes", embedding.nodes);
  archive(at + "weights", embedding.weights);
  archive(at + "max_miss", embedding.max_miss);
}

template <typename Archive>
void visit(Archive& archive, const std::string& at, retarget::ContactPoints& contacts) {
  archive(at + "vertices", contacts.vertices);
  archive(at + "bones", contacts.bones);
  visit(archive, at + "embedding/", contacts.embedding);
}

template <typename Archive>
void visit(Archive& archive, const std::string& at, physics::Scene& scene) {
  physics::Body& body = scene.body;
  archive(at + "rest", body.rest);
  archive(at + "mass", body.mass);
  archive(at + "edges", body.edges);
  archive(at + "rest_length", body.rest_length);
  archive(at + "edge_stiffness", body.edge_stiffness);
  archive(at + "edge_damping", body.edge_damping);
  archive(at + "tets", body.tets);
  archive(at + "tet_edges", body.tet_edges);
  archive(at + "rest_volume", body.rest_volume);
  archive(at + "volume_stiffness", body.volume_stiffness);
  archive(at + "point_nodes", scene.contact_points.nodes);
  archive(at + "point_weights", scene.contact_points.weights);
  archive(at + "ground_normal", scene.ground.normal);
  archive(at + "ground_offset", scene.ground.offset);
  archive(at + "friction", scene.ground.friction);
  archive(at + "has_ground", scene.has_ground);
  archive(at + "gravity", scene.gravity);
}

template <typename Archive>
void visit(Archive& archive, const std::string& at, retarget::Creature& creature) {
  visit(archive, at + "character/", creature.character);
  archive(at + "scale", creature.scale);
  visit(archive, at + "mesh/", creature.mesh);
  visit(archive, at + "skin/", creature.skin);
  visit(archive, at + "contacts/", creature.contacts);
  visit(archive, at + "scene/", creature.scene);
  archive(at + "length", creature.length);
  archive(at + "size", creature.size);
  archive(at + "youngs_modulus", creature.youngs_modulus);
  archive(at + "warnings", creature.warnings);
}

template <typename Archive>
void visit(Archive& archive, const std::string& at, retarget::CouplingReport& report) {
  archive(at + "error_rms_length", report.error_rms_length);
  archive(at + "error_max_length", report.error_max_length);
}

template <typename Archive>
void visit(Archive& archive, const std::string& at, retarget::ImportedMotion& imported) {
  visit(archive, at + "nodes/", imported.nodes);
  visit(archive, at + "skin_points/", imported.skin_points);
  visit(archive, at + "skin/", imported.skin);
  visit(archive, at + "coupling/", imported.coupling);
  archive(at + "root_motion", imported.root_motion);
  archive(at + "warnings", imported.warnings);
}

template <typename Archive>
void visit(Archive& archive, const std::string& at, retarget::ContactSchedule& contacts) {
  const std::size_t patches = archive.count(at + "patches", contacts.patches);
  archive.count(at + "states", contacts.state);
  for (std::size_t k = 0; k < patches; ++k) {
    const std::string patch = at + "patch/" + std::to_string(k) + "/";
    archive(patch + "name", contacts.patches[k].name);
    archive.numbers(patch + "points", contacts.patches[k].points);
    archive.numbers(patch + "state", contacts.state[k]);
  }
  archive(at + "touching", contacts.touching);
  archive(at + "sliding_x", contacts.sliding_x);
  archive(at + "sliding_z", contacts.sliding_z);
}

template <typename Archive>
void visit(Archive& archive, const std::string& at, retarget::PreparationReport& report) {
  archive(at + "smooth_shift", report.smooth_shift_rms_length);
  archive(at + "foot_shift", report.foot_shift_rms_length);
  archive(at + "volume_shift", report.volume_shift_rms_length);
  archive(at + "momentum_shift", report.momentum_shift_rms_length);
  archive(at + "total_shift", report.total_shift_rms_length);
  archive(at + "missing_wrench_rms", report.missing_wrench_rms_mg);
  archive(at + "missing_wrench_max", report.missing_wrench_max_mg);
  archive(at + "flight", report.flight_s);
  archive(at + "min_jacobian", report.min_jacobian);
  archive(at + "volume_error", report.volume_error_rms);
}

template <typename Archive>
void visit(Archive& archive, const std::string& at, retarget::PreparedTarget& prepared) {
  visit(archive, at + "target/", prepared.target);
  visit(archive, at + "contacts/", prepared.contacts);
  archive(at + "missing_wrench", prepared.missing_wrench);
  visit(archive, at + "report/", prepared.report);
  archive(at + "warnings", prepared.warnings);
}

template <typename Archive>
void visit(Archive& archive, const std::string& at, retarget::InverseReport& report) {
  archive(at + "miss", report.miss_rms_length);
  archive(at + "root_residual", report.root_residual_mg);
  archive(at + "kkt_residual", report.kkt_residual);
  archive(at + "saturated", report.saturated);
  archive(at + "max_strain", report.max_strain);
  archive(at + "p95_strain", report.p95_strain);
  archive(at + "limit", report.limit);
}

template <typename Archive>
void visit(Archive& archive, const std::string& at, retarget::InverseDynamics& inverse) {
  archive(at + "activation", inverse.activation);
  archive(at + "penalty_force", inverse.penalty_force);
  archive(at + "contact_force", inverse.contact_force);
  archive(at + "miss", inverse.miss);
  visit(archive, at + "report/", inverse.report);
}

template <typename Archive>
void visit(Archive& archive, const std::string& at, retarget::ReplayReport& report) {
  archive(at + "cycles", report.cycles);
  archive(at + "duration", report.duration_s);
  archive(at + "fell", report.fell);
  archive(at + "fall_time", report.fall_time_s);
  archive(at + "fall_cause", report.fall_cause);
  archive(at + "shape", report.shape_rms_length);
  archive(at + "clip_shape", report.clip_shape_rms_length);
  archive(at + "world", report.world_rms_length);
  archive(at + "drift", report.drift_per_cycle_length);
  archive(at + "heading", report.heading_deg_per_cycle);
  archive(at + "travel", report.travel_per_cycle_length);
  archive(at + "clip_travel", report.clip_travel_per_cycle_length);
  archive(at + "slip", report.slip_per_stance_length);
  archive(at + "sole_gap", report.sole_gap_length);
  archive(at + "penetration", report.penetration_max_size);
  archive(at + "volume_error", report.volume_error_max);
  archive(at + "momentum_residual", report.momentum_residual_mg);
  archive(at + "angular_residual", report.angular_residual_mgl);
  archive(at + "external_assist", report.external_assist_mg);
  archive(at + "inverted_elements", report.inverted_elements);
  archive(at + "guard_steps", report.guard_steps);
  archive(at + "correction", report.correction_rms);
  archive(at + "real_time_factor", report.real_time_factor);
  archive(at + "apex_rise", report.apex_rise_length);
  archive(at + "clip_apex_rise", report.clip_apex_rise_length);
}

template <typename Archive>
void visit(Archive& archive, const std::string& at, retarget::Replay& replay) {
  visit(archive, at + "motion/", replay.motion);
  visit(archive, at + "report/", replay.report);
  retarget::ReplayCourse& course = replay.course;
  archive(at + "time", course.time_s);
  archive(at + "height", course.height);
  archive(at + "heading", course.heading_deg);
  archive(at + "correction", course.correction);
  archive(at + "saturated", course.saturated);
  archive(at + "volume_ratio", course.volume_ratio);
  archive(at + "slip_speed", course.slip_speed);
  archive(at + "com", course.com);
  archive(at + "target_com", course.target_com);
  const std::size_t patches = archive.count(at + "patches", course.patch_state);
  for (std::size_t k = 0; k < patches; ++k) archive.numbers(at + "patch/" + std::to_string(k), course.patch_state[k]);
  double diverged = replay.termination == physics::Termination::kDiverged ? 1 : 0;
  archive(at + "diverged", diverged);
  replay.termination = diverged != 0 ? physics::Termination::kDiverged : physics::Termination::kDone;
}

template <typename Archive>
void visit(Archive& archive, const std::string& at, retarget::Performances& performances) {
  for (const auto& [name, run] : {std::pair{"naive", &performances.naive},
                                  std::pair{"open_loop", &performances.open_loop},
                                  std::pair{"closed_loop", &performances.closed_loop}}) {
    bool is_there = run->has_value();
    archive(at + name, is_there);
    if (!is_there) continue;
    if (!*run) run->emplace();
    visit(archive, at + name + "/", **run);
  }
}

template <typename Archive>
void visit(Archive& archive, const std::string& at, retarget::SourceReport& report) {
  archive(at + "file", report.file);
  archive(at + "sha256", report.sha256);
  archive(at + "clip", report.clip);
  archive(at + "root_motion", report.root_motion);
  archive(at + "duration", report.duration_s);
  archive(at + "rate", report.rate_hz);
  archive(at + "scale", report.scale);
}

template <typename Archive>
void visit(Archive& archive, const std::string& at, retarget::BodyReport& report) {
  archive(at + "nodes", report.nodes);
  archive(at + "elements", report.elements);
  archive(at + "constraints", report.constraints);
  archive(at + "vertices", report.vertices);
  archive(at + "pieces", report.pieces);
  archive(at + "bridged_cells", report.bridged_cells);
  archive(at + "copied_cells", report.copied_cells);
  archive(at + "mass", report.mass_kg);
  archive(at + "length", report.length_m);
  archive(at + "size", report.size_m);
  archive(at + "youngs_modulus", report.youngs_modulus_pa);
}

template <typename Archive>
void visit(Archive& archive, const std::string& at, PerformedTarget& target) {
  archive(at + "muscle_fields", target.performer.muscles.fields);
  visit(archive, at + "prepared/", target.performer.prepared);
  visit(archive, at + "clip_points/", target.performer.clip_points);
  visit(archive, at + "clip_skin/", target.performer.clip_skin);
  visit(archive, at + "source/", target.report.source);
  visit(archive, at + "body/", target.report.body);
  visit(archive, at + "coupling/", target.report.coupling);
  visit(archive, at + "preparation/", target.report.preparation);
  visit(archive, at + "inverse/", target.report.inverse);
  archive(at + "signal_error", target.report.signals.error_rms_l0);
  archive(at + "warnings", target.report.warnings);
}

}  // namespace

template <typename Result>
Record record_of(const Result& result) {
  Saver saver;
  Result copy = result;  // a visitor's fields are those that a loader writes to
  visit(saver, "", copy);
  return std::move(saver.record);
}

template <typename Result>
Result result_of(const Record& record) {
  Loader loader(record);
  Result result;
  visit(loader, "", result);
  return result;
}

#define HYDROSTAT_RECORD(Result)                  \
  template Record record_of(const Result& result); \
  template Result result_of<Result>(const Record& record);
HYDROSTAT_RECORD(ImportedCharacter)
HYDROSTAT_RECORD(retarget::Creature)
HYDROSTAT_RECORD(retarget::ImportedMotion)
HYDROSTAT_RECORD(retarget::PreparedTarget)
HYDROSTAT_RECORD(retarget::InverseDynamics)
HYDROSTAT_RECORD(retarget::Performances)
HYDROSTAT_RECORD(PerformedTarget)
#undef HYDROSTAT_RECORD

std::string target_bytes(const PerformedTarget& target) { return packed(record_of(target), kTargetTitle, kTargetVersion); }

PerformedTarget parse_target(const std::string& bytes, const std::string& file) {
  const Error damaged(file, "", "is damaged or of another version", "Make the creature again with 'hydrostat convert'.");
  const std::optional<Record> record = unpacked(bytes, kTargetTitle, kTargetVersion);
  if (!record) throw damaged;
  try {
    return result_of<PerformedTarget>(*record);
  } catch (const std::out_of_range&) {
    throw damaged;
  }
}

}  // namespace hydrostat::io
