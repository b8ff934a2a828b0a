#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "io/load_creature.h"
#include "retarget/self_contact_plan.h"

namespace hydrostat::cli {

/// --wobble auto|on|off; `asked` keeps what it holds where the option is not given.
void add_wobble_option(CLI::App& app, std::string& asked, const std::string& help);

retarget::Wish wobble_wish(const std::string& asked);

/// Plans the wobble of a loaded creature, or of a level of it, as `asked` says; empty: as creature.toml does. It is made from
/// rig.bin, which is read where it is needed: before a level takes the creature's place.
class WobbleChoice {
 public:
  WobbleChoice(const std::string& asked, bool has_levels, const std::string& directory, const io::LoadedCreature& creature);
  void plan(retarget::Performer& performer) const;

 private:
  retarget::Wish wish_ = retarget::Wish::kAuto;
  bool is_asked_ = false;
  std::optional<retarget::Rig> rig_;
};

}  // namespace hydrostat::cli
