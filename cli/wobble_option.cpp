#include "cli/wobble_option.h"

#include "retarget/wobble_plan.h"

namespace hydrostat::cli {

void add_wobble_option(CLI::App& app, std::string& asked, const std::string& help) {
  app.add_option("--wobble", asked, help)->check(CLI::IsMember({"auto", "on", "off"}));
}

retarget::Wish wobble_wish(const std::string& asked) {
  return asked == "on" ? retarget::Wish::kOn : asked == "off" ? retarget::Wish::kOff : retarget::Wish::kAuto;
}

WobbleChoice::WobbleChoice(const std::string& asked, bool has_levels, const std::string& directory,
                           const io::LoadedCreature& creature)
    : wish_(wobble_wish(asked.empty() ? io::setting(creature.record, "wobble", "auto") : asked)), is_asked_(!asked.empty()) {
  const bool of_level = has_levels && creature.target.performer.wobble.is_on();
  if (wish_ != retarget::Wish::kOff && (is_asked_ || of_level)) rig_ = io::load_rig(directory, creature);
}

void WobbleChoice::plan(retarget::Performer& performer) const {
  if (!is_asked_ && !rig_) return;
  retarget::Rig rig = rig_.value_or(retarget::Rig());
  const Eigen::MatrixXd& of_level = performer.mesh.bone_weights;  // a creature that was loaded has none there
  if (of_level.cols() == performer.mesh.nodes.cols()) rig.bone_weights = of_level;
  performer.wobble = retarget::plan_wobble(performer, rig, wish_);
}

}  // namespace hydrostat::cli
