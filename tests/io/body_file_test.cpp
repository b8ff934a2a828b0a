#include "io/body_file.h"

#include <gtest/gtest.h>

#include "tests/io/refusal.h"
#include "tests/retarget/box_performer.h"

namespace hydrostat::io {
namespace {

std::string text_of(const retarget::Performer& performer) {
  return body_text(performer, {"trunk", "leg"}, Eigen::VectorXi::Zero(performer.scene.body.node_count()));
}

TEST(BodyFile, GivesTheBodyBackToTheBit) {
  const retarget::Performer performer = retarget::make_box_performer();
  retarget::Performer read;
  parse_body(text_of(performer), "body.json", read);
  const physics::Body &a = performer.scene.body, &b = read.scene.body;
  EXPECT_EQ(a.rest, b.rest);
  EXPECT_EQ(a.mass, b.mass);
  EXPECT_EQ(a.edges, b.edges);
  EXPECT_EQ(a.rest_length, b.rest_length);
  EXPECT_EQ(a.edge_stiffness, b.edge_stiffness);
  EXPECT_EQ(a.edge_damping, b.edge_damping);
  EXPECT_EQ(a.tets, b.tets);
  EXPECT_EQ(a.tet_edges, b.tet_edges);
  EXPECT_EQ(a.rest_volume, b.rest_volume);
  EXPECT_EQ(a.volume_stiffness, b.volume_stiffness);
  EXPECT_EQ(performer.scene.contact_points.nodes, read.scene.contact_points.nodes);
  EXPECT_EQ(performer.scene.contact_points.weights, read.scene.contact_points.weights);
  EXPECT_EQ(performer.scene.ground.friction, read.scene.ground.friction);
  EXPECT_EQ(performer.skin.vertices, read.skin.vertices);
  EXPECT_EQ(performer.skin.triangles, read.skin.triangles);
  EXPECT_EQ(performer.embedding.nodes, read.embedding.nodes);
  EXPECT_EQ(performer.muscles.names, read.muscles.names);
  EXPECT_EQ(performer.muscles.edge_bone, read.muscles.edge_bone);
  EXPECT_EQ(performer.length, read.length);
  EXPECT_EQ(performer.size, read.size);
}

TEST(BodyFile, RefusesATextThatIsCutShort) {
  const std::string text = text_of(retarget::make_box_performer());
  for (const double share : {0.0, 0.3, 0.9, 0.999}) {
    retarget::Performer read;
    EXPECT_THROW(parse_body(text.substr(0, static_cast<std::size_t>(share * static_cast<double>(text.size()))), "body.json", read), Error);
  }
}

}  // namespace
}  // namespace hydrostat::io
