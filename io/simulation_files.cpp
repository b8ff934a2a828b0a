#include "io/simulation_files.h"

#include "io/gltf_out.h"
#include "io/page_obstacle.h"
#include "io/scene_body.h"

namespace hydrostat::io {
namespace {

using retarget::ScenarioOf;
using retarget::Simulation;
using retarget::SimulationCourse;

constexpr double kRounding = 1e-9;  // of a depth, per D: less is drawn as none

PageChart chart(const char* title, const char* y_label, const SimulationCourse& course,
                const std::vector<std::pair<const char*, Eigen::VectorXd>>& curves) {
  PageChart made{title, "time [s]", y_label, true, {}};
  for (const auto& [name, values] : curves) {
    made.curves.push_back({name, curves.size() == 1 ? PageRole::kReplay : PageRole::kOther, course.time_s, values});
  }
  return made;
}

/// [m/s], by differences between the frames.
Eigen::VectorXd speed_of(const SimulationCourse& course) {
  const Eigen::Index count = course.time_s.size();
  Eigen::VectorXd speed = Eigen::VectorXd::Zero(count);
  for (Eigen::Index f = 1; f < count; ++f) {
    speed[f] = (course.com.col(f) - course.com.col(f - 1)).norm() / (course.time_s[f] - course.time_s[f - 1]);
  }
  if (count > 1) speed[0] = speed[1];
  return speed;
}

template <int Dim>
std::vector<PageChart> charts_of(const ScenarioOf<Dim>& scenario, const SimulationCourse& course) {
  const Eigen::VectorXd sum = course.kinetic_j + course.elastic_j + course.gravity_j;
  std::vector<PageChart> charts{
      chart("Energy", "energy [J]", course,
            {{"sum", sum}, {"kinetic", course.kinetic_j}, {"elastic", course.elastic_j}, {"in gravity", course.gravity_j}, {"work done on it", course.work_j}}),
      chart("Height of the centre of mass", "height [m]", course, {{"height", course.com.row(1).transpose()}}),
      chart("Speed of the centre of mass", "speed [m/s]", course, {{"speed", speed_of(course)}}),
      chart("Change of the whole body's volume", "change [%]", course, {{"volume", 100 * (course.volume_ratio.array() - 1)}})};
  if (scenario.scene.has_ground || !scenario.scene.obstacles.empty()) {
    charts.push_back(chart("Forces of contact, added up", "force over weight [-]", course, {{"contact", course.contact_weights}}));
    charts.push_back(chart("Deepest penetration", "depth [% D]", course, {{"penetration", 100 / scenario.size * (course.penetration_m.array() > kRounding * scenario.size).select(course.penetration_m, 0)}}));
  }
  if (!scenario.waves.empty()) charts.push_back(chart("Mean activation", "activation [-]", course, {{"mean", course.mean_activation}}));
  return charts;
}

}  // namespace

void write_simulation_glb(const std::filesystem::path& path, const SceneFile& scene, const Simulation& simulation) {
  std::visit(
      [&]<int Dim>(const ScenarioOf<Dim>& scenario) {
        const ShownBody body = shown_body(scenario);
        GltfOptions options;
        options.name = scene.shape;
        options.place.head<Dim>() = scenario.origin;
        write_skinned_glb(path, {body.skin.vertices, body.skin.triangles, body.embedding}, body.mesh, body.mass,
                          shown_motion(scenario, simulation.motion), options);
      },
      scene.scenario);
}

void write_simulation_page(const std::filesystem::path& path, const SceneFile& scene, const Simulation& simulation,
                           const retarget::RunReport& report, const std::string& curve) {
  std::visit(
      [&]<int Dim>(const ScenarioOf<Dim>& scenario) {
        const ShownBody body = shown_body(scenario);
        PageInput page{report, body.skin, body.embedding, body.mesh, {}, charts_of(scenario, simulation.course), {}};
        page.motions.push_back({PageRole::kReplay, false, shown_motion(scenario, simulation.motion)});
        page.has_ground = scenario.scene.has_ground;
        if (page.has_ground) {
          page.ground_normal.setZero();
          page.ground_normal.head<Dim>() = scenario.scene.ground.normal;
          page.ground_height = scenario.scene.ground.offset / page.ground_normal.y();
        }
        for (std::size_t o = 0; o < scenario.scene.obstacles.size(); ++o) {
          page.obstacles.push_back(page_obstacle<Dim>(scenario.scene.obstacles[o], simulation.obstacle_travels[o], scenario.length));
        }
        page.accuracy_svg = curve;
        write_report_page(path, page);
      },
      scene.scenario);
}

std::string scene_body_text(const SceneFile& scene) {
  return std::visit([](const auto& scenario) { return scene_body_text(scenario); }, scene.scenario);
}

}  // namespace hydrostat::io
