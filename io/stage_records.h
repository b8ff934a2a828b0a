#pragma once

#include "io/appearance.h"
#include "io/stage_cache.h"
#include "retarget/creature.h"
#include "retarget/level.h"
#include "retarget/performance.h"

namespace hydrostat::io {

/// A character as the importer found it, with what it had to decide.
struct ImportedCharacter {
  retarget::Character character;
  std::vector<std::string> warnings;
  Appearance appearance;  // no record has it: no body depends on it
};

/// What a replay needs beside body.json and signals.json: of the performer the muscles' fields, the prepared target and the clip,
/// of the report all that came before the replays.
struct PerformedTarget {
  retarget::Performer performer;
  retarget::RunReport report;
};

/// Results of stages as records and back, to the bit: of ImportedCharacter, Creature, ImportedMotion, PreparedTarget,
/// InverseDynamics, Performances (without traces) and PerformedTarget. result_of throws std::out_of_range for a record that
/// lacks a value.
template <typename Result>
Record record_of(const Result& result);
template <typename Result>
Result result_of(const Record& record);

/// target.bin: a PerformedTarget, "hydrostat.target/1".
std::string target_bytes(const PerformedTarget& target);
/// `file` is what messages call it. Throws Error for bytes that are damaged or of another version.
PerformedTarget parse_target(const std::string& bytes, const std::string& file);

/// appearance.bin: what the skin looks like, "hydrostat.appearance/1".
std::string appearance_bytes(const Appearance& appearance);
/// `vertices`: of the skin. Throws Error for bytes that are damaged, of another version or about another skin.
Appearance parse_appearance(const std::string& bytes, const std::string& file, Eigen::Index vertices);

/// rig.bin: what other levels of detail are made from, "hydrostat.rig/1".
std::string rig_bytes(const retarget::Rig& rig);
/// `nodes`: of the creature. Throws Error for bytes that are damaged, of another version or about another body.
retarget::Rig parse_rig(const std::string& bytes, const std::string& file, Eigen::Index nodes, Eigen::Index vertices);
/// morphs.bin: the morph targets that a creature wears, "hydrostat.morphs/1".
std::string morphs_bytes(const retarget::MovingMorphs& morphs);
/// `vertices`: of the skin. Throws Error for bytes that are damaged, of another version or about another skin.
retarget::MovingMorphs parse_morphs(const std::string& bytes, const std::string& file, Eigen::Index vertices);

}  // namespace hydrostat::io
