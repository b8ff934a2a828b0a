#pragma once

#include <array>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include "retarget/control_mesh.h"
#include "retarget/cost_source.h"
#include "retarget/feedback.h"
#include "retarget/model_answers.h"
#include "retarget/morphs.h"
#include "retarget/nominal_path.h"
#include "retarget/replay.h"
#include "retarget/signal_set.h"
#include "retarget/wobble.h"
#include "retarget/world.h"

namespace hydrostat::retarget {

/// A creature as its replays need it: no clip and no bones are left.
struct Performer {
  SkinnedMesh skin;        // bind pose and triangles; the weights are empty
  Embedding embedding;     // of the skin's vertices in `mesh`
  ControlMesh mesh;        // nodes, tets and edges
  ContactPoints contacts;
  physics::Scene scene;
  Muscles muscles;
  PreparedTarget prepared;
  NominalPath path;        // of the polished signals
  Motion clip_points;      // the contact points as the clip has them, 3P x F
  Motion clip_skin;        // all of the skin likewise, thinned for the eye, 3V x F
  MovingMorphs morphs;     // that the skin wears over what the body carries
  Wobble wobble;           // and how its flesh swings there
  double clip_rise = 0;    // [m] of the centre of mass of the clip's nodes, over its height at the start
  double length = 1, size = 1;  // L and D [m]
  std::string self_contact_reason = "nobody asked for it";  // why the scene has it or not
  World world = {};  // around it, beside what the scene has
};

/// A performer with its signals, to be let go again and again: what all of its runs would find alike is found once, when it is needed, and
/// kept as long as this lives. Both must outlive it and stay as they are. Runs may go side by side.
class Act {
 public:
  Act(const Performer& performer, const SignalSet& signals);
  Act(const Act&) = delete;
  Act& operator=(const Act&) = delete;

  const Performer& performer() const { return performer_; }
  /// Lets a body of the performer's shape go, by the signals, as the options have it but in the performer's world.
  Replay run(const physics::Scene& plant, const ReplayOptions& options) const;
  /// Likewise by the target's lengths as rest lengths.
  Replay run_naively(const physics::Scene& plant, const ReplayOptions& options) const;
  /// How often a regulator's cost to go was found.
  int costs_found() const { return costs_.times_found(); }
  /// How often the model went to tell how its way is to be steered.
  int times_asked() const { return answers_.times_asked(); }

 private:
  ReplayInput input(const physics::Scene& plant) const;

  const Performer& performer_;
  const SignalSet& signals_;
  const std::optional<physics::Scene> without_obstacles_;  // where the performer's scene has some: the corrector's model knows of none
  const physics::Scene& model_;
  const CostSource costs_;
  const ModelAnswers answers_;
};

/// Which free runs are wanted, and how.
struct PerformOptions {
  ReplayOptions replay;    // `correct` is the run's own; the trace is of the closed loop, or of the open loop where that is the main run
  Feedback feedback;       // by which its corrector acts
  unsigned seed = 0;       // 0: the body as it was planned; else see variation_of
  double variation = 0.02; // how far a seed's body may differ from the plan
  bool closed_loop = true; // false: the open loop is the main run
  bool is_thorough = false;  // perform_steadily: tries regulators and what bodies off the plan say; takes time that levels' budgets do not count
  bool baselines = true;   // naive, and the open loop beside the closed one
  int threads = 2;         // two let the baselines run beside the main run; the outcome does not hang on it
};

/// What a run comes short of.
enum class Lapse { kNothing, kFell, kLostWay };

/// Free runs of one body: naive (the target's lengths as rest lengths), open loop (the signals alone), closed loop. Those that
/// were not wanted are empty; the closed or the open loop is there.
struct Performances {
  std::optional<Replay> naive, open_loop, closed_loop;
  Feedback feedback;  // of the closed loop
  // Told by perform_steadily: what the closed loop comes short of, and what it did on the feedback that was wished.
  Lapse lapse = Lapse::kNothing, wished_lapse = Lapse::kNothing;
  int trials_lost = 0;  // and how many of kTrials are lost on what was taken; 0 where that was not asked

  /// The closed loop where there is one, else the open loop.
  const Replay& main() const { return closed_loop ? *closed_loop : *open_loop; }
};

/// How a body differs from its plan: factors on mass, friction and stiffness (with the dashpots).
struct Variation {
  double mass = 1, friction = 1, stiffness = 1;
};

/// Factors drawn evenly within `most` of 1 by the seed; seed 0 is exactly 1.
Variation variation_of(unsigned seed, double most = PerformOptions().variation);

/// A body off the plan, and where it is shoved as it starts.
struct Trial {
  Variation body;
  double angle = 0;  // of the shove [rad] from +x towards +z
};
/// The corners of what bodies may differ by: heavy and soft or light and stiff, on ground that holds well or badly, from four sides.
inline constexpr double kTrialVariation = 0.1;
inline constexpr double kTrialShove = 0.1;  // [m/s]
inline constexpr std::array<Trial, 4> kTrials{{{{1 + kTrialVariation, 1 - kTrialVariation, 1 - kTrialVariation}, 0},
                                               {{1 + kTrialVariation, 1 + kTrialVariation, 1 - kTrialVariation}, std::numbers::pi / 2},
                                               {{1 - kTrialVariation, 1 - kTrialVariation, 1 + kTrialVariation}, std::numbers::pi},
                                               {{1 - kTrialVariation, 1 + kTrialVariation, 1 + kTrialVariation}, 3 * std::numbers::pi / 2}}};

/// Bodies from all within those bounds, each drawn by its number (variation_of) from `first_seed` on, shoved from sides that lie evenly around:
/// bodies in the midst may be lost where none at a corner is.
std::vector<Trial> drawn_trials(int count, unsigned first_seed = 1001);

/// The scene with another body of the same shape.
physics::Scene varied_scene(const physics::Scene& scene, const Variation& variation);

/// Lets the creature go as often as wanted, on the same body, contact and solver, with the pushes of its world beside those of the
/// options. The signals play from their coefficients with all layers. The corrector's model knows of no obstacles.
Performances perform(const Act& act, const PerformOptions& options);
Performances perform(const Performer& performer, const SignalSet& signals, const PerformOptions& options);

/// Whether its clip goes anywhere; else it stays, more or less, in its place.
bool travels(const ReplayReport& run);
constexpr double kLeastTravel = 0.05;  // [L a cycle] of a clip that does

/// How far [per L, RMS over run and body] the body is from where its target is, turned or not, without what is off in its shape.
double off_place(const ReplayReport& run);

/// How far a run is off the clip's way, in units of what loses it (lapse_of); infinite where it is down.
double straying(const Performer& performer, const ReplayOptions& options, const Replay& run);
constexpr double kBetter = 0.5;  // share of the straying that anything but the usual is worth its while from

/// Whether it fell or diverged, or lost its way. What travels has lost it that travels by over 8 % of the clip's travel more or less than that,
/// or drifts by over 4 % of it a cycle (of a loop of four cycles or more); of a loop that turns its drift alone counts. What does not travel
/// has lost it that is over 5 % of L off its place; and what is played once, that ends turned by over 0.3 degrees. Only over level ground and
/// undisturbed, without scene or push, there is a way to lose, and after a cycle at least.
Lapse lapse_of(const Performer& performer, const ReplayOptions& options, const Replay& run);

/// What became of bodies on trial.
struct TrialsOutcome {
  int bodies = 0;
  int lost = 0;                 // that fell or diverged, lost the way of their loop (lapse_of), or ended a single run over 5 % of L off its place
  double shape_rms_length = 0;  // as in ReplayReport, the mean of all, as long as they went
};
/// Lets bodies go by the options' feedback, as long as the options have it.
TrialsOutcome go_on_trials(const Act& act, const PerformOptions& options, std::span<const Trial> trials = kTrials);
TrialsOutcome go_on_trials(const Performer& performer, const SignalSet& signals, const PerformOptions& options,
                           std::span<const Trial> trials = kTrials);

/// The same as perform, on other feedback where the closed loop falls or loses its way on what was wished: the usual, where the options
/// are thorough a regulator, such as looks less far ahead and holds on to momentum, and such as spares the muscles 4, 16, then 64 times
/// as much. The first that does neither counts; where the options are thorough, the first on which none of kTrials is lost either, or else
/// that on which fewest are, and where the body keeps its way on what was wished but some of kTrials do not, the regulators are tried
/// likewise. Where none keeps the body on its way, what stays up and strays least, the earlier one unless a later
/// strays less than half as far. On some bodies, coarse ones above all, a gain that others need shakes the feet loose.
Performances perform_steadily(const Act& act, const PerformOptions& options);
Performances perform_steadily(const Performer& performer, const SignalSet& signals, const PerformOptions& options);

/// How far [m per L, RMS over the nodes and the frames of at most one period or second] the open loop moves when the solver's
/// substep is halved.
double substep_error(const Performer& performer, const SignalSet& signals, const ReplayOptions& options);

}  // namespace hydrostat::retarget
