#include "io/lost_curves.h"

#include <gtest/gtest.h>

namespace hydrostat::io::lost_curves_test {
namespace {

TEST(LostCurves, AreWarnedOfWhereGreatArcAndEulerAnglesPart) {
  Scene scene;
  for (int n = 0; n < 2; ++n) {
    SceneNode node;
    node.name = n == 0 ? "hip" : "knee";
    node.parent = n - 1;
    node.parts = {Eigen::Affine3d(Eigen::Translation3d(0, n, 0))};
    node.is_joint = true;
    scene.nodes.push_back(node);
  }
  const auto warnings = [&](const Eigen::Quaterniond& from, const Eigen::Quaterniond& to) {
    Channel channel;
    channel.rotation.times = {0, 1.0 / 60};
    channel.rotation.values.resize(4, 2);
    channel.rotation.values << from.coeffs(), to.coeffs();
    return lost_curve_warnings(scene, {"run", 1.0 / 60, {channel}}, 1.0 / 60).size();
  };
  using Eigen::AngleAxisd, Eigen::Quaterniond, Eigen::Vector3d;
  const Quaterniond tilt(AngleAxisd(0.4, Vector3d::UnitZ()) * AngleAxisd(-0.7, Vector3d::UnitY()));
  EXPECT_EQ(warnings(tilt, tilt * Quaterniond(AngleAxisd(0.8, Vector3d::UnitX()))), 0u) << "as a knee bends";
  EXPECT_EQ(warnings(tilt, tilt * Quaterniond(AngleAxisd(0.2, Vector3d(1, 1, 1).normalized()))), 0u) << "a little";
  EXPECT_EQ(warnings(tilt, tilt * Quaterniond(AngleAxisd(0.8, Vector3d(1, 1, 1).normalized()))), 1u);
}

}  // namespace
}  // namespace hydrostat::io::lost_curves_test
