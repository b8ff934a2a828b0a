#pragma once

#include "retarget/performance.h"

namespace hydrostat::retarget {

struct PolishOptions {
  int most_rounds = 30;          // in which something is learned, each after a replay
  double gain = 1;               // share of what repeats itself that the signals take over in a round; halved where that makes it worse
  double first_cycles = 9;       // of a loop: the first replay, which begins on the target
  double cycles = 5;             // the later ones, which begin on the path that was learned
  double settled_cycles = 4;     // after which a loop is taken to repeat itself, but at most 40 % of a replay
  double least_fall = 0.1;       // share by which a round must bring the correction down to be followed by another
  double enough = 1e-3;          // share of the correction at the start that is as good as none
  double most_shape = 1e-3;      // per L, by which the shape may go further from the target
  std::vector<Trial> more_trials = drawn_trials(8);  // bodies that go on trial where kTrials have nothing against it
  double most_on_trials = 1.25;  // factor by which, beside `most_shape`, the shape may go further from the target on these
};

/// What iterative learning made of a creature's signals.
struct Polished {
  SignalSet signals;
  NominalPath path;
  PolishReport report;  // the open loop is not looked at
  TrialsOutcome solved_on_trials, polished_on_trials;  // of what helps the planned body; of kTrials where these decided, else of more_trials
  bool is_frail = false;  // whether others are lost or stray by it, so that it was left out
  bool is_better() const { return report.correction_rms_after < report.correction_rms_before; }
};

/// Replays the creature again and again, and each time lets the signals take over what the corrector did alike in every cycle (of
/// a one-shot: all that it did), by the harmonics that they have. Layers lie over what was learned as over what was solved.
///
/// On the path on which a creature settles the corrector still acts, for the path lies beside the target. Who adds that to the signals
/// alone gets it twice: the corrector goes on seeing the same error. So the nominal path moves along, to where the creature was
/// while it was corrected so: there the signals need no help, and about it the feedback is as it was, as are the cycles that
/// it makes stable. What is left are the harmonics that the signals lack, and what does not repeat itself.
/// Source: Bristow, Tharayil, Alleyne, "A Survey of Iterative Learning Control", IEEE Control Systems 26(3), 2006, eq. (3): Q are
/// the harmonics, L the gain, in the phase of the loop and half a control step ahead, as a held correction acts. That the reference
/// is learned with the input is ours.
///
/// What falls, or strays from the target's shape by more than `most_shape`, is left out; the best round is kept. Where none is
/// better, or the creature falls from the start, signals and path stay as they were; so they do where of kTrials, or of the
/// options' own bodies, more are lost by it than without, or stray further. `options` as perform's, for the closed loop.
Polished polish(const Performer& performer, const SignalSet& signals, const PerformOptions& options, const PolishOptions& polish = {});

}  // namespace hydrostat::retarget
