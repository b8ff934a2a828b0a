#include "io/scene_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>

#include "io/import_worker.h"
#include "io/scene_body.h"
#include "io/write_file.h"
#include "retarget/simulation.h"
#include "tests/io/refusal.h"
#include "tests/io/temporary_directory.h"

namespace hydrostat::io::scene_file_test {
namespace {

using retarget::ScenarioOf;

/// A cube of two triangles a side as an .obj file; `faces` of the twelve are written.
std::string cube_obj(int faces) {
  std::string text;
  for (int v = 0; v < 8; ++v) {
    text += "v " + std::to_string(v & 1) + " " + std::to_string(v >> 1 & 1) + " " + std::to_string(v >> 2) + "\n";
  }
  const char* const all[] = {"1 3 2", "2 3 4", "5 6 7", "6 8 7", "1 2 5", "2 6 5", "3 7 4", "4 7 8", "1 5 3", "3 5 7", "2 4 6", "4 8 6"};
  for (int f = 0; f < faces; ++f) text += std::string("f ") + all[f] + "\n";
  return text;
}

class SceneFiles : public testing::Test {
 protected:
  SceneFiles() : file(directory.path / "scene.toml") {
    set_import_worker_executable(HYDROSTAT_BINARY);
    write_file(directory.path / "cube.obj", cube_obj(12));
    write_file(directory.path / "open.obj", cube_obj(11));
  }
  SceneFile read(const std::string& text) {
    write_file(file, text);
    return read_scene_file(file);
  }
  template <int Dim>
  ScenarioOf<Dim> scenario(const std::string& text) {
    return std::get<ScenarioOf<Dim>>(read(text).scenario);
  }

  TemporaryDirectory directory;
  std::filesystem::path file;
};

TEST_F(SceneFiles, ThatSayOnlyAShapeGetTheDefaults) {
  const SceneFile scene = read("[body]\nshape = \"cube\"\nsize_m = 0.5\n");
  EXPECT_EQ(scene.dt_s, 1.0 / 240);
  EXPECT_EQ(scene.duration_s, 2);
  EXPECT_EQ(scene.method, physics::Method::kExplicit);
  EXPECT_EQ(scene.element, "tet");
  const auto& body = std::get<ScenarioOf<3>>(scene.scenario);
  EXPECT_FALSE(body.scene.has_ground);
  EXPECT_EQ(body.scene.gravity, Eigen::Vector3d(0, -9.81, 0));
  EXPECT_NEAR(body.scene.body.mass.sum(), 125, 1e-9);
  EXPECT_NEAR(body.length, 0.5, 1e-12);
  EXPECT_NEAR(body.size, 0.5, 1e-12);
  EXPECT_GT(body.scene.body.node_count(), 150);
  EXPECT_LT(body.scene.body.node_count(), 300);
}

TEST_F(SceneFiles, HoldEveryShapeWithItsVolume) {
  struct Shape {
    int dimension;
    const char *text, *name;
    double volume, tolerance;
  };
  constexpr double kPi = std::numbers::pi;
  for (const Shape& shape : {Shape{3, "size_m = 0.5", "cube", 0.125, 1e-9},
                             {3, "size_m = [1.0, 0.2, 0.1]", "bar", 0.02, 1e-9},
                             {3, "size_m = 0.5", "sphere", kPi / 48, 1e-9},
                             {3, "size_m = 0.5", "tetrahedron", 0.125 / std::sqrt(72), 1e-9},
                             {3, "size_m = [0.5, 0.6, 0.7]", "pyramid", 0.07, 1e-9},
                             {3, "file = \"cube.obj\"\nscale = 0.5", "mesh", 0.125, 1e-9},
                             {2, "size_m = 0.5", "square", 0.25, 1e-9},
                             {2, "size_m = [1.0, 0.2]", "bar", 0.2, 1e-9},
                             {2, "size_m = 0.5", "circle", kPi / 16, 1e-9},
                             {2, "size_m = 0.5", "triangle", std::sqrt(3) / 16, 1e-9},
                             {2, "size_m = [0.5, 0.6]", "pyramid", 0.15, 1e-9},
                             // Clockwise, with a notch.
                             {2, "outline_m = [[0, 0], [0, 1], [1, 1], [1, 0], [0.7, 0.0], [0.5, 0.6], [0.3, 0.0]]", "outline", 0.88, 1e-9}}) {
    SCOPED_TRACE(shape.name);
    const std::string text = "dimension = " + std::to_string(shape.dimension) + "\n[body]\nshape = \"" + shape.name + "\"\n" + shape.text + "\n";
    const SceneFile scene = read(text);
    std::visit(
        [&](const auto& scenario) {
          EXPECT_NEAR(scenario.scene.body.rest_volume.sum() / shape.volume, 1, shape.tolerance);
          EXPECT_NEAR(scenario.scene.body.mass.sum() / (1000 * shape.volume), 1, shape.tolerance);
          EXPECT_GT(scenario.scene.contact_points.count(), 2);
        },
        scene.scenario);
  }
}

TEST_F(SceneFiles, TellWhatOfAMeshTheyMend) {
  const std::string needle = cube_obj(11) + "v 1 1 1.00000001\nf 4 9 6\nf 8 9 6\n";
  std::string inward = cube_obj(12);
  for (std::size_t at = inward.find("f "); at != std::string::npos; at = inward.find("f ", at + 1)) std::swap(inward[at + 4], inward[at + 6]);
  write_file(directory.path / "needle.obj", needle);
  write_file(directory.path / "inward.obj", inward);
  const auto warnings = [&](const std::string& name) {
    const SceneFile scene = read("[body]\nshape = \"mesh\"\nfile = \"" + name + "\"\n");
    EXPECT_NEAR(std::get<ScenarioOf<3>>(scene.scenario).scene.body.mass.sum(), 1000, 1e-6);
    return scene.warnings;
  };
  EXPECT_TRUE(warnings("cube.obj").empty());
  ASSERT_EQ(warnings("needle.obj").size(), 1U);
  EXPECT_EQ(warnings("needle.obj")[0], "'needle.obj': 1 of 13 triangles are needles; they are left out.");
  ASSERT_EQ(warnings("inward.obj").size(), 1U);
  EXPECT_EQ(warnings("inward.obj")[0], "'inward.obj': its triangles look inward; they are turned.");
}

TEST_F(SceneFiles, PlaceTheBody) {
  const auto bar = scenario<3>(
      "[body]\nshape = \"bar\"\nsize_m = [0.4, 0.2, 0.2]\nrotation_deg = [0, 0, 20]\ngap_m = 0.01\nvelocity_m_s = [1, 2, 3]\n"
      "spin_deg_s = [0, 0, 180]\n[ground]\nslope_deg = 20\nheight_m = 2\n");
  const physics::Ground& ground = bar.scene.ground;
  EXPECT_NEAR(ground.normal.norm(), 1, 1e-12);
  EXPECT_NEAR(ground.normal.dot(Eigen::Vector3d(0, 2, 0)), ground.offset, 1e-12);
  EXPECT_NEAR(ground.normal.dot(Eigen::Vector3d(1, 2 + std::tan(20 * std::numbers::pi / 180), 0)), ground.offset, 1e-12);
  const Eigen::RowVectorXd heights = (ground.normal.transpose() * bar.start.x).array() - ground.offset;
  EXPECT_NEAR(heights.minCoeff(), 0.01, 1e-12);
  EXPECT_NEAR(heights.maxCoeff(), 0.21, 1e-12);
  EXPECT_LT((physics::momentum(bar.scene.body, bar.start.v) / bar.scene.body.mass.sum() - Eigen::Vector3d(1, 2, 3)).norm(), 1e-12);
  const Eigen::Vector3d centre = physics::centre_of_mass(bar.scene.body, bar.start.x);
  const Eigen::Vector3d spin = physics::inertia(bar.scene.body, bar.start.x, centre).inverse() *
                               physics::angular_momentum(bar.scene.body, bar.start.x, bar.start.v, centre);
  EXPECT_LT((spin - Eigen::Vector3d(0, 0, std::numbers::pi)).norm(), 1e-9);
}

TEST_F(SceneFiles, TurnTheBodyAboutXThenYThenZ) {
  const auto bar = scenario<3>("[body]\nshape = \"bar\"\nsize_m = [0.4, 0.2, 0.1]\nrotation_deg = [90, 90, 0]\nposition_m = [1, 2, 3]\n");
  const Eigen::Vector3d extents = bar.start.x.rowwise().maxCoeff() - bar.start.x.rowwise().minCoeff();
  EXPECT_LT((extents - Eigen::Vector3d(0.2, 0.1, 0.4)).norm(), 1e-12);
  EXPECT_LT((physics::centre_of_mass(bar.scene.body, bar.start.x) - Eigen::Vector3d(1, 2, 3)).norm(), 1e-12);
}

TEST_F(SceneFiles, GiveRegionsTheirOwnMaterial) {
  const std::string head = "[body]\nshape = \"bar\"\nsize_m = [1.0, 0.2, 0.2]\nrotation_deg = [0, 0, 90]\n[material]\nyoungs_modulus_pa = 1e5\n";
  const auto plain = scenario<3>(head);
  const auto half = scenario<3>(head + "[[region]]\nnormal = [1, 0, 0]\ndensity_kg_m3 = 3000\nyoungs_modulus_pa = 1e8\n");
  EXPECT_NEAR(half.scene.body.mass.sum(), 2 * plain.scene.body.mass.sum(), 0.25 * plain.scene.body.mass.sum());
  EXPECT_EQ(half.youngs_modulus, 1e8);
  const Eigen::ArrayXd ratio = half.scene.body.edge_stiffness.array() / plain.scene.body.edge_stiffness.array();
  EXPECT_NEAR(ratio.minCoeff(), 1, 1e-9);
  EXPECT_NEAR(ratio.maxCoeff(), 1000, 1e-6);
  // A turn of a quarter takes the half with positive x up.
  EXPECT_GT(physics::centre_of_mass(half.scene.body, half.start.x).y(), 0.1);
}

TEST_F(SceneFiles, MakeBodiesOfEveryElementAndLaw) {
  const std::string bar3 = "[body]\nshape = \"bar\"\nsize_m = [1.0, 0.2, 0.2]\ncell_size_m = 0.1\nelement = ";
  const std::string bar2 = "dimension = 2\n[body]\nshape = \"bar\"\nsize_m = [1.0, 0.2]\ncell_size_m = 0.1\nelement = ";
  const std::string heavy = "[[region]]\nnormal = [1, 0, 0]\ndensity_kg_m3 = 3000\n", heavy2 = "[[region]]\nnormal = [1, 0]\ndensity_kg_m3 = 3000\n";
  for (const std::string law : {"stable_neo_hookean", "corotated_linear"}) {
    SCOPED_TRACE(law);
    const std::string material = "[material]\npoissons_ratio = 0.1\nlaw = \"" + law + "\"\n";
    for (const std::string element : {"\"tet\"\n", "\"hex\"\n"}) {
      const physics::Body body = scenario<3>(bar3 + element + material + heavy).scene.body;
      ASSERT_EQ(body.elements.size(), 1U);
      EXPECT_EQ(body.elements[0].block.element_count(), element == "\"hex\"\n" ? 40 : 200);
      EXPECT_NEAR(body.mass.sum(), 80, 1e-9);
    }
    for (const std::string element : {"\"triangle\"\n", "\"quad\"\n"}) {
      const physics::BodyOf<2> body = scenario<2>(bar2 + element + material + heavy2).scene.body;
      ASSERT_EQ(body.elements.size(), 1U);
      EXPECT_EQ(body.elements[0].block.element_count(), element == "\"quad\"\n" ? 20 : 40);
      EXPECT_NEAR(body.mass.sum(), 400, 1e-9);
    }
  }
  const std::string springs = "\"tet\"\n[material]\nlaw = \"springs\"\n";
  EXPECT_TRUE(scenario<3>(bar3 + springs).scene.body.elements.empty());
}

TEST_F(SceneFiles, CalibrateTetsSoThatTheySagAsTheConvergedBar) {
  const std::string bar = "gravity_m_s2 = [0, -9.81, 0]\n[body]\nshape = \"bar\"\nsize_m = [1.0, 0.25, 0.25]\ncell_size_m = 0.125\n"
                          "[[clamp]]\nnormal = [-1, 0, 0]\noffset_m = 0.499\n[material]\nyoungs_modulus_pa = 5e7\n"
                          "law = \"stable_neo_hookean\"\ndamping_time_s = 0.01\ncalibrated = ";
  const double converged = 4.79e-3;  // [m] CalculiX 2.20: C3D8I of 24 x 6 x 6 cells
  for (const bool is_calibrated : {false, true}) {
    const auto scene = scenario<3>(bar + (is_calibrated ? "true\n" : "false\n"));
    EXPECT_EQ(scene.youngs_modulus, 5e7);
    retarget::SimulationOptions options;
    options.method = physics::Method::kEuler;
    options.dt_s = 0.1;
    options.duration_s = 3;
    const retarget::Motion motion = retarget::simulate(scene, options).motion;
    const auto end = motion.at(motion.count() - 1);
    double sum = 0;
    int count = 0;
    for (Eigen::Index n = 0; n < scene.start.x.cols(); ++n) {
      if (scene.start.x(0, n) < 0.499) continue;
      sum += scene.start.x(1, n) - end(1, n);
      ++count;
    }
    if (is_calibrated) {
      EXPECT_NEAR(sum / count, converged, 0.1 * converged);
    } else {
      EXPECT_LT(sum / count, 0.7 * converged);
    }
  }
}

TEST_F(SceneFiles, CalibrateEveryRegionByItsOwnPoissonsRatio) {
  const std::string square = "dimension = 2\n[body]\nshape = \"bar\"\nsize_m = [1.0, 0.2]\ncell_size_m = 0.1\n[material]\nlaw = \"corotated_linear\"\n"
                             "poissons_ratio = 0.3\ncalibrated = ";
  const std::string region = "[[region]]\nnormal = [1, 0]\nyoungs_modulus_pa = 1e5\npoissons_ratio = 0.45\n";
  const auto plain = scenario<2>(square + "false\n" + region), calibrated = scenario<2>(square + "true\n" + region);
  std::map<double, double> factors;
  for (std::size_t t = 0; t < 40; ++t) {
    const physics::ElementMaterial& before = plain.scene.body.elements[0].materials[t];
    const physics::ElementMaterial& after = calibrated.scene.body.elements[0].materials[t];
    EXPECT_EQ(before.poissons_ratio, after.poissons_ratio);
    factors.try_emplace(before.poissons_ratio, after.youngs_modulus / before.youngs_modulus);
    EXPECT_NEAR(after.youngs_modulus / before.youngs_modulus, factors[before.poissons_ratio], 1e-12);
  }
  ASSERT_EQ(factors.size(), 2U);
  EXPECT_LT(factors[0.45], factors[0.3]);  // the nearer to incompressible, the more they lock
  EXPECT_LT(factors[0.3], 1);
}

TEST_F(SceneFiles, WriteTheElementsAndTheirMaterials) {
  const std::string cube = "[body]\nshape = \"cube\"\nsize_m = 1\ncell_size_m = 0.5\n[material]\nlaw = \"corotated_linear\"\n";
  for (const bool has_region : {false, true}) {
    const auto scene = scenario<3>(cube + (has_region ? "[[region]]\nnormal = [1, 0, 0]\ndensity_kg_m3 = 5\n" : ""));
    const nlohmann::json json = nlohmann::json::parse(scene_body_text(scene));
    EXPECT_EQ(json.at("elements").size(), 40U);
    EXPECT_EQ(json.at("elements")[7], std::vector<int>(scene.scene.body.tets.col(7).begin(), scene.scene.body.tets.col(7).end()));
    EXPECT_EQ(json.at("element_fill"), std::vector<double>(40, 1));
    EXPECT_EQ(json.at("law"), "corotated_linear");
    EXPECT_EQ(json.at("youngs_modulus_pa"), 2e6);
    EXPECT_EQ(json.at("poissons_ratio"), 0.4);
    EXPECT_EQ(json.at("density_kg_m3").is_array(), has_region);
  }
  EXPECT_FALSE(nlohmann::json::parse(scene_body_text(scenario<3>("[body]\nshape = \"cube\"\nsize_m = 1\n"))).contains("elements"));
}

TEST_F(SceneFiles, ClampWhatLiesWithin) {
  const auto bar = scenario<3>(
      "[body]\nshape = \"bar\"\nsize_m = [1.0, 0.2, 0.2]\ncell_size_m = 0.1\nrotation_deg = [0, 0, 90]\nvelocity_m_s = [1, 0, 0]\n"
      "[[clamp]]\nnormal = [1, 0, 0]\noffset_m = 0.49\n[[clamp]]\nbox_m = [[-1, -1, -1], [-0.49, 1, 1]]\nuntil_s = 1.5\n");
  ASSERT_EQ(bar.clamps.size(), 2U);
  EXPECT_EQ(bar.clamps[1].until_s, 1.5);
  EXPECT_EQ(bar.scene.body.held.size(), 18U);
  for (const int node : bar.scene.body.held) {
    EXPECT_NEAR(std::abs(bar.start.x(1, node)), 0.5, 1e-12);
    EXPECT_EQ(bar.start.v.col(node).norm(), 0);
  }
  std::vector<int> held;
  retarget::hold_at(bar.clamps, 1.5, held);
  EXPECT_EQ(held, bar.clamps[0].nodes);
}

TEST_F(SceneFiles, LetWavesRunAlongTheirDirection) {
  const auto bar = scenario<2>(
      "dimension = 2\n[body]\nshape = \"bar\"\nsize_m = [1.0, 0.1]\ncell_size_m = 0.1\n"
      "[[activation]]\naxis = [1, 0]\namplitude = 0.2\noffset = -0.1\nfrequency_hz = 1\nwave_direction = [1, 0]\nwavelength_m = 0.5\n"
      "[[activation]]\nbox_m = [[-0.5, -0.1], [0.0, 0.1]]\noffset = 0.3\nwaveform = \"square\"\nfrom_s = 1.0\nuntil_s = 2.0\n");
  const physics::BodyOf<2>& body = bar.scene.body;
  Eigen::VectorXd activation(body.edge_count());
  for (const double t : {0.0, 0.3, 1.1, 2.0}) {
    retarget::activations_at(bar.waves, t, activation);
    for (int e = 0; e < body.edge_count(); ++e) {
      const Eigen::Vector2d a = bar.start.x.col(body.edges(0, e)), b = bar.start.x.col(body.edges(1, e)), middle = (a + b) / 2;
      const double along = std::pow((b - a).normalized().x(), 2);
      double expected = 1 + along * (-0.1 + 0.2 * std::sin(2 * std::numbers::pi * (t - middle.x() / 0.5)));
      if (t >= 1 && t < 2 && middle.x() <= 0) expected += 0.3;
      EXPECT_NEAR(activation[e], expected, 1e-12);
    }
  }
}

TEST_F(SceneFiles, ReadObstaclesMovesAndPushes) {
  const auto scene = scenario<3>(
      "gravity_m_s2 = [0, 0, -1]\n[body]\nshape = \"sphere\"\nsize_m = 0.2\n"
      "[[obstacle]]\nshape = \"box\"\nsize_m = [1, 2, 3]\nposition_m = [4, 5, 6]\n"
      "[[obstacle]]\nshape = \"ball\"\nsize_m = 3\nfriction = 0.1\n"
      "[[obstacle.move]]\nvelocity_m_s = [0, 1, 0]\nuntil_s = 2\n"
      "[[obstacle.move]]\nvelocity_m_s = [0, -1, 0]\nfrom_s = 2\n"
      "[[obstacle]]\nshape = \"half_space\"\nrotation_deg = [0, 0, 180]\n"
      "[[obstacle]]\nshape = \"mesh\"\nfile = \"cube.obj\"\n"
      "[[push]]\ntime_s = 1\ndelta_v_m_s = [1, 2, 3]\n");
  ASSERT_EQ(scene.scene.obstacles.size(), 4U);
  EXPECT_EQ(std::get<physics::BoxOf<3>>(scene.scene.obstacles[0].shape).half_extents, Eigen::Vector3d(0.5, 1, 1.5));
  EXPECT_EQ(scene.scene.obstacles[0].place, Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ(std::get<physics::Ball>(scene.scene.obstacles[1].shape).radius, 1.5);
  EXPECT_EQ(scene.scene.obstacles[1].friction, 0.1);
  EXPECT_LT((scene.scene.obstacles[2].turn * Eigen::Vector3d::UnitY() + Eigen::Vector3d::UnitY()).norm(), 1e-12);
  Eigen::Vector3d normal;
  EXPECT_NEAR(physics::signed_distance<3>(scene.scene.obstacles[3], Eigen::Vector3d::Zero(), Eigen::Vector3d(0.5, 0.5, 1.25), normal), 0.25, 1e-9);
  ASSERT_EQ(scene.moves.size(), 2U);
  EXPECT_EQ(scene.moves[1].obstacle, 1);
  EXPECT_EQ(scene.moves[1].from_s, 2);
  ASSERT_EQ(scene.pushes.size(), 1U);
  EXPECT_EQ(scene.pushes[0].delta_v, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(scene.scene.gravity, Eigen::Vector3d(0, 0, -1));
}

TEST_F(SceneFiles, DistortTheStartBySeed) {
  const std::string head = "[body]\nshape = \"cube\"\nsize_m = 0.2\nposition_m = [0, 1, 0]\nstart = ";
  const auto flat = scenario<3>(head + "\"flattened\"\n"), point = scenario<3>(head + "\"collapsed\"\n");
  EXPECT_NEAR(flat.start.x.row(1).minCoeff(), 1, 1e-12);
  EXPECT_NEAR(flat.start.x.row(1).maxCoeff(), 1, 1e-12);
  EXPECT_LE((point.start.x.colwise() - Eigen::Vector3d(0, 1, 0)).cwiseAbs().maxCoeff(), 1e-4 + 1e-12);
  write_file(file, head + "\"random\"\n");
  const auto with_seed = [&](unsigned seed) { return std::get<ScenarioOf<3>>(read_scene_file(file, seed).scenario).start.x; };
  EXPECT_EQ(with_seed(1), with_seed(1));
  EXPECT_GT((with_seed(1) - with_seed(2)).norm(), 0.1);
  EXPECT_LE((with_seed(3).colwise() - Eigen::Vector3d(0, 1, 0)).cwiseAbs().maxCoeff(), 0.1 + 1e-12);
}

TEST_F(SceneFiles, ThatAreWrongAreRefusedWithLineAndMend) {
  struct Bad {
    const char *text, *where, *what, *mend;  // parts of them
  };
  for (const Bad& bad : {
           Bad{"", "", "there is no [body]", "Add [body]"},
           {"x = \n", "line 1", "", "Mend the TOML"},
           {"\nboddy = 1\n", "line 2", "'boddy' is not known here", "Did you mean 'body'?"},
           {"dimension = 4\n", "line 1", "'dimension' is no whole number from 2 to 3", ""},
           {"dimension = \"two\"\n", "line 1", "'dimension' is no whole number", ""},
           {"dt_s = 1.0\n[body]\n", "line 1", "'dt_s' is 1", "at most 0.2"},
           {"body = 3\n", "line 1", "'body' is a number where a table belongs", "Write [body]"},
           {"[body]\nshape = \"cub\"\n", "line 2", "'shape' of [body] is 'cub', which is none of cube", "Did you mean 'cube'?"},
           {"[body]\nshape = 3\n", "line 2", "is a number where a text belongs", "quotes"},
           {"[body]\nshape = \"circle\"\n", "line 2", "none of cube", ""},
           {"[body]\nshape = \"cube\"\n", "line 1", "'size_m' of [body] is missing", "Add size_m"},
           {"[body]\nshape = \"cube\"\nsize_m = -1\n", "line 3", "'size_m' of [body] is -1", "at least 1e-06"},
           {"[body]\nshape = \"cube\"\nsize_m = 1e300\n", "line 3", "is 1e+300", "at most 1e+06"},
           {"[body]\nshape = \"cube\"\nsize_m = 1\nposition_m = [0, 1e30, 0]\n", "line 4", "is 1e+30", "at most 1e+07"},
           {"dimension = 2\n[body]\nshape = \"outline\"\noutline_m = [[0, 0], [1, 0], [1, 1e-12], [0, 1e-12]]\n", "line 3", "more than 50000 nodes", ""},
           {"[body]\nshape = \"cube\"\nsize_m = [1, 2]\n", "line 3", "not a list of 3 numbers", ""},
           {"[body]\nshape = \"cube\"\nsize = 1\nsize_m = 1\n", "line 3", "'size' of [body] is not known here", "Did you mean 'size_m'?"},
           {"[body]\nshape = \"cube\"\nsize_cm = 1\n", "line 3", "'size_cm' of [body] is not known here", "Did you mean 'size_m'?"},
           {"[body]\nshape = \"cube\"\nsize_m = 1\n[[push]]\ntime_ms = 5\ndelta_v_m_s = [0, 1, 0]\n", "line 5", "'time_ms' of [[push]] is not known here", "Did you mean 'time_s'?"},
           {"[body]\nshape = \"sphere\"\nscale = 2\n", "line 1", "'size_m' of [body] is missing", "Add size_m"},
           {"[body]\nshape = \"cube\"\nsize_m = 1\nfile = \"x\"\n", "line 4", "'file' of [body] is not known here", ""},
           {"[body]\nshape = \"cube\"\nsize_m = 1\nnodes = 100\ncell_size_m = 0.1\n", "line 4", "both say how fine", "Leave one"},
           {"[body]\nshape = \"cube\"\nsize_m = 1\ncell_size_m = 0.001\n", "line 4", "more than 50000 nodes", "larger"},
           {"[body]\nshape = \"bar\"\nsize_m = [1, 1, 0.001]\ncell_size_m = 1.0\n", "line 2", "slivers", "smaller 'cell_size_m'"},
           {"[body]\nshape = \"mesh\"\nfile = \"open.obj\"\n", "line 3", "not closed", "Close its holes"},
           {"[body]\nshape = \"mesh\"\nfile = \"none.obj\"\n", "line 3", "none.obj", ""},
           {"[body]\nshape = \"mesh\"\nfile = \"cube.obj\"\nrotation_deg = [20, 30, 0]\ncell_size_m = 3.0\ngap_m = 0.0\n", "line 6", "there is no ground", "Add [ground]"},
           {"dimension = 2\n[body]\nshape = \"outline\"\noutline_m = [[0, 0], [1, 1], [1, 0], [0, 1]]\n", "line 4", "cuts itself", "order"},
           {"dimension = 2\n[body]\nshape = \"outline\"\noutline_m = [[0, 0], [1, 1]]\n", "line 4", "fewer than three", ""},
           {"dimension = 2\n[body]\nshape = \"outline\"\noutline_m = [[0, 0], [1, 1, 1], [1, 0]]\n", "line 4", "no list of 2 numbers", ""},
           {"dimension = 2\n[body]\nshape = \"outline\"\noutline_m = [[0, 0], [1, 0], [1, 0.01], [0.55, 0.01], [0.5, 0.3], [0.45, 0.01], [0, 0.01]]\ncell_size_m = 0.3\n",
            "line 3", "% of the volume", "cell_size_m"},
           {"[body]\nshape = \"cube\"\nsize_m = 1\n[material]\ndensity_kg_m3 = -5\n", "line 5", "'density_kg_m3' of [material] is -5", "above 0"},
           {"[body]\nshape = \"cube\"\nsize_m = 1\n[material]\npoissons_ratio = 0.5\n", "line 5", "is 0.5", "at most 0.4999"},
           {"[body]\nshape = \"cube\"\nsize_m = 1\n[material]\nlaw = \"springs\"\npoissons_ratio = 0.1\n", "line 6", "Poisson's ratio of 0.25", "0.25 or more"},
           {"[body]\nshape = \"cube\"\nsize_m = 1\n[material]\nyoungs_modulus = 1e5\n", "line 5", "not known here", "Did you mean 'youngs_modulus_pa'?"},
           {"[body]\nshape = \"cube\"\nsize_m = 1\n[material]\nyoungs_modulus_pa = \"soft\"\n", "line 5", "a text where a number belongs", ""},
           {"[body]\nshape = \"cube\"\nsize_m = 1\n[[region]]\nbox_m = [[5, 5, 5], [6, 6, 6]]\n", "line 5", "nothing of the body lies there", "own frame"},
           {"[body]\nshape = \"cube\"\nsize_m = 1\nposition_m = [0, 3, 0]\n[[clamp]]\nbox_m = [[-1, 3, -1], [1, 4, 1]]\n", "line 6", "nothing of the body lies there",
            "own frame, unturned: what can be marked lies from [-0.5, -0.5, -0.5] to [0.5, 0.5, 0.5]."},
           {"dimension = 2\n[body]\nshape = \"outline\"\noutline_m = [[2, 1], [4, 1], [4, 2], [2, 2]]\ncell_size_m = 0.5\n[[clamp]]\nnormal = [-1, 0]\noffset_m = 0.5\n",
            "line 7", "nothing of the body lies there", "what can be marked lies from [2, 1] to [4, 2]."},
           {"[body]\nshape = \"mesh\"\nfile = \"cube.obj\"\n[[seam]]\nnormal = [0, 1, 0]\noffset_m = 99\n", "line 5", "the seam parts nothing of the body", "in its own frame, reaches from ["},
           {"dimension = 2\n[body]\nshape = \"outline\"\noutline_m = [[2, 1], [4, 1], [4, 2], [2, 2]]\ncell_size_m = 0.5\n[[seam]]\nnormal = [1, 0]\noffset_m = 0\n",
            "line 7", "the seam parts nothing of the body", "reaches from [2, 1] to [4, 2];"},
           {"[body]\nshape = \"cube\"\nsize_m = 1\n[ground]\nslope_deg = 90\n", "line 5", "'slope_deg' of [ground] is 90", "at most 80"},
           {"[body]\nshape = \"cube\"\nsize_m = 1\n[ground]\nfriction = -0.1\n", "line 5", "is -0.1", "at least 0"},
           {"[body]\nshape = \"cube\"\nsize_m = 1\n[[obstacle]]\nshape = \"bal\"\n", "line 5", "none of box, ball", "Did you mean 'ball'?"},
           {"[body]\nshape = \"cube\"\nsize_m = 1\n[[obstacle]]\nshape = \"ball\"\nradius_m = 1\nsize_m = 1\n", "line 6", "not known here", ""},
           {"[body]\nshape = \"cube\"\nsize_m = 1\n[[obstacle]]\nshape = \"ball\"\nsize_m = 1\n[[obstacle.move]]\nfrom_s = 2\nuntil_s = 1\nvelocity_m_s = [1, 0, 0]\n",
            "line 9", "'until_s' of [[move]] is 1", "above 2"},
           {"[body]\nshape = \"cube\"\nsize_m = 1\n[[activation]]\namplitude = 0.9\noffset = 0.2\n", "", "add up to 1.1", "below 0.95"},
           {"[body]\nshape = \"cube\"\nsize_m = 1\n[[activation]]\namplitude = 0.1\nwavelength_m = 1\n", "line 4", "'wave_direction' of [[activation]] is missing", ""},
           {"[body]\nshape = \"cube\"\nsize_m = 1\n[[push]]\ntime_s = 1\n", "line 4", "'delta_v_m_s' of [[push]] is missing", ""},
           {"[body]\nshape = \"sphere\"\nsize_m = 1\nelement = \"hex\"\n", "line 4", "only boxes", "Leave 'element' out"},
           {"[body]\nshape = \"cube\"\nsize_m = 1\nelement = \"hex\"\n[material]\nlaw = \"springs\"\n", "line 5", "springs need tets", "another law"},
           {"[body]\nshape = \"cube\"\nsize_m = 1\n[material]\ncalibrated = true\n", "line 5", "only finite elements that are tets of a cube or bar", "law other than springs"},
           {"[body]\nshape = \"sphere\"\nsize_m = 1\n[material]\nlaw = \"corotated_linear\"\ncalibrated = true\n", "line 6", "only finite elements", "or leave 'calibrated' out"},
           {"[body]\nshape = \"cube\"\nsize_m = 1\nelement = \"hex\"\n[material]\nlaw = \"corotated_linear\"\ncalibrated = true\n", "line 7", "only finite elements", "in tets"},
           {"[body]\nshape = \"cube\"\nsize_m = 1\n[material]\ncalibrated = 1\n", "line 5", "'calibrated' of [material] is ", "Give true or false"},
           {"[body]\nshape = \"cube\"\nsize_m = 1\n[material]\nlaw = \"neo_hookean\"\n", "line 5", "none of ", "Did you mean 'stable_neo_hookean'?"},
           {"[body]\nshape = \"cube\"\nsize_m = 1\n[[clamp]]\nnormal = [0, 0, 0]\n", "line 5", "has no direction", ""},
           {"[body]\nshape = \"cube\"\nsize_m = 1\n[[seam]]\noffset_m = 0\n", "line 4", "'normal' of [[seam]] is missing", ""},
           {"[body]\nshape = \"cube\"\nsize_m = 1\n[[seam]]\nnormal = [0, 0, 0]\n", "line 5", "has no direction", ""},
           {"[body]\nshape = \"cube\"\nsize_m = 1\n[[seam]]\nnormal = [0, 1, 0]\noffset_m = 2\n", "line 5", "the seam parts nothing of the body", "between elements"},
           {"[body]\nshape = \"cube\"\nsize_m = 1\n[[seam]]\nnormal = [0, 1, 0]\nbox_m = [[5, 5, 5], [6, 6, 6]]\n", "line 6", "the seam parts nothing", "own frame"},
           {"[body]\nshape = \"cube\"\nsize_m = 1\n[[seam]]\nnormal = [0, 1, 0]\nbox_m = [[5, 5, 5]]\n", "line 6", "not two corners", "[low ...]"},
           {"[body]\nshape = \"cube\"\nsize_m = 1\n[[seam]]\nnormal = [0, 1, 0]\nstrength_pa = 0\n", "line 6", "'strength_pa' of [[seam]] is 0", "above 0"},
           {"[body]\nshape = \"cube\"\nsize_m = 1\n[[seam]]\nnormal = [0, 1, 0]\nstrenght_pa = 5\n", "line 6", "not known here", "Did you mean 'strength_pa'?"},
           {"[body]\nshape = \"cube\"\nsize_m = 1\n[effects]\nfracture = \"on\"\n", "line 4", "'fracture' is asked for, but no seam is marked", "Add what it needs"},
           {"method = \"magic\"\n[body]\nshape = \"cube\"\nsize_m = 1\n", "line 1", "'method' is 'magic'", ""},
       }) {
    SCOPED_TRACE(bad.text);
    const std::string told = refusal([&] { read(bad.text); });
    EXPECT_TRUE(told.starts_with(file.string() + "|" + bad.where)) << told;
    EXPECT_NE(told.find(bad.what), std::string::npos) << told;
    EXPECT_NE(told.find(bad.mend), std::string::npos) << told;
  }
}

TEST(Scenes, OfTheSamplesAreRead) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(HYDROSTAT_SAMPLES) / "scenes")) {
    SCOPED_TRACE(entry.path().string());
    const SceneFile scene = read_scene_file(entry.path());
    EXPECT_TRUE(scene.warnings.empty()) << scene.warnings.front();
    ++count;
  }
  EXPECT_GE(count, 5);
}

TEST_F(SceneFiles, TouchThemselvesWhereTheyMayComeToMeet) {
  struct Scene {
    std::string text;
    bool is_on;
    const char* reason;
  };
  const std::string bar = "dimension = 2\n[body]\nshape = \"bar\"\nsize_m = [2.0, 0.2]\n", ground = "[ground]\nfriction = 0.3\n";
  const std::string square = "dimension = 2\n[body]\nshape = \"square\"\nsize_m = 1\n";
  const std::string jaws = "dimension = 2\n[body]\nshape = \"outline\"\nnodes = 200\n"
                           "outline_m = [[0, 0], [2, 0], [2, 0.9], [0.5, 0.9], [0.5, 1.1], [2, 1.1], [2, 2], [0, 2]]\n";
  for (const Scene& scene :
       {Scene{bar, false, "nothing bends"}, Scene{bar + ground, true, "times its mean width: it may"}, Scene{square + ground, false, "a ring of it"},
        Scene{jaws + ground, true, "stand within two cells"}, Scene{bar + "start = \"random\"\n" + ground, false, "out of shape"},
        Scene{square + ground + "[effects]\nself_contact = \"on\"\n", true, "asked for"},
        Scene{bar + ground + "[effects]\nself_contact = \"off\"\n", false, "turned off"}}) {
    SCOPED_TRACE(scene.text);
    const ScenarioOf<2> read = scenario<2>(scene.text);
    EXPECT_EQ(read.scene.self_contact.is_on, scene.is_on);
    EXPECT_NE(read.self_contact_reason.find(scene.reason), std::string::npos) << read.self_contact_reason;
    EXPECT_TRUE(!scene.is_on || read.scene.self_contact.friction == 0.3);
  }
  EXPECT_EQ(scenario<2>(bar + ground + "[effects]\nself_friction = 0.7\n").scene.self_contact.friction, 0.7);
}

TEST_F(SceneFiles, FarFromTheOriginMoveAsNearIt) {
  std::vector<retarget::Simulation> runs;
  const Eigen::Vector3d far(10000, 0, -7000);
  for (const bool is_far : {false, true}) {
    const std::string x = std::to_string(is_far ? far.x() : 0), z = std::to_string(is_far ? far.z() : 0);
    const auto scene = scenario<3>("[body]\nshape = \"cube\"\nsize_m = 0.4\nnodes = 30\nposition_m = [" + x + ", 0.45, " + z +
                                   "]\nrotation_deg = [20, 0, 30]\n[material]\nyoungs_modulus_pa = 2e5\n[ground]\n[[obstacle]]\n"
                                   "shape = \"ball\"\nsize_m = 0.2\nposition_m = [" + x + ", 0.1, " + z + "]\n");
    EXPECT_LT(scene.start.x.cwiseAbs().maxCoeff(), 64);
    retarget::SimulationOptions options;
    options.duration_s = 0.5;
    options.trace = true;
    runs.push_back(retarget::simulate(scene, options));
  }
  const retarget::Trace &near = runs[0].trace, &away = runs[1].trace;
  ASSERT_EQ(near.count(), away.count());
  double apart = 0, turned = 0;
  for (Eigen::Index s = 0; s < near.count(); ++s) {
    const Eigen::Vector3d force = near.contact_force.col(s).reshaped(3, near.mass_kg.size()).rowwise().sum();
    turned = std::max(turned, (away.contact_moment.col(s) - near.contact_moment.col(s) - far.cross(force)).norm());
    for (Eigen::Index n = 0; n < near.mass_kg.size(); ++n) {
      apart = std::max(apart, (away.position.col(s).segment<3>(3 * n) - far - near.position.col(s).segment<3>(3 * n)).norm());
    }
  }
  EXPECT_LT(apart, 1e-9);
  EXPECT_LT(turned, 1e-4);  // [N m], of forces of some 1000 N with levers of 10 km
  EXPECT_GT(near.contact_force.norm(), 0);
  EXPECT_LT(runs[1].report.momentum_residual_mg, 1e-10);
  EXPECT_LT(runs[1].report.angular_residual_mgl, 1e-10);
}

}  // namespace
}  // namespace hydrostat::io::scene_file_test
