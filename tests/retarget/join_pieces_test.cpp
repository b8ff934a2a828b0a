#include "retarget/join_pieces.h"

#include <gtest/gtest.h>

#include "retarget/cut_into_tets.h"

namespace hydrostat::retarget::join_pieces_test {
namespace {

/// Parts in the given cells, not linked.
BodyParts loose_parts(const std::vector<Part>& parts) { return {parts, {}, {}, {}}; }

/// Face-connected pieces of the mesh of these parts.
int pieces_of(const Grid& cells, const BodyParts& body) {
  ControlMesh mesh;
  cut_into_tets({Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones(), cells.size}, number_cells(cells, body), mesh);
  return mesh.pieces;
}

TEST(JoinPieces, BuildsABridgeThroughTheCellsBetween) {
  const Grid row{{4, 1, 1}};
  BodyParts body = loose_parts({{0, 0.5}, {3, 0.5}});
  EXPECT_EQ(pieces_of(row, body), 2);
  EXPECT_EQ(join_pieces(row, body), 2);
  EXPECT_EQ(pieces_of(row, body), 1);
  EXPECT_EQ(body.parts[2].fill, 0);
  EXPECT_EQ(join_pieces(row, body), 0);  // one piece is left as it is
}

TEST(JoinPieces, GoesThroughTheFullerCells) {
  /*  . b     Two ways lead from a to b, over one empty cell each;
   *  a .     what a dropped part fills of it makes one of them the cheaper. */
  const Grid plane{{2, 2, 1}};
  for (const int full : {1, 2}) {
    SCOPED_TRACE(full);
    BodyParts body = loose_parts({{0, 1}, {3, 1}, {full, 0.9, /*kept=*/false}});
    EXPECT_EQ(join_pieces(plane, body), 1);
    EXPECT_EQ(body.parts.back().cell, full);
    EXPECT_EQ(body.parts.back().fill, 0.9);
    EXPECT_EQ(pieces_of(plane, body), 1);
  }
}

TEST(JoinPieces, MakesPartsOfOneCellOne) {
  const Grid one{{1, 1, 1}};
  BodyParts body = loose_parts({{0, 0.25}, {0, 0.5}});
  EXPECT_EQ(join_pieces(one, body), 0);
  const BodyCells cells = number_cells(one, body);
  EXPECT_EQ(cells.count(), 1);
  EXPECT_EQ(cells.fill[0], 0.75);
}

TEST(JoinPieces, DropsAPieceThatIsFartherAwayThanItIsLarge) {
  const Grid row{{9, 1, 1}};
  BodyParts body = loose_parts({{0, 1}, {1, 1}, {8, 0.5}});
  body.links.insert({0, 1, 0});
  EXPECT_EQ(join_pieces(row, body), 0);
  EXPECT_FALSE(body.parts[2].kept);
  EXPECT_TRUE(body.parts[0].kept && body.parts[1].kept);
}

}  // namespace
}  // namespace hydrostat::retarget::join_pieces_test
