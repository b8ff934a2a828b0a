#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/asked_accuracy.h"
#include "cli/convert_options.h"
#include "cli/stages.h"
#include "io/creature_directory.h"
#include "io/import.h"
#include "retarget/performance.h"

namespace hydrostat::cli {

/// The stages behind the import, in the order of the road; each leaves its result for those behind it.
class Conversion {
 public:
  Conversion(const ConvertOptions& options, const retarget::CreatureOptions& settings, Stages& stages,
             io::CreatureWriter& writer)
      : options_(options), settings_(settings), stages_(stages), writer_(writer) {
    stages_.use_cache(writer.cache_directory());
  }

  void run(const io::ImportedCharacter& imported, double wished_limit);

  const retarget::Performances& performances() const { return performances_; }
  const retarget::RunReport& report() const { return target_.report; }

 private:
  void add_warnings(const std::vector<std::string>& more);

  void make_body(const io::ImportedCharacter& imported);

  /// wished_limit 0: automatic.
  void find_activations(double wished_limit);

  void plan_wobble();

  retarget::Rig rig() const;

  void warn_of_flights(const retarget::PreparedTarget& prepared);

  void solve_signals();

  /// The cheapest method and step that keep the error asked for, then as few harmonics as leave it so.
  void choose_steps();

  void tell_signals();

  void let_go();

  retarget::PerformOptions perform_options() const;

  void perform(const std::string& stage = "replay");

  /// Lets the signals take over what the corrector does in every cycle, and the creature go again.
  void polish();

  void write();

  const ConvertOptions& options_;
  const retarget::CreatureOptions settings_;
  Stages& stages_;
  io::CreatureWriter& writer_;
  std::string key_;  // of the last stage
  retarget::Creature creature_;
  retarget::ImportedMotion motion_;
  retarget::InverseDynamics inverse_;
  io::PerformedTarget target_;
  retarget::SignalSet signals_, whole_signals_;  // the latter before an accuracy cut them
  std::optional<ChosenStep> chosen_;
  retarget::Performances performances_;
  io::Appearance appearance_;
  std::string target_file_, signals_text_;
};

}  // namespace hydrostat::cli
