#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "retarget/error.h"

namespace hydrostat::io {

/// Writes a creature directory whole or not at all. Everything goes into a hidden directory beside it (".NAME.part-..."),
/// which takes the creature's place in one step when `commit` is called; until then, and when the writer is destroyed or the
/// process killed before, an existing creature stays as it was. What killed runs left beside it is removed by the next
/// writer of that creature.
///
/// An existing directory is taken only when it is empty or holds what the new one is, a creature or a scene's simulation (both have a
/// creature.toml, which tells): Error otherwise, and also when the path is a file or cannot be written. Files of the user's in it are
/// carried over.
class CreatureWriter {
 public:
  enum class Start {
    afresh,  // a creature made anew: of the old one, the stage cache and what hydrostat did not write are kept, in replay_obj too
    amended  // the old creature with all its files, some of which are about to be replaced; Error when there is none
  };
  enum class Kind { creature, simulation };
  CreatureWriter(const std::filesystem::path& creature, Start start, Kind kind = Kind::creature);
  ~CreatureWriter();
  CreatureWriter(const CreatureWriter&) = delete;
  CreatureWriter& operator=(const CreatureWriter&) = delete;

  /// Where the files lie until `commit`. To be filled by `write` or by others, who must replace files (write beside and
  /// rename), for the files that are carried over are hard links to those of the old creature.
  const std::filesystem::path& directory() const { return part_; }
  std::filesystem::path cache_directory() const { return part_ / "cache"; }

  /// One file of the creature, `name` relative to it. Throws Error (full disk and the like) that names its final path.
  void write(const std::string& name, std::string_view bytes);
  /// The same error with the creature's path where the file it names lies in `directory()`.
  Error as_seen(const Error& error) const;
  /// Takes a file out of the creature, if it is there; of the directory of frames (replay_obj) only frames.
  void remove(const std::string& name);
  /// Puts the new creature in the place of the old one. To be called once, last. Throws Error, and the old one stays.
  void commit();

 private:
  void carry_over(bool everything);

  std::filesystem::path creature_;  // absolute, symbolic links followed
  std::filesystem::path shown_as_;  // as the user wrote it
  std::filesystem::path part_;
  int lock_ = -1;  // on part_; tells the next writer that this one is alive
};

/// Whether a directory holds a creature.
bool is_creature(const std::filesystem::path& directory);

}  // namespace hydrostat::io
