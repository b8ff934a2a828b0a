#include "cli/convert_options.h"

#include <algorithm>
#include <map>
#include <thread>

#include "cli/command_line.h"
#include "cli/number_option.h"
#include "cli/place_option.h"
#include "cli/wobble_option.h"

namespace hydrostat::cli {
namespace {

constexpr double kLeastLimit = 0.01, kMostLimit = 0.9;

const std::map<std::string, retarget::RootMotion> kRootMotions{{"auto", retarget::RootMotion::kAuto},
                                                               {"keep", retarget::RootMotion::kKeep},
                                                               {"from-feet", retarget::RootMotion::kFromFeet},
                                                               {"none", retarget::RootMotion::kNone}};
std::map<std::string, physics::Method> methods_by_name() {
  std::map<std::string, physics::Method> methods{{"auto", retarget::CreatureOptions().method}};
  for (const physics::Method method : physics::kMethods) methods.emplace(physics::name_of(method), method);
  return methods;
}
const std::map<std::string, physics::Method> kMethods = methods_by_name();

std::map<std::string, retarget::BodyMaterial> materials_by_name() {
  std::map<std::string, retarget::BodyMaterial> materials;
  for (const retarget::BodyMaterial material : retarget::kBodyMaterials) materials.emplace(name_of(material), material);
  return materials;
}
const std::map<std::string, retarget::BodyMaterial> kMaterials = materials_by_name();

retarget::BodyMaterial chosen_material(const ConvertOptions& options) {
  const bool is_hex = options.element == kHex;
  if (options.material == "auto")
    return is_hex ? retarget::BodyMaterial::kStableNeoHookean : retarget::CreatureOptions().material;
  const retarget::BodyMaterial material = kMaterials.at(options.material);
  if (is_hex && material == retarget::BodyMaterial::kSprings) {
    throw UsageError("hydrostat convert", "option --material", "springs lie along the edges of tets",
                     "Give another material, or leave --element out.");
  }
  return material;
}

/// Wished where --nodes is not told: most of a conversion's time goes with them. 0: what fits the body.
int nodes_for(const std::string& grade) {
  constexpr int kDraft = 100, kFinal = 400;
  if (grade == "draft") return kDraft;
  return grade == "final" ? kFinal : 0;
}

}  // namespace

retarget::CreatureOptions creature_options(const ConvertOptions& options) {
  retarget::CreatureOptions result;
  result.height_m = options.height;
  result.nodes = options.nodes > 0 ? options.nodes : nodes_for(options.accuracy.grade);
  result.root_motion = kRootMotions.at(options.root_motion);
  result.friction = options.friction;
  result.method = kMethods.at(options.method);
  result.hexahedra = options.element == kHex;
  result.material = chosen_material(options);
  result.calibrated = options.calibrated;
  if (options.calibrated && (result.hexahedra || result.material == retarget::BodyMaterial::kSprings)) {
    throw UsageError("hydrostat convert", "option --calibrated", "only tets of finite elements are calibrated",
                     "Give --material stable_neo_hookean or corotated_linear, or leave --calibrated out.");
  }
  result.firmness = options.firmness;
  result.threads = options.threads;
  return result;
}

bool wants_polish(const ConvertOptions& options, bool leaps_on) {
  const std::string& grade = options.accuracy.grade;
  return options.polish == "on" || (options.polish == "auto" && !leaps_on && (grade == "standard" || grade == "final"));
}

io::Exports exports_of(const ConvertOptions& options) { return exports_of(options.exports, {}, "hydrostat convert"); }

double wished_limit(const ConvertOptions& options) {
  return options.limit == "auto" ? 0 : parse_number(options.limit, kLeastLimit, kMostLimit, "hydrostat convert", "--limit");
}

void add_convert_options(CLI::App& app, ConvertOptions& options) {
  options.threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  app.add_option("CLIP", options.clip_file, "FBX, glTF, ... with a skeleton, a skin and a clip")->required();
  app.add_option("-o,--out", options.out, "Directory of the creature")->check(refuse_no_place)->required();
  app.add_option("--clip", options.clip, "Clip by name or index [the first that lasts]");
  app.add_option("--from", options.import.from_s, "Where in the clip to begin, counted from its first key [s]")
      ->check(number_within(0, 3600))
      ->capture_default_str();
  app.add_option("--to", options.import.to_s, "Where in it to end [s]; otherwise at its last key")
      ->check(number_within(0, 3600));
  add_import_options(app, options.import);
  app.add_option("--height", options.height, "Height of the bind pose [m]; otherwise the file's")
      ->check(number_within(0.01, 1000));
  app.add_option("--nodes", options.nodes, "Wished number of control nodes; otherwise what fits the body")
      ->check(number_within(20, 5000));
  app.add_option("--root-motion", options.root_motion, "Where the travel comes from: auto, keep, from-feet or none")
      ->check(CLI::IsMember(kRootMotions))
      ->capture_default_str();
  app.add_option("--limit", options.limit, "Largest |activation - 1|, 0.01 to 0.9, or auto")->capture_default_str();
  app.add_option("--element", options.element, "tet, or hex: the cells of the lattice that the tets are cut from")
      ->check(CLI::IsMember({kTet, kHex}))
      ->capture_default_str();
  app.add_option("--material", options.material,
                   "What bears the stress: springs, stable_neo_hookean, corotated_linear, or auto")
      ->check(CLI::IsMember({"auto", "springs", "stable_neo_hookean", "corotated_linear"}))
      ->capture_default_str();
  app.add_option("--firmness", options.firmness, "How firmly the plan holds on to the clip's shape, 1 to 100 times the usual")
      ->check(number_within(1, 100))
      ->capture_default_str();
  app.add_flag("--calibrated", options.calibrated,
                            "Tets of finite elements bend as the cells would that they are cut from");
  app.add_option("--method", options.method, "Time integration: explicit, implicit, euler, xpbd, spring; auto: explicit, or what --max-error chooses")
      ->check(CLI::IsMember(kMethods))
      ->capture_default_str();
  add_accuracy_options(app, options.accuracy);
  app.add_option("--friction", options.friction, "Coulomb's coefficient of the ground")
      ->check(number_within(0.05, 5))
      ->capture_default_str();
  app.add_option("--scene", options.scene, "World to let it go in, a TOML file (README, 'A creature's scene')")->check(refuse_no_place);
  add_wobble_option(app, options.wobble,
                    "Whether flesh swings over what the nodes carry, in the picture alone; auto: where it is seen");
  app.add_option("--polish", options.polish,
                 "Whether the signals learn from replays what the corrector does in every cycle; auto: for --accuracy standard and final, "
                 "but for a loop that leaps")
      ->check(CLI::IsMember({"auto", "on", "off"}))
      ->capture_default_str();
  add_export_options(app, options.exports, "");
  app.add_option("--seed", options.seed, "Other than 0: the body that is let go differs from the plan by up to 2 % in "
                                                       "mass, friction and stiffness, drawn from this number")
      ->capture_default_str();
  app.add_option("--threads", options.threads, "At most so many; the outcome does not hang on it")
      ->check(number_within(1, 256));
  app.add_flag("--json", options.json, "Print the report as JSON");
  app.add_flag("--quiet", options.quiet, "No progress");
}

}  // namespace hydrostat::cli
