#include "retarget/voxelize.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <random>

#include "shapes.h"

namespace hydrostat::retarget::voxelize_test {
namespace {

TEST(WithClosedHoles, LeavesAClosedSkinAlone) {
  const SkinnedMesh box = box_skin({0, 0, 0}, {1, 1, 1});
  EXPECT_EQ(with_closed_holes(box.vertices, box.triangles).triangles.cols(), box.triangles.cols());
}

TEST(WithClosedHoles, PutsALidOnATubeButNotOnASheet) {
  const SkinnedMesh box = box_skin({0, 0, 0}, {1, 1, 3}, 0, 4);
  const Eigen::Index a_side = box.triangles.cols() / 6;
  const TriangleSoup tube =
      with_closed_holes(box.vertices, box.triangles.leftCols(4 * a_side));  // both ends along z missing
  EXPECT_EQ(tube.triangles.cols(), 4 * a_side + 2 * 16);                    // 16 rim edges an end
  const TriangleSoup sheet = with_closed_holes(box.vertices, box.triangles.leftCols(a_side));
  EXPECT_EQ(sheet.triangles.cols(), a_side);
}

TEST(Voxelize, TellsInsideFromOutside) {
  const SkinnedMesh ball = ball_skin({1, 1, 1}, 24);
  const Lattice lattice{{-1.25, -1.25, -1.25}, {0.25, 0.25, 0.25}, {10, 10, 10}, 4};
  const std::vector<Voxel> voxels = voxelize(with_closed_holes(ball.vertices, ball.triangles), lattice);
  ASSERT_EQ(voxels.size(), 64000u);
  const double voxel = lattice.voxel_size()[0];
  std::size_t i = 0;
  for (int z = 0; z < 40; ++z) {
    for (int y = 0; y < 40; ++y) {
      for (int x = 0; x < 40; ++x, ++i) {
        const double radius = (lattice.origin + voxel * (Eigen::Vector3d(x, y, z).array() + 0.5).matrix()).norm();
        if (std::abs(radius - 1) < voxel) continue;
        EXPECT_EQ(voxels[i], radius < 1 ? Voxel::inside : Voxel::outside);
      }
    }
  }
}

TEST(Voxelize, LetsNothingSlipThroughASlantedSkin) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::srand(seed);
    SkinnedMesh box = box_skin({-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}, 0, 1);
    box.vertices = Eigen::Quaterniond::UnitRandom().toRotationMatrix() * box.vertices;
    const Lattice lattice{{-1, -1, -1}, {1, 1, 1}, {2, 2, 2}, 15};
    const std::vector<Voxel> voxels = voxelize({box.vertices, box.triangles}, lattice);
    const double volume = static_cast<double>(std::count(voxels.begin(), voxels.end(), Voxel::inside)) +
                          0.5 * static_cast<double>(std::count(voxels.begin(), voxels.end(), Voxel::skin));
    EXPECT_NEAR(volume * lattice.voxel_size().prod(), 1, 0.03);  // [m³]
  }
}

}  // namespace
}  // namespace hydrostat::retarget::voxelize_test
