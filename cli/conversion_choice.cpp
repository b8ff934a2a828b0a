// What a conversion chooses for an error that was asked for: method and step, harmonics, control mesh.
#include <cmath>
#include <iostream>

#include "cli/choice_record.h"
#include "cli/conversion.h"
#include "cli/outcome.h"
#include "cli/stage_key.h"
#include "io/write_error.h"
#include "retarget/error.h"
#include "retarget/performed_scenario.h"

namespace hydrostat::cli {

void Conversion::choose(const io::ImportedCharacter& imported, double wished_limit) {
  whole_signals_ = signals_;
  choice_key_ = key_after(key_, signals_text_, options_.method, options_.accuracy.grade, options_.accuracy.max_error,
                          std::int64_t{options_.nodes}, std::int64_t{options_.seed}, scene_text_);
  if (const std::optional<io::Record> record = stages_.cache().load("accuracy", choice_key_)) {
    choice_key_.clear();
    chosen_ = choice_of(*record);
    repeat_choice(imported, wished_limit);
    return;
  }
  stages_.run("accuracy", [&] {
    choose_steps();
    return 0;
  });
  perform_within_error();
  if (settings_.nodes > 0 || !chosen_->report.is_met() || is_down(performances_.main())) return;
  stages_.run("resolution", [&] {
    choose_nodes(imported, wished_limit);
    return 0;
  });
}

void Conversion::repeat_choice(const io::ImportedCharacter& imported, double wished_limit) {
  add_warnings(chosen_->warnings);
  cut_signals();
  if (chosen_->wished_nodes == 0) return;
  Progress silent(std::cerr, ProgressStyle::silent);
  Stages stages = stages_beside("coarser", silent);
  const std::unique_ptr<Conversion> coarser = on_coarser_mesh(imported, wished_limit, chosen_->wished_nodes, stages);
  coarser->perform();
  take_over(*coarser);
}

Stages Conversion::stages_beside(const std::string& name, Progress& progress) const {
  Stages stages(progress);
  stages.use_cache(writer_.cache_directory() / name);
  return stages;
}

void Conversion::choose_steps() {
  const std::optional<physics::Method> only = options_.method == "auto" ? std::nullopt : std::optional(settings_.method);
  chosen_ = choose_step(options_.accuracy, "hydrostat convert", target_.performer, signals_, only);
  cut_harmonics(*chosen_, target_.performer, signals_);
  tell_signals();
}

void Conversion::cut_signals() {
  signals_ = chosen_->harmonics > 0 ? retarget::with_harmonics(whole_signals_, chosen_->harmonics) : whole_signals_;
  tell_signals();
}

void Conversion::choose_nodes(const io::ImportedCharacter& imported, double wished_limit) {
  constexpr int kFewest = 20;  // as --nodes has it
  const int own = creature_.mesh.node_count();
  int last = 0;
  Progress silent(std::cerr, ProgressStyle::silent);
  Stages stages = stages_beside("coarser", silent);
  for (const double part : {0.25, 0.35, 0.5, 0.7}) {
    const int wished = static_cast<int>(std::lround(part * own));
    if (wished < kFewest) continue;
    const std::unique_ptr<Conversion> coarser = on_coarser_mesh(imported, wished_limit, wished, stages);
    if (!coarser || coarser->creature_.mesh.node_count() == last) continue;
    last = coarser->creature_.mesh.node_count();
    if (last >= own) return;
    // The error that a cheap method and few harmonics use up may be what this mesh needs; nor need that method be cheap on it.
    const retarget::StepSetting accurate{physics::Method::kExplicit, kControlSeconds};
    const auto take_accurate = [&] { return take_mesh(*coarser, wished, accurate, 0); };
    const auto work_of = [&](const retarget::StepSetting& setting) {
      return retarget::measure_level(*chosen_->reference, coarser->target_.performer, coarser->signals_, setting).work_ms;
    };
    const bool is_method_other = chosen_->setting.method != accurate.method;
    const bool may_be_accurate = options_.method == "auto" && (is_method_other || chosen_->harmonics > 0);
    const bool is_accurate_first = may_be_accurate && is_method_other && work_of(accurate) < work_of(chosen_->setting);
    if (is_accurate_first && take_accurate()) return;
    if (take_mesh(*coarser, wished, chosen_->setting, chosen_->harmonics)) return;
    if (may_be_accurate && !is_accurate_first && take_accurate()) return;
  }
}

bool Conversion::take_mesh(Conversion& coarser, int wished, const retarget::StepSetting& setting, int harmonics) {
  ChosenStep chosen = *chosen_;
  chosen.setting = setting;
  chosen.harmonics = harmonics;
  chosen.wished_nodes = wished;
  coarser.chosen_ = chosen;
  coarser.cut_signals();
  const bool is_cheaper = take_coarser(chosen, target_.performer, coarser.target_.performer, coarser.signals_);
  chosen_->curve.rows.push_back(chosen.curve.rows.back());
  if (!is_cheaper) return false;
  coarser.key_ = coarser.solved_key_;
  coarser.perform();
  if (is_down(coarser.performances_.main()) || strays(*chosen_, coarser.performances_.main())) {
    chosen_->curve.rows.back().is_refused = true;
    return false;
  }
  chosen_ = std::move(chosen);
  take_over(coarser);
  return true;
}

std::unique_ptr<Conversion> Conversion::solved_by(const retarget::CreatureOptions& settings, const io::ImportedCharacter& imported,
                                                  double wished_limit, Stages& stages) {
  auto other = std::make_unique<Conversion>(options_, settings, stages, writer_);
  try {
    other->add_warnings(imported.warnings);
    other->solve(imported, wished_limit);
  } catch (const io::WriteError&) {
    throw;
  } catch (const Error&) {
    return nullptr;
  }
  return other;
}

std::unique_ptr<Conversion> Conversion::on_coarser_mesh(const io::ImportedCharacter& imported, double wished_limit, int wished,
                                                        Stages& stages) {
  retarget::CreatureOptions settings = settings_;
  settings.nodes = wished;
  std::unique_ptr<Conversion> coarser = solved_by(settings, imported, wished_limit, stages);
  if (!coarser) return nullptr;
  coarser->chosen_ = chosen_;
  coarser->whole_signals_ = coarser->signals_;
  coarser->cut_signals();
  return coarser;
}

void Conversion::take_over(Conversion& other) {
  settings_ = other.settings_;
  key_ = other.key_;
  solved_key_ = other.solved_key_;
  creature_ = std::move(other.creature_);
  motion_ = std::move(other.motion_);
  inverse_ = std::move(other.inverse_);
  target_ = std::move(other.target_);
  signals_ = std::move(other.signals_);
  whole_signals_ = std::move(other.whole_signals_);
  performances_ = std::move(other.performances_);
  target_file_ = std::move(other.target_file_);
  signals_text_ = std::move(other.signals_text_);
  is_performed_ = true;
}

}  // namespace hydrostat::cli
