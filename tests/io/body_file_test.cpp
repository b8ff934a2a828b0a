#include "io/body_file.h"

#include <gtest/gtest.h>

#include "tests/io/refusal.h"
#include "tests/retarget/box_performer.h"

namespace hydrostat::io::body_file_test {
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
  EXPECT_EQ(read.embedding.count(), performer.embedding.nodes.cols());
  EXPECT_EQ(performer.muscles.names, read.muscles.names);
  EXPECT_EQ(performer.muscles.edge_bone, read.muscles.edge_bone);
  EXPECT_EQ(performer.length, read.length);
  EXPECT_EQ(performer.size, read.size);
}

TEST(BodyFile, GivesElementsBackToTheBit) {
  for (const retarget::BoxCreature& creature : retarget::element_box_creatures()) {
    const retarget::Performer performer = retarget::make_box_performer(3, creature);
    retarget::Performer read;
    parse_body(text_of(performer), "body.json", read);
    const physics::Body &a = performer.scene.body, &b = read.scene.body;
    EXPECT_EQ(a.edges, b.edges);
    EXPECT_EQ(a.tet_edges, b.tet_edges);
    ASSERT_EQ(b.elements.size(), 1U);
    EXPECT_EQ(a.elements[0].block.nodes, b.elements[0].block.nodes);
    EXPECT_EQ(a.elements[0].block.law, b.elements[0].block.law);
    physics::PointsOf<3> force = physics::PointsOf<3>::Zero(3, a.node_count()), same = force;
    const physics::PointsOf<3> x = Eigen::Vector3d(1.1, 0.95, 1.02).asDiagonal() * a.rest;
    physics::InternalForces<3>(a).add_elastic_forces(x, force);
    physics::InternalForces<3>(b).add_elastic_forces(x, same);
    EXPECT_EQ(force, same);
  }
}

TEST(BodyFile, RefusesElementsThatAreNone) {
  const std::string text = text_of(retarget::make_box_performer(3, retarget::make_element_box_creature(true)));
  const auto refusal_of = [&](const std::string& from, const std::string& to) {
    std::string damaged = text;
    const std::size_t at = damaged.find(from);
    EXPECT_NE(at, std::string::npos);
    damaged.replace(at, from.size(), to);
    retarget::Performer read;
    try {
      parse_body(damaged, "body.json", read);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("nothing");
  };
  EXPECT_EQ(refusal_of("stable_neo_hookean", "jelly"), "is none that elements have");
  EXPECT_EQ(refusal_of("\"poissons_ratio\": 0.4", "\"poissons_ratio\": 0.5").find("break a rule: material 0"), 0U);
  EXPECT_EQ(refusal_of("\"element_fill\": [1.0", "\"element_fill\": [2.0").find("break a rule: element 0"), 0U);
}

TEST(BodyFile, RefusesATextThatIsCutShort) {
  const std::string text = text_of(retarget::make_box_performer());
  for (const double share : {0.0, 0.3, 0.9, 0.999}) {
    retarget::Performer read;
    EXPECT_THROW(parse_body(text.substr(0, static_cast<std::size_t>(share * static_cast<double>(text.size()))), "body.json", read), Error);
  }
}

}  // namespace
}  // namespace hydrostat::io::body_file_test
