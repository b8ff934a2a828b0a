#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "tests/io/temporary_directory.h"
#include "tests/physics/element_method_scene.h"

namespace hydrostat::physics::calculix_test {
namespace {

constexpr double kStiff = 5e7;  // [Pa]: the bar sags by a few millimetres, where its law is Hooke's

int tip_of(const Body& body) {
  for (int i = 0; i < body.node_count(); ++i) {
    if ((body.rest.col(i) - Eigen::Vector3d(1, 0.125, 0.125)).norm() < 1e-9) return i;
  }
  ADD_FAILURE() << "the bar has no node at the end of its axis";
  return 0;
}

/// By how much the end of the axis has sunk where the body has settled [m].
double settled_sag(const Scene& scene) {
  const std::unique_ptr<Stepper> stepper = make_euler_stepper(scene);
  Impulses impulses = make_impulses(scene);
  State state{scene.body.rest, Eigen::Matrix3Xd::Zero(3, scene.body.node_count())};
  const int tip = tip_of(scene.body);
  for (int k = 0; k < 40; ++k)
    EXPECT_EQ(stepper->step(0.1, passive(scene.body), nullptr, state, impulses), Termination::kDone);
  return scene.body.rest(1, tip) - state.x(1, tip);
}

bool has_calculix() { return std::system("command -v ccx > /dev/null 2>&1") == 0; }

/// What CalculiX finds for the same nodes, elements and held nodes under their weight [m]. Its hexahedra go round their
/// faces.
double calculix_sag(const Scene& scene, const std::string& element, double poissons_ratio) {
  const TemporaryDirectory directory;
  const Body& body = scene.body;
  const Eigen::MatrixXi& nodes = body.elements.front().block.nodes;
  constexpr int kAround[] = {0, 1, 3, 2, 4, 5, 7, 6};
  {
    std::ofstream file(directory.path / "bar.inp");
    file.precision(17);
    file << "*NODE\n";
    for (int i = 0; i < body.node_count(); ++i) {
      file << i + 1 << ',' << body.rest(0, i) << ',' << body.rest(1, i) << ',' << body.rest(2, i) << '\n';
    }
    file << "*ELEMENT,TYPE=" << element << ",ELSET=BAR\n";
    for (Eigen::Index e = 0; e < nodes.cols(); ++e) {
      file << e + 1;
      for (int n = 0; n < nodes.rows(); ++n) file << ',' << nodes(nodes.rows() == 8 ? kAround[n] : n, e) + 1;
      file << '\n';
    }
    file << "*NSET,NSET=TIP\n" << tip_of(body) + 1 << "\n*BOUNDARY\n";
    for (const int node : body.held) file << node + 1 << ",1,3\n";
    file << "*MATERIAL,NAME=STUFF\n*ELASTIC\n"
         << kStiff << ',' << poissons_ratio << "\n*DENSITY\n1000\n"
         << "*SOLID SECTION,ELSET=BAR,MATERIAL=STUFF\n*STEP\n*STATIC\n*DLOAD\nBAR,GRAV,9.81,0,-1,0\n*NODE "
            "PRINT,NSET=TIP\nU\n*END STEP\n";
  }
  const std::string command = "cd '" + directory.path.string() + "' && OMP_NUM_THREADS=1 ccx bar > log 2>&1";
  EXPECT_EQ(std::system(command.c_str()), 0);
  std::ifstream result(directory.path / "bar.dat");
  double node = 0, x = 0, y = 0;
  for (std::string line; std::getline(result, line);) {
    if (std::sscanf(line.c_str(), "%lf %lf %lf", &node, &x, &y) == 3) return -y;
  }
  ADD_FAILURE() << "ccx told no displacement";
  return 0;
}

void expect_same_sag(int cells_along, int cells_across, Cut cut, const std::string& element, double poissons_ratio) {
  if (!has_calculix()) GTEST_SKIP() << "ccx is not installed (samples/setup.sh --tests installs it)";
  SCOPED_TRACE("Poisson's ratio " + std::to_string(poissons_ratio));
  const Scene scene = cantilever<3>(cells_along, cells_across, cut, {1000, kStiff, poissons_ratio});
  EXPECT_NEAR(settled_sag(scene) / calculix_sag(scene, element, poissons_ratio), 1, 1e-3);
}

TEST(Calculix, SettledTetsSagAlike) {
  for (const double poissons_ratio : {0.4, 0.49}) expect_same_sag(8, 2, Cut::kSixTets, "C3D4", poissons_ratio);
}

// 325 nodes.
TEST(Calculix, SettledTetsOfAFinerMeshSagAlike) { expect_same_sag(12, 4, Cut::kSixTets, "C3D4", 0.49); }

// With Poisson's ratio 0 hexahedra have no volume modes left, which C3D8I does not have.
TEST(Calculix, SettledHexahedraSagAlike) { expect_same_sag(8, 2, Cut::kBoxes, "C3D8I", 0); }

// Converged values are of 2,048 quadratic hexahedra (C3D20) of CalculiX 2.20.
TEST(ElementStatics, FewHexahedraSagNearlyAsTheConvergedBarDoes) {
  const double at_40 = settled_sag(cantilever<3>(8, 2, Cut::kBoxes, {1000, kStiff, 0.4})) / 4.828e-3;
  EXPECT_GT(at_40, 0.95);
  EXPECT_LT(at_40, 1.05);
  const double at_49 = settled_sag(cantilever<3>(8, 2, Cut::kBoxes, {1000, kStiff, 0.49})) / 4.701e-3;
  EXPECT_GT(at_49, 0.85);
  EXPECT_LT(at_49, 1.05);
  RecordProperty("share at 0.4", std::to_string(at_40));
  RecordProperty("share at 0.49", std::to_string(at_49));
}

}  // namespace
}  // namespace hydrostat::physics::calculix_test
