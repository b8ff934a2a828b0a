#include "physics/element_block.h"

#include <gtest/gtest.h>

#include "tests/physics/element_scene.h"

namespace hydrostat::physics::element_block_test {
namespace {

ElementMesh<3> unit_box(Cut cut = Cut::kBoxes) { return element_bar<3>({1, 1, 1}, {1, 1, 1}, cut); }

template <int Dim>
void masses_and_volumes_add_up() {
  for (const Cut cut : cuts<Dim>()) {
    for (const int cells : {1, 2, 3}) {
      SCOPED_TRACE(name_of(cut) + " " + std::to_string(cells));
      const Eigen::Matrix<int, Dim, 1> counts = Eigen::Matrix<int, Dim, 1>::Constant(cells);
      const Eigen::Matrix<double, Dim, 1> size = Eigen::Matrix<double, Dim, 1>::LinSpaced(Dim, 0.5, 1.5);
      ElementMesh<Dim> mesh = element_bar<Dim>(counts, size, cut, {1200, 1e6, 0.3});
      mesh.fill.setConstant(0.25);
      const ElementBlock<Dim> block = make_element_block(mesh, ElasticLaw::kStableNeoHookean);
      Eigen::VectorXd mass = Eigen::VectorXd::Zero(mesh.rest.cols());
      add_lumped_mass(block, mass);
      EXPECT_NEAR(block.rest_volume.sum(), size.prod(), 1e-12);
      EXPECT_NEAR(mass.sum(), 1200 * 0.25 * size.prod(), 1e-9);
      EXPECT_GT(mass.minCoeff(), 0);
      const Eigen::Matrix<double, Dim, 1> centre = mesh.rest * mass / mass.sum();
      EXPECT_LT((centre - size / 2).norm(), cut == Cut::kBoxes ? 1e-12 : 0.1);
    }
  }
}

TEST(MakeElementBlock, MassesAndVolumesAddUp) {
  masses_and_volumes_add_up<2>();
  masses_and_volumes_add_up<3>();
}

TEST(BrokenRuleOfElements, AcceptsWhatIsWhole) {
  for (const Cut cut : cuts<3>()) EXPECT_EQ(broken_rule(unit_box(cut)), "");
  for (const Cut cut : cuts<2>()) EXPECT_EQ(broken_rule(element_bar<2>({2, 1}, {1, 1}, cut)), "");
}

TEST(BrokenRuleOfElements, NamesTheElementWithoutVolume) {
  ElementMesh<3> turned = unit_box(Cut::kFiveTets);
  std::swap(turned.nodes(0, 3), turned.nodes(1, 3));
  EXPECT_EQ(broken_rule(turned).substr(0, 20), "element 3 has volume");

  ElementMesh<3> flat = unit_box(Cut::kSixTets);
  flat.rest.row(2).setZero();
  EXPECT_EQ(broken_rule(flat).substr(0, 20), "element 0 has volume");

  ElementMesh<3> sliver = element_bar<3>({1, 1, 1}, {1, 1, 1e-7}, Cut::kSixTets);
  EXPECT_EQ(broken_rule(sliver).substr(0, 20), "element 0 has volume");

  ElementMesh<3> folded = unit_box();
  folded.rest.col(0).setConstant(0.7);
  EXPECT_EQ(broken_rule(folded), "element 0 is folded over at a corner");

  ElementMesh<3> nowhere = unit_box();
  nowhere.rest(1, 5) = std::nan("");
  EXPECT_EQ(broken_rule(nowhere), "element 0 has a place that is not finite");
}

TEST(BrokenRuleOfElements, NamesTheValueThatIsOff) {
  const auto rule_of = [](const auto& spoil) {
    ElementMesh<3> mesh = element_bar<3>({2, 1, 1}, {2, 1, 1}, Cut::kBoxes);
    spoil(mesh);
    return broken_rule(mesh);
  };
  EXPECT_EQ(rule_of([](auto& mesh) { mesh.fill[1] = 0; }), "element 1 must have a fill above 0 and at most 1");
  EXPECT_EQ(rule_of([](auto& mesh) { mesh.fill[1] = 1.5; }), "element 1 must have a fill above 0 and at most 1");
  EXPECT_EQ(rule_of([](auto& mesh) { mesh.fill.resize(1); }), "there must be one fill for each element");
  EXPECT_EQ(rule_of([](auto& mesh) { mesh.nodes(3, 1) = 99; }), "element 1 names a node that is not there");
  EXPECT_EQ(rule_of([](auto& mesh) { mesh.nodes(3, 1) = -1; }), "element 1 names a node that is not there");
  EXPECT_EQ(rule_of([](auto& mesh) { mesh.nodes.conservativeResize(5, 2); }), "an element must have 4 or 8 nodes");
  EXPECT_EQ(rule_of([](auto& mesh) { mesh.nodes.resize(8, 0); }), "there must be an element");
  EXPECT_EQ(rule_of([](auto& mesh) { mesh.materials.resize(3); }), "there must be one material for all elements or one for each");
  EXPECT_EQ(rule_of([](auto& mesh) { mesh.materials[0].density = 0; }), "material 0: density must be above 0 kg/m3");
  EXPECT_EQ(rule_of([](auto& mesh) { mesh.materials[0].poissons_ratio = 0.5; }),
            "material 0: Poisson's ratio must be at least 0 and below 0.5");
}

TEST(MemoryOf, GrowsWithTheElementsAlone) {
  const auto bytes = [](int cells, Cut cut) {
    const ElementMesh<3> mesh = element_bar<3>({cells, 4, 4}, {1, 1, 1}, cut);
    return static_cast<double>(memory_of(make_element_block(mesh, ElasticLaw::kStableNeoHookean))) / mesh.nodes.cols();
  };
  EXPECT_LT(bytes(8, Cut::kBoxes), 1300);
  EXPECT_LT(bytes(8, Cut::kFiveTets), 220);
  EXPECT_NEAR(bytes(32, Cut::kBoxes) / bytes(8, Cut::kBoxes), 1, 0.02);
}

}  // namespace
}  // namespace hydrostat::physics::element_block_test
