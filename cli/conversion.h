#pragma once

#include <functional>
#include <memory>
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
      : options_(options), settings_(settings), stages_(stages), writer_(writer) {}

  /// wished_limit 0: automatic.
  void run(const io::ImportedCharacter& imported, double wished_limit);

  const retarget::Performances& performances() const { return performances_; }
  const retarget::RunReport& report() const { return target_.report; }

 private:
  /// Lets it go, and where it falls or loses its way tries what may keep it up and on it.
  void stay_up(const io::ImportedCharacter& imported, double wished_limit);

  /// Solved and let go by other settings, which is kept where `why_better` has a warning that tells why; stage and cache have one name.
  void try_by(const std::string& stage, const retarget::CreatureOptions& settings, const io::ImportedCharacter& imported, double wished_limit,
              const std::function<std::string(const Conversion&)>& why_better);

  /// How far it is off the clip's way, see retarget::straying.
  double straying() const;

  /// Solved again from rest lengths that the clip's are nearer to, where many are far from them; kept if it strays less than half as far.
  void fit_rest_lengths(const io::ImportedCharacter& imported, double wished_limit);

  /// Prepared and solved again with its load spread wider (PrepareOptions); kept if it stays up by that.
  void spread_load(const io::ImportedCharacter& imported, double wished_limit);

  /// Solved by other settings; none where the clip cannot be solved by them.
  std::unique_ptr<Conversion> solved_by(const retarget::CreatureOptions& settings, const io::ImportedCharacter& imported, double wished_limit,
                                        Stages& stages);

  /// Stages with a cache of their own below this one's.
  Stages stages_beside(const std::string& name, Progress& progress) const;

  void add_warnings(const std::vector<std::string>& more);

  /// Body, activations and signals on a control mesh.
  void solve(const io::ImportedCharacter& imported, double wished_limit);

  void make_body(const io::ImportedCharacter& imported);

  void find_activations(double wished_limit);

  void plan_wobble();

  retarget::Rig rig() const;

  void warn_of_flights(const retarget::PreparedTarget& prepared);

  void solve_signals();

  /// The cheapest method and step that keep the error asked for, then as few harmonics as leave it so, then the coarsest
  /// control mesh, where none was asked for; or what was chosen the last time from the very same.
  void choose(const io::ImportedCharacter& imported, double wished_limit);

  void repeat_choice(const io::ImportedCharacter& imported, double wished_limit);

  void choose_steps();

  /// Solved, and on its feet to the end, on the coarsest mesh that keeps the error: it takes the place of what is here.
  void choose_nodes(const io::ImportedCharacter& imported, double wished_limit);

  /// Whether it is on its feet to the end and within the error there, by a setting that does less work than what is chosen; 0
  /// harmonics: all.
  bool take_mesh(Conversion& coarser, int wished, const retarget::StepSetting& setting, int harmonics);

  /// Solved on a mesh of so many wished nodes; none where the clip cannot be solved on it.
  std::unique_ptr<Conversion> on_coarser_mesh(const io::ImportedCharacter& imported, double wished_limit, int wished, Stages& stages);

  /// Puts the other, which was solved and let go, in the place of what is here.
  void take_over(Conversion& other);

  void cut_signals();

  /// Into the scene that was asked for; body and signals stay those of the flat ground.
  void put_in_scene();

  /// As it is let go.
  const retarget::Performer& performer() const { return in_scene_ ? *in_scene_ : target_.performer; }

  void tell_signals();

  /// By what was chosen, or the next that neither falls nor strays.
  void perform_within_error();

  void let_go();

  retarget::PerformOptions perform_options() const;

  void perform(const std::string& stage = "replay", const retarget::Feedback& feedback = {});

  /// Lets the signals take over what the corrector does in every cycle, and the creature go again.
  void polish();

  /// Where the polished signals lead.
  void follow(const retarget::NominalPath& path);

  void write();

  const ConvertOptions& options_;
  retarget::CreatureOptions settings_;
  Stages& stages_;
  io::CreatureWriter& writer_;
  std::string key_;         // of the last stage
  std::string solved_key_;  // of what is performed, by any setting
  retarget::Creature creature_;
  retarget::ImportedMotion motion_;
  retarget::InverseDynamics inverse_;
  io::PerformedTarget target_;
  retarget::SignalSet signals_, whole_signals_;  // the latter before an accuracy cut them
  std::optional<ChosenStep> chosen_;
  std::string choice_key_;                       // empty: the choice came from the cache
  retarget::Performances performances_;
  bool is_performed_ = false;
  io::Appearance appearance_;
  std::string target_file_, signals_text_, scene_text_;
  std::optional<retarget::Performer> in_scene_;
};

}  // namespace hydrostat::cli
