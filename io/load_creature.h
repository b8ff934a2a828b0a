#pragma once

#include <filesystem>

#include "io/creature_record.h"
#include "io/exports.h"
#include "io/stage_records.h"

namespace hydrostat::io {

/// A creature as it lies in its directory, ready to be let go.
struct LoadedCreature {
  CreatureRecord record;
  PerformedTarget target;
  retarget::SignalSet signals;
  Appearance appearance;
};

/// Reads creature.toml, body.json, target.bin, signals.json and, where there are any, appearance.bin, morphs.bin, path.bin and wobble.bin; the
/// cache is not needed. Throws Error where a file is missing, damaged, or does not belong to the others, or by check_settings.
LoadedCreature load_creature(const std::filesystem::path& creature);

/// Reads rig.bin, which other levels of detail are made from. Throws Error as above.
retarget::Rig load_rig(const std::filesystem::path& creature, const LoadedCreature& loaded);

/// The elements, material and friction that a creature was made with, as its levels want them.
retarget::CreatureOptions level_options(const LoadedCreature& loaded);

/// Refuses settings that a creature cannot be let go by: Error that names `file`, the key, its value and what is allowed. Others are only told.
void check_settings(const CreatureRecord& record, const std::string& file);

/// A setting of creature.toml as a number or text, or `otherwise` where there is none of that kind.
double setting(const CreatureRecord& record, const std::string& name, double otherwise);
std::string setting(const CreatureRecord& record, const std::string& name, const std::string& otherwise);

/// The feedback that a creature keeps its way by, and the settings of creature.toml that tell it: none where it is the usual.
retarget::Feedback feedback_of(const CreatureRecord& record);
void put_feedback(retarget::Feedback feedback, CreatureRecord& record);

/// What a creature's motion is exported to, and the settings of creature.toml that tell it, in the place of those before: none
/// where it is to nothing.
Exports exports_of(const CreatureRecord& record);
void put_exports(const Exports& exports, CreatureRecord& record);

}  // namespace hydrostat::io
