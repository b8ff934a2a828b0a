#include "cli/subject.h"

#include "io/creature_directory.h"

namespace hydrostat::cli {

Subject read_subject(const std::string& path) {
  Subject subject;
  if (!io::is_creature(path)) {
    subject.scene = io::read_scene_file(path);
    return subject;
  }
  const io::CreatureRecord record = io::read_creature_record(path);
  if (io::setting(record, "kind", "") == "scene") {
    subject.scene = io::read_scene_file(record.source_file);
  } else {
    subject.creature = io::load_creature(path);
  }
  return subject;
}

}  // namespace hydrostat::cli
