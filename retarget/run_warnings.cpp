#include "retarget/run_warnings.h"

#include <algorithm>
#include <cmath>

#include "retarget/needed_strain.h"
#include "retarget/sentence.h"

namespace hydrostat::retarget {
namespace {

constexpr double kMissingWrench = 0.05;  // [m g] from which it is told
constexpr double kOverLimit = 1.5;       // of the limit
constexpr double kSaturated = 0.05;      // share of the activations
constexpr double kMiss = 3e-4;           // per L
constexpr double kRootResidual = 0.01;   // [m g]
constexpr double kNoTurn = 0.05;         // [deg a cycle] that is not told
constexpr double kInPlace = 0.005;       // of L (RMS), up to which a place is kept
constexpr double kFarFromClip = 0.1;     // of L: the eye no longer sees the same motion

std::string patches_in_contact(const ContactSchedule& contacts, std::size_t frame) {
  std::string names;
  for (std::size_t k = 0; k < contacts.patches.size(); ++k) {
    if (contacts.state[k][frame] == ContactState::kOff) continue;
    names += (names.empty() ? "'" : ", '") + contacts.patches[k].name + "'";
  }
  return names.empty() ? "in flight" : "standing on " + names;
}

/// As what follows a verb.
std::string in_words(const Feedback& feedback) {
  std::string words;
  const auto add = [&words](const char* form, double number, double usual = 1) {
    if (number != usual) words += (words.empty() ? "where " : " and ") + sentence(form, number);
  };
  add("effort is %.3g times as dear as usual", feedback.effort);
  add("the horizon is %.3g times as long as usual", feedback.horizon);
  add("momentum weighs %.3g times as much", feedback.root_weight);
  add(feedback.regulator < 1 ? "a regulator answers what is small, costs up to %.3g" : "a regulator answers all", feedback.regulator, 0);
  return words.empty() ? "on the usual one" : words;
}

std::string way_in_words(const ReplayReport& report) {
  const double drift = report.drift_per_cycle_length, turn = std::abs(report.heading_deg_per_cycle);
  const bool tells_turn = turn > kNoTurn;
  if (!travels(report)) {
    const double off = off_place(report);
    if (tells_turn && off < kInPlace) return sentence("turns by %.1f degrees a cycle on its place", turn);
    return sentence("is %.0f %% L (RMS) off its place", 100 * off) + (tells_turn ? sentence(" and turns by %.1f degrees a cycle", turn) : "");
  }
  const std::string way = sentence("makes %.0f %% of the clip's way", 100 * report.travel_per_cycle_length / report.clip_travel_per_cycle_length);
  if (std::isnan(drift)) return way;
  if (tells_turn) return way + sentence(", drifts %.2g %% L and turns by %.1f degrees a cycle", 100 * drift, turn);
  return way + sentence(" and drifts %.2g %% L a cycle", 100 * drift);
}

}  // namespace

std::vector<std::string> target_warnings(const PreparedTarget& prepared, const physics::Body& body, double limit,
                                         bool limit_is_automatic) {
  std::vector<std::string> warnings;
  Eigen::Index worst = 0;
  const Eigen::RowVectorXd missing = prepared.missing_wrench.colwise().norm();
  if (missing.size() > 0 && missing.maxCoeff(&worst) > kMissingWrench) {
    warnings.push_back(sentence("contact cannot give all that the motion needs: %.2f mg are missing at %.2f s (frame %ld), ", missing[worst],
                                static_cast<double>(worst) / prepared.target.rate_hz, static_cast<long>(worst)) +
                       patches_in_contact(prepared.contacts, static_cast<std::size_t>(worst)) +
                       "; slow the motion there or put a foot below it");
  }
  const PreparationReport& moved = prepared.report;
  if (moved.total_shift_rms_length > kMostShift) {
    warnings.push_back(sentence("the clip is moved by %.1f %% L (RMS) before the body can do it, of which %.0f %% are to be enough: by %.1f %% to be in "
                                "balance, %.1f %% to keep its volume and its springs within reach, %.1f %% to stand where its feet do; reference.glb "
                                "shows it; slower turns and leaps that a foot bears longer are moved less",
                                100 * moved.total_shift_rms_length, 100 * kMostShift, 100 * moved.momentum_shift_rms_length,
                                100 * moved.volume_shift_rms_length, 100 * moved.foot_shift_rms_length));
  }
  const double need = needed_strain(body, prepared.target);
  if (need > kOverLimit * limit) {
    warnings.push_back(sentence("the clip bends and stretches constraints by %.0f %%, the limit allows %.0f %%: expect a smaller motion; ",
                                100 * need, 100 * limit) +
                       (limit_is_automatic ? "give --limit or more --nodes" : "give a higher --limit"));
  }
  return warnings;
}

std::vector<std::string> inverse_warnings(const InverseReport& inverse) {
  std::vector<std::string> warnings;
  if (inverse.saturated > kSaturated) {
    warnings.push_back(sentence("%.1f %% of the activations are held at the limit of %.2f; give a higher --limit", 100 * inverse.saturated,
                                inverse.limit));
  }
  if (inverse.miss_rms_length > kMiss) {
    warnings.push_back(sentence("the best activations miss the target by %.2f mm per metre of length in one frame; "
                                "a higher --limit or more --nodes may bring it nearer",
                                1e3 * inverse.miss_rms_length));
  }
  if (inverse.root_residual_mg > kRootResidual) {
    warnings.push_back(sentence("contact leaves a net force of %.3f mg that the target needs", inverse.root_residual_mg));
  }
  return warnings;
}

std::string in_words(Lapse lapse, const ReplayReport& run) {
  if (lapse == Lapse::kNothing) return "keeps up";
  if (lapse == Lapse::kFell) return "falls";
  return travels(run) ? "loses its way" : "loses its place";
}

std::vector<std::string> feedback_warnings(const Performances& performances, const Feedback& wished) {
  const bool is_lost = performances.lapse == Lapse::kLostWay, fell = performances.wished_lapse == Lapse::kFell;
  const bool was_well = performances.wished_lapse == Lapse::kNothing;
  const std::string lost = sentence("of %d bodies %.0f %% off the plan, shoved by %.1f m/s, it loses %d", static_cast<int>(kTrials.size()),
                                    100 * kTrialVariation, kTrialShove, performances.trials_lost);
  if (performances.feedback == wished) {
    if (is_lost) return {"feedback: the creature " + way_in_words(performances.main().report) + ", and strays half as far on no other gain"};
    if (performances.trials_lost == 0) return {};
    return {"feedback: " + lost + ", and fewer by no regulator"};
  }
  const std::string usual = wished == Feedback() ? "the usual gain" : "its own gain";
  const std::string lapse = was_well ? "loses bodies off the plan" : in_words(performances.wished_lapse, performances.main().report);
  const std::string instead = was_well ? "keeps more of them " : fell ? "stays up " : is_lost ? "strays less " : "keeps it ";
  const std::string taken = "feedback: on " + usual + " the creature " + lapse + ", it " + instead + in_words(performances.feedback);
  if (is_lost) return {taken + ", but " + way_in_words(performances.main().report)};
  if (performances.trials_lost == 0) return {taken};
  return {taken + "; " + lost};
}

bool is_assisted(const ReplayReport& run) { return run.external_assist_mg > kAssist; }
bool is_assisted(const SimulationReport& run) { return run.external_assist_mg > kAssist; }

std::vector<std::string> motion_warnings(const ReplayReport& run) {
  std::vector<std::string> warnings;
  if (is_assisted(run)) {
    warnings.push_back(sentence("assist: the creature is not self-driven throughout: the solver's guard took over %d steps that would have gone astray, and "
                                "turned the body in the air by what none of its own forces gave, as much as %.2g times its weight at %.2f s; "
                                "convert again with --method euler, more --nodes or a calmer clip",
                                run.guard_steps, run.external_assist_mg, run.external_assist_time_s));
  }
  if (!run.fell && run.clip_shape_rms_length > kFarFromClip) {
    warnings.push_back(sentence("the skin is %.0f %% L from the clip's (RMS, without travel and turn): the creature moves otherwise than the clip; convert again "
                                "with more --nodes, a higher --limit or --firmness",
                                100 * run.clip_shape_rms_length));
  }
  return warnings;
}

std::vector<std::string> motion_warnings(const SimulationReport& run) {
  if (!is_assisted(run)) return {};
  return {sentence("assist: the body is not moved by its scene alone: the solver's guard took over %d steps that would have gone astray, and turned it "
                   "in the air by what none of the scene's forces gave, as much as %.2g times its weight; simulate again with --method euler, a "
                   "smaller dt_s or a softer body",
                   run.guard_steps, run.external_assist_mg)};
}

std::vector<std::string> polish_warnings(const Polished& polished) {
  if (polished.is_better()) return {};
  if (!polished.is_frail) return {"polish: left out, for no round of it gave the corrector less to do"};
  const TrialsOutcome &without = polished.solved_on_trials, &with = polished.polished_on_trials;
  const std::string bodies = sentence("polish: left out, for of %d bodies up to %.0f %% off the plan, shoved by %.1f m/s, ", with.bodies, 100 * kTrialVariation,
                                      kTrialShove);
  if (with.lost > without.lost) return {bodies + sentence("it loses %d instead of %d", with.lost, without.lost)};
  return {bodies + sentence("the mean is %.2f %% L from the target by it instead of %.2f", 100 * with.shape_rms_length, 100 * without.shape_rms_length)};
}

std::vector<std::string> polished_replay_warnings(const Performances& before, const Performances& after, bool is_as_planned) {
  const ReplayReport &was = before.main().report, &is = after.main().report;
  if (is.fell) return {sentence("polish: left out, for by it the creature falls at %.1f s", is.fall_time_s)};
  if (after.main().termination == physics::Termination::kDiverged) {
    return {sentence("polish: left out, for by it the simulation diverges at %.1f s", is.duration_s)};
  }
  if (after.lapse != Lapse::kNothing && before.lapse == Lapse::kNothing) return {"polish: left out, for by it the creature " + in_words(after.lapse, is)};
  if (after.feedback != before.feedback) return {"polish: left out, for by it the creature needs other feedback"};
  if (!is_as_planned) return {};
  if (!(is.correction_rms < was.correction_rms)) {
    return {sentence("polish: left out, for over the whole replay the corrector has more to do by it (%.3g instead of %.3g, RMS)", is.correction_rms,
                     was.correction_rms)};
  }
  if (!(is.shape_rms_length <= was.shape_rms_length + PolishOptions().most_shape)) {
    return {sentence("polish: left out, for over the whole replay the shape is %.2f %% L from the target by it instead of %.2f", 100 * is.shape_rms_length,
                     100 * was.shape_rms_length)};
  }
  return {};
}

}  // namespace hydrostat::retarget
