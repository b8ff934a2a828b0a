#include "io/scene_file.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "io/fingerprint.h"
#include "io/scene_seams.h"
#include "io/scene_shapes.h"
#include "io/scene_surroundings.h"
#include "io/toml_reader.h"
#include "physics/element_body.h"
#include "physics/element_calibration.h"
#include "retarget/effect_plan.h"

namespace hydrostat::io {
namespace {

using physics::PointsOf;
using physics::VectorOf;
using retarget::ScenarioOf;
using retarget::StartShape;

constexpr double kMostActivation = 0.95;     // of all waves on one constraint: 1 would let it vanish
constexpr double kLeastPoissonsRatio = 0.25; // of springs
constexpr double kFriction = 0.8;
constexpr double kFull = 1 - 1e-6;           // of its box, from which a body is one
constexpr double kOrigins = 64;              // [m] between the places that may be the local origin
const std::string kSprings = "springs";
const std::vector<std::string> kLaws{kSprings, "stable_neo_hookean", "corotated_linear"};

/// Reads the tables of one scene into a scenario.
template <int Dim>
class SceneReader {
 public:
  SceneReader(const TomlReader& root, SceneFile& scene) : root_(root), scene_(scene) {}

  ScenarioOf<Dim> read() {
    const std::optional<TomlReader> body = root_.table("body");
    if (!body) throw root_.refusal("", "there is no [body]", "Add [body] with shape = \"...\".");
    // A whole multiple of a power of two, so that places are taken off it and put back without rounding.
    scenario_.origin = kOrigins * (body->numbers_or("position_m", VectorOf<Dim>::Zero(), kPlace) / kOrigins).array().round();
    mesh_ = body_mesh<Dim>(*body, scene_.shape, scene_.element, cells_, scene_.warnings);
    read_material();
    if (!root_.tables("seam").empty()) scenario_.fracture = read_seams<Dim>(root_, mesh_, make_body_, scenario_.youngs_modulus);
    for (const TomlReader& wave : root_.tables("activation")) read_wave(wave);
    refuse_vanishing();
    read_surroundings<Dim>(root_, scenario_, scene_.warnings);
    for (const TomlReader& clamp : root_.tables("clamp")) read_clamp(clamp);
    const StartShape start = place(*body);
    read_pushes<Dim>(root_, scenario_);
    read_effects(start);
    physics::touch_with_whole_surface(scenario_.scene);
    body->refuse_others();
    return std::move(scenario_);
  }

 private:
  /// About the scenario's own origin.
  VectorOf<Dim> place_of(const TomlReader& table) const {
    return table.numbers_or("position_m", VectorOf<Dim>::Zero(), kPlace) - scenario_.origin;
  }

  physics::ElementMaterial material_of(const TomlReader& table, const physics::ElementMaterial& otherwise) const {
    physics::ElementMaterial material;
    material.density = table.number_or("density_kg_m3", otherwise.density, {.least = 0, .most = 1e9, .without_least = true});
    material.youngs_modulus = table.number_or("youngs_modulus_pa", otherwise.youngs_modulus, {.least = 0, .most = 1e15, .without_least = true});
    constexpr Within kRange{.least = 0, .most = 0.4999};
    material.poissons_ratio = table.number_or("poissons_ratio", otherwise.poissons_ratio, kRange);
    if (scene_.law == kSprings && material.poissons_ratio < kLeastPoissonsRatio) {
      throw table.refusal("poissons_ratio", "springs alone have a Poisson's ratio of 0.25", "Give 0.25 or more, or another law.");
    }
    return material;
  }

  void read_material() {
    physics::ElementMaterial most;
    double damping_time = physics::Material{}.damping_time;
    bool is_calibrated = false;
    scene_.law = kLaws.front();
    if (const std::optional<TomlReader> table = root_.table("material")) {
      scene_.law = table->choice_or_first("law", kLaws);
      most = material_of(*table, most);
      damping_time = table->number_or("damping_time_s", damping_time, {.least = 0, .most = 1000});
      is_calibrated = table->flag_or("calibrated", false);
      if (is_calibrated && (scene_.law == kSprings || cells_.cols() == 0)) {
        const std::string tets = Dim == 3 ? "tets" : "triangles";
        throw table->refusal("calibrated", "only finite elements that are " + tets + " of a " + (Dim == 3 ? "cube" : "square") + " or bar are calibrated",
                             "Give such a shape in " + tets + " with a law other than springs, or leave 'calibrated' out.");
      }
      table->refuse_others();
    }
    const bool of_boxes = mesh_.nodes.rows() != Dim + 1;
    if (scene_.law == kSprings && of_boxes) {
      throw root_.refusal("material", "springs need " + std::string(Dim == 3 ? "tets" : "triangles"), "Give another law, or leave 'element' out.");
    }
    PointsOf<Dim> middles(Dim, mesh_.nodes.cols());
    for (Eigen::Index t = 0; t < middles.cols(); ++t) middles.col(t) = mesh_.rest(Eigen::all, mesh_.nodes.col(t)).rowwise().mean();
    mesh_.materials.assign(static_cast<std::size_t>(mesh_.nodes.cols()), most);
    for (const TomlReader& region : root_.tables("region")) {
      const physics::ElementMaterial material = material_of(region, most);
      const std::vector<char> within = points_within<Dim>(region, middles);
      for (std::size_t t = 0; t < within.size(); ++t) {
        if (within[t]) mesh_.materials[t] = material;
      }
      region.refuse_others();
    }
    const std::string broken = physics::broken_rule(mesh_);
    if (!broken.empty()) throw root_.refusal("body", broken, "Give other sizes, more 'nodes' or a smaller 'cell_size_m'.");
    for (const physics::ElementMaterial& material : mesh_.materials) {
      scenario_.youngs_modulus = std::max(scenario_.youngs_modulus, material.youngs_modulus);
    }
    if (is_calibrated) calibrate();
    scene_.damping_time_s = damping_time;
    make_body_ = maker_of(scene_.law, damping_time);
    scenario_.scene.body = make_body_(mesh_);
    scenario_.length = (mesh_.rest.rowwise().maxCoeff() - mesh_.rest.rowwise().minCoeff()).maxCoeff();
    scenario_.size = physics::size_of_volume<Dim>(scenario_.scene.body.rest_volume.sum());
  }

  static BodyMaker<Dim> maker_of(const std::string& name, double damping_time) {
    if (name == kSprings) return [=](const physics::ElementMesh<Dim>& mesh) { return retarget::make_spring_body<Dim>(mesh, damping_time); };
    const physics::ElasticLaw law = name == "stable_neo_hookean" ? physics::ElasticLaw::kStableNeoHookean : physics::ElasticLaw::kCorotatedLinear;
    return [=](const physics::ElementMesh<Dim>& mesh) { return physics::make_body<Dim>(mesh, physics::ElementBodyOptions{law, 0, damping_time}); };
  }

  /// The elements get less of Young's modulus, so that the body gives way as its cells would. How much hangs on Poisson's ratio,
  /// which may differ from region to region.
  void calibrate() {
    std::map<double, double> factors;
    for (physics::ElementMaterial& material : mesh_.materials) {
      const auto [entry, is_new] = factors.try_emplace(material.poissons_ratio, 1);
      if (is_new) {
        physics::ElementMesh<Dim> tets = mesh_;
        tets.materials.assign(1, material);
        const physics::ElementMesh<Dim> boxes{mesh_.rest, cells_, tets.materials, Eigen::VectorXd::Ones(cells_.cols())};
        entry->second = physics::unlocking_factor<Dim>(tets, boxes);
      }
      material.youngs_modulus *= entry->second;
    }
  }

  void read_clamp(const TomlReader& table) {
    retarget::Clamp clamp;
    clamp.until_s = table.number_or("until_s", clamp.until_s, kAboveZero);
    const std::vector<char> within = points_within<Dim>(table, mesh_.rest);
    for (std::size_t n = 0; n < within.size(); ++n) {
      if (within[n]) clamp.nodes.push_back(static_cast<int>(n));
    }
    table.refuse_others();
    scenario_.clamps.push_back(std::move(clamp));
  }

  VectorOf<Dim> direction(const TomlReader& table, const std::string& key) const {
    const VectorOf<Dim> value = table.numbers(key, Dim);
    if (value.norm() == 0) throw table.refusal(key, "'" + key + "' has no direction", "Give one that is not zero.");
    return value.normalized();
  }

  void read_wave(const TomlReader& table) {
    const physics::BodyOf<Dim>& body = scenario_.scene.body;
    retarget::Wave wave;
    wave.amplitude = table.number_or("amplitude", 0);
    wave.offset = table.number_or("offset", 0);
    wave.frequency_hz = table.number_or("frequency_hz", 0, kNotNegative);
    wave.is_square = table.choice_or_first("waveform", {"sine", "square"}) == "square";
    wave.from_s = table.number_or("from_s", 0, kNotNegative);
    wave.until_s = table.number_or("until_s", wave.until_s, {.least = wave.from_s, .without_least = true});
    PointsOf<Dim> middles(Dim, body.edge_count());
    for (int e = 0; e < body.edge_count(); ++e) middles.col(e) = (mesh_.rest.col(body.edges(0, e)) + mesh_.rest.col(body.edges(1, e))) / 2;
    const std::vector<char> within = points_within<Dim>(table, middles);
    wave.share = Eigen::VectorXd::Zero(body.edge_count());
    for (int e = 0; e < body.edge_count(); ++e) wave.share[e] = within[static_cast<std::size_t>(e)];
    if (table.has("axis")) {
      const VectorOf<Dim> axis = direction(table, "axis");
      for (int e = 0; e < body.edge_count(); ++e) {
        const VectorOf<Dim> span = mesh_.rest.col(body.edges(1, e)) - mesh_.rest.col(body.edges(0, e));
        wave.share[e] *= std::pow(axis.dot(span.normalized()), 2);  // what a stretch along the axis does to the constraint
      }
    }
    wave.phase = Eigen::VectorXd::Constant(body.edge_count(), radians(table.number_or("phase_deg", 0)));
    if (table.has("wave_direction") || table.has("wavelength_m")) {
      const double wavelength = table.number("wavelength_m", kAboveZero);
      wave.phase -= 2 * M_PI / wavelength * (direction(table, "wave_direction").transpose() * middles).transpose();
    }
    table.refuse_others();
    most_activation_.resize(body.edge_count());
    if (scenario_.waves.empty()) most_activation_.setZero();
    most_activation_ += wave.share * (std::abs(wave.amplitude) + std::abs(wave.offset));
    scenario_.waves.push_back(std::move(wave));
  }

  void refuse_vanishing() const {
    if (scenario_.waves.empty() || most_activation_.maxCoeff() <= kMostActivation) return;
    throw root_.refusal("activation", "the activations of one constraint add up to " + std::to_string(most_activation_.maxCoeff()) + " beside 1",
                        "Let amplitudes and offsets stay below 0.95 together.");
  }

  /// Returns what the body starts as.
  StartShape place(const TomlReader& body) {
    physics::SceneOf<Dim>& scene = scenario_.scene;
    physics::StateOf<Dim>& start = scenario_.start;
    const physics::BlockOf<Dim> turn = rotation_of<Dim>(body);
    scene.body.rest = (turn * mesh_.rest).colwise() + place_of(body);
    if (body.has("gap_m")) {
      if (!scene.has_ground) throw body.refusal("gap_m", "there is no ground to keep a gap from", "Add [ground], or leave 'gap_m' out.");
      const double lowest = (scene.ground.normal.transpose() * scene.body.rest).minCoeff();
      scene.body.rest.colwise() += (scene.ground.offset + body.number("gap_m", kPlace) - lowest) * scene.ground.normal;
    }
    start.x = scene.body.rest;
    const std::string shape = body.choice_or_first("start", {"rest", "random", "collapsed", "flattened"});
    const StartShape start_shape = shape == "random"      ? StartShape::kRandom
                                   : shape == "collapsed" ? StartShape::kCollapsed
                                   : shape == "flattened" ? StartShape::kFlattened
                                                          : StartShape::kRest;
    retarget::distort<Dim>(start_shape, scene_.seed, start.x);
    const VectorOf<Dim> velocity = body.numbers_or("velocity_m_s", VectorOf<Dim>::Zero()), centre = physics::centre_of_mass(scene.body, start.x);
    start.v = velocity.replicate(1, start.x.cols());
    const physics::SpinOf<Dim> rate = spin_of(body);
    for (Eigen::Index i = 0; i < start.x.cols(); ++i) start.v.col(i) += physics::turning<Dim>(rate, start.x.col(i) - centre);
    retarget::hold_at(scenario_.clamps, 0, scene.body.held);
    for (const int node : scene.body.held) start.v.col(node).setZero();
    return start_shape;
  }

  void read_effects(StartShape start) {
    physics::SceneOf<Dim>& scene = scenario_.scene;
    auto [wishes, friction] =
        read_wished_effects(root_, retarget::switchable_effects(), scene.has_ground ? scene.ground.friction : kFriction);
    const std::string broken = retarget::plan_effects<Dim>(wishes, scenario_, scene_.duration_s);
    if (!broken.empty()) throw root_.refusal("effects", broken, "Add what it needs, or leave the effect to 'auto'.");
    retarget::SelfContactPlan plan = retarget::plan_self_contact<Dim>(scenario_, start, wishes["self_contact"], friction, bar(), scene_.duration_s);
    retarget::plan_parts_contact<Dim>(start, wishes["self_contact"], friction, scenario_, plan);
    scene.self_contact = std::move(plan.settings);
    scenario_.self_contact_reason = std::move(plan.reason);
  }

  /// What the body is where it fills its own box.
  retarget::Bar bar() const {
    VectorOf<Dim> extent = mesh_.rest.rowwise().maxCoeff() - mesh_.rest.rowwise().minCoeff();
    if (scenario_.scene.body.rest_volume.sum() < kFull * extent.prod()) return {};
    std::sort(extent.begin(), extent.end());
    retarget::Bar bar{extent[Dim - 1], extent[0], extent[Dim - 2], mesh_.materials.front().youngs_modulus};
    for (const physics::ElementMaterial& material : mesh_.materials) bar.softest = std::min(bar.softest, material.youngs_modulus);
    return bar;
  }

  /// [1/s]
  static physics::SpinOf<Dim> spin_of(const TomlReader& body) {
    if constexpr (Dim == 2) {
      return physics::SpinOf<Dim>(radians(body.number_or("spin_deg_s", 0)));
    } else {
      return radians(1) * body.numbers_or("spin_deg_s", Eigen::Vector3d::Zero());
    }
  }

  const TomlReader& root_;
  SceneFile& scene_;
  physics::ElementMesh<Dim> mesh_;  // the rest shape in its own frame
  Eigen::MatrixXi cells_;           // nodes of the boxes that its tets or triangles are cut from; may be empty
  BodyMaker<Dim> make_body_;
  ScenarioOf<Dim> scenario_;
  Eigen::VectorXd most_activation_;  // E
};

template <int Dim>
void read_in_dimension(const TomlReader& root, SceneFile& scene) {
  SceneReader<Dim> reader(root, scene);
  scene.scenario = reader.read();
  const std::optional<physics::Method> method = method_named(root.choice_or_first("method", method_names()));
  scene.method = method.value_or(physics::Method::kExplicit);
  scene.method_is_auto = !method;
}

}  // namespace

std::vector<std::string> method_names() {
  std::vector<std::string> names{"auto"};
  for (const physics::Method method : physics::kMethods) names.push_back(physics::name_of(method));
  return names;
}

std::optional<physics::Method> method_named(const std::string& name) {
  return physics::method_named(name);
}

SceneFile read_scene_file(const std::filesystem::path& file, std::optional<unsigned> seed, std::optional<int> nodes,
                          const std::string& element, std::optional<double> duration_s) {
  toml::table table = parse_toml(file);
  if (toml::table* const body = table["body"].as_table(); body != nullptr && nodes) {
    body->erase("cell_size_m");
    body->insert_or_assign("nodes", *nodes);
  }
  if (toml::table* const body = table["body"].as_table(); body != nullptr && !element.empty()) {
    body->insert_or_assign("element", element);
  }
  const TomlReader root(table, file, "");
  for (const char* key : {"dimension", "dt_s", "duration_s", "seed", "method", "gravity_m_s2", "body", "material", "region", "ground",
                          "obstacle", "clamp", "seam", "activation", "push", "water", "air", "effects"}) {
    root.has(key);
  }
  root.refuse_others();
  SceneFile scene;
  scene.file = std::filesystem::absolute(file).lexically_normal().string();
  scene.sha256 = file_sha256(file);
  scene.dt_s = root.number_or("dt_s", scene.dt_s, {.least = 1e-5, .most = 0.2});
  scene.duration_s = root.number_or("duration_s", scene.duration_s, {.least = 1e-3, .most = 3600});
  if (duration_s) scene.duration_s = *duration_s;
  scene.seed = static_cast<unsigned>(root.whole_or("seed", 0, 0, 4294967295L));
  if (seed) scene.seed = *seed;
  if (root.whole_or("dimension", 3, 2, 3) == 3) {
    read_in_dimension<3>(root, scene);
  } else {
    read_in_dimension<2>(root, scene);
  }
  return scene;
}

}  // namespace hydrostat::io
