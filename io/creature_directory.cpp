#include "io/creature_directory.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <system_error>

#include "io/creature_record.h"
#include "io/link_or_copy.h"
#include "io/obj_out.h"
#include "io/write_file.h"

namespace hydrostat::io {

namespace fs = std::filesystem;

namespace {

constexpr std::array<std::string_view, 21> kOwnFiles{
    "creature.toml",  "scene.toml", "body.json",  "target.bin",  "path.bin",     "rig.bin",     "appearance.bin", "morphs.bin", "wobble.bin",
    "signals.json", "reference.glb", "replay.glb", "failed.glb", "report.json", "report.html", "accuracy.csv", "accuracy.svg",
    "replay.pc2", "replay.mdd", "replay.obj", "replay.mtl"};
constexpr const char* kFramesFolder = "replay_obj";  // a directory, in which only frames are ours
constexpr const char* kFrameName = "replay";

Error directory_error(const fs::path& shown_as, int error_number) {
  return {shown_as.string(), "", std::string("the directory cannot be written: ") + std::strerror(error_number),
          mend_of_write_error(error_number)};
}

std::string part_prefix(const fs::path& creature) { return std::string(".").append(creature.filename().string()).append(".part-"); }

/// The creature's path without symbolic links and trailing slashes, so that its parent and name are what they are on the
/// disk.
fs::path place_of(const fs::path& creature) {
  std::error_code failed;
  fs::path place = fs::weakly_canonical(fs::absolute(creature), failed);
  if (failed) throw directory_error(creature, failed.value());
  return place.has_filename() ? place : place.parent_path();
}

/// Locks a directory for as long as the process lives; -1 when another process holds it or it cannot be opened.
int lock_directory(const fs::path& directory) {
  const int descriptor = open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor >= 0 && flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
    close(descriptor);
    return -1;
  }
  return descriptor;
}

/// For file systems that cannot exchange two directories: where the old creature waits while the new one takes its place.
fs::path aside_of(const fs::path& part) { return part.string() + ".old"; }

/// Removes what killed runs left; an old creature that waited aside without a successor comes back.
void remove_leftovers(const fs::path& creature) {
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(creature.parent_path(), ignored)) {
    if (!entry.path().filename().string().starts_with(part_prefix(creature))) continue;
    const int lock = lock_directory(entry.path());
    if (lock < 0) continue;
    if (entry.path().extension() == ".old" && !fs::exists(creature)) fs::rename(entry.path(), creature, ignored);
    fs::remove_all(entry.path(), ignored);
    close(lock);
  }
}

/// A record that cannot be read is a creature's, whose making took longer.
CreatureWriter::Kind kind_of(const fs::path& creature) {
  try {
    for (const auto& [name, value] : read_creature_record(creature).settings) {
      if (name == "kind" && value == CreatureRecord::Setting("scene")) return CreatureWriter::Kind::simulation;
    }
  } catch (const Error&) {
  }
  return CreatureWriter::Kind::creature;
}

void refuse_the_other_kind(const fs::path& creature, const fs::path& shown_as, CreatureWriter::Kind kind) {
  if (kind_of(creature) == kind) return;
  const char* what = kind == CreatureWriter::Kind::simulation ? "holds a creature, which a simulation would replace"
                                                              : "holds a scene's simulation, which a creature would replace";
  throw Error(shown_as.string(), "", what, "Give another directory, or remove this one first.");
}

void refuse_what_is_no_creature(const fs::path& creature, const fs::path& shown_as, CreatureWriter::Start start, CreatureWriter::Kind kind) {
  std::error_code failed;
  const fs::file_status status = fs::status(creature, failed);
  if (fs::exists(status) && !fs::is_directory(status)) {
    throw Error(shown_as.string(), "", "is a file where a creature's directory belongs",
                "Move the file away, or give another directory.");
  }
  const bool holds_creature = is_creature(creature);
  if (start == CreatureWriter::Start::amended && !holds_creature) {
    throw Error(shown_as.string(), "", "holds no creature (no creature.toml)",
                "Make one with 'hydrostat convert CLIP -o DIR'.");
  }
  if (holds_creature) refuse_the_other_kind(creature, shown_as, kind);
  if (!fs::exists(status) || holds_creature) return;
  const fs::directory_iterator content(creature, failed);
  if (failed) throw directory_error(shown_as, failed.value());
  if (content != fs::directory_iterator()) {
    throw Error(shown_as.string(), "", "is no creature but holds '" + content->path().filename().string() + "'",
                "Give a new or an empty directory.");
  }
}

/// Two directories change places in one step. 0 or errno.
int exchange(const fs::path& one, const fs::path& other) {
  return renameat2(AT_FDCWD, one.c_str(), AT_FDCWD, other.c_str(), RENAME_EXCHANGE) == 0 ? 0 : errno;
}

int exchange_in_two_steps(const fs::path& part, const fs::path& creature) {
  const fs::path aside = aside_of(part);
  if (std::rename(creature.c_str(), aside.c_str()) != 0) return errno;
  if (std::rename(part.c_str(), creature.c_str()) != 0) {
    const int failure = errno;
    std::rename(aside.c_str(), creature.c_str());
    return failure;
  }
  return std::rename(aside.c_str(), part.c_str()) == 0 ? 0 : errno;
}

}  // namespace

bool is_creature(const fs::path& directory) {
  std::error_code ignored;
  return fs::is_regular_file(directory / "creature.toml", ignored);
}

CreatureWriter::CreatureWriter(const fs::path& creature, Start start, Kind kind) : creature_(place_of(creature)), shown_as_(creature) {
  remove_leftovers(creature_);
  refuse_what_is_no_creature(creature_, shown_as_, start, kind);
  std::error_code failed;
  fs::create_directories(creature_.parent_path(), failed);
  if (failed) throw directory_error(shown_as_, failed.value());
  if (fs::exists(creature_) && access(creature_.c_str(), W_OK) != 0) throw directory_error(shown_as_, errno);
  std::string name = (creature_.parent_path() / (part_prefix(creature_) + "XXXXXX")).string();
  if (mkdtemp(name.data()) == nullptr) throw directory_error(shown_as_, errno);
  part_ = name;
  lock_ = lock_directory(part_);
  fs::permissions(part_, fs::perms::group_read | fs::perms::group_exec | fs::perms::others_read | fs::perms::others_exec,
                  fs::perm_options::add, failed);
  carry_over(start == Start::amended);
}

CreatureWriter::~CreatureWriter() {
  std::error_code ignored;
  if (!part_.empty()) fs::remove_all(part_, ignored);
  if (lock_ >= 0) close(lock_);
}

void CreatureWriter::carry_over(bool everything) {
  if (!is_creature(creature_)) return;
  try {
    for (const fs::directory_entry& entry : fs::directory_iterator(creature_)) {
      const fs::path name = entry.path().filename();
      const bool own = std::find(kOwnFiles.begin(), kOwnFiles.end(), name.string()) != kOwnFiles.end();
      if (!everything && name == kFramesFolder) {
        keep_others_than_obj_frames(entry.path(), kFrameName, part_ / name);
      } else if (everything || !own) {
        link_or_copy(entry.path(), part_ / name);
      }
    }
  } catch (const fs::filesystem_error& error) {
    std::error_code ignored;
    fs::remove_all(part_, ignored);  // no destructor runs for a constructor that throws
    throw directory_error(shown_as_, error.code().value());
  }
}

void CreatureWriter::write(const std::string& name, std::string_view bytes) {
  write_file(part_ / name, bytes, shown_as_ / name);
}

Error CreatureWriter::as_seen(const Error& error) const {
  const std::string part = part_.string();
  if (!error.file.starts_with(part)) return error;
  return {shown_as_.string() + error.file.substr(part.size()), error.where, error.what(), error.mend};
}

void CreatureWriter::remove(const std::string& name) {
  try {
    if (name == kFramesFolder) {
      remove_obj_frames(part_ / name, kFrameName);
    } else {
      fs::remove_all(part_ / name);
    }
  } catch (const fs::filesystem_error& error) {
    throw directory_error(shown_as_ / name, error.code().value());
  }
}

void CreatureWriter::commit() {
  int failure = 0;
  if (!fs::exists(creature_)) {
    if (std::rename(part_.c_str(), creature_.c_str()) != 0) failure = errno;
  } else {
    failure = exchange(part_, creature_);
    if (failure == EINVAL || failure == ENOSYS) failure = exchange_in_two_steps(part_, creature_);
  }
  if (failure == EBUSY) {
    throw Error(shown_as_.string(), "", "is a mount point and cannot be replaced", "Give a directory inside it.");
  }
  if (failure != 0) throw directory_error(shown_as_, failure);
}

}  // namespace hydrostat::io
