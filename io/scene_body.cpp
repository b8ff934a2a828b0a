#include "io/scene_body.h"

#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>

#include "retarget/body_material.h"

namespace hydrostat::io {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kThickness = 0.1;  // of a 2D body, per L [-]

Json list(const Eigen::VectorXd& values) { return std::vector<double>(values.begin(), values.end()); }

/// The columns of a matrix.
template <typename Scalar, int Rows>
Json list(const Eigen::Matrix<Scalar, Rows, Eigen::Dynamic>& values) {
  Json all = Json::array();
  for (const auto& column : values.colwise()) all.push_back(std::vector<Scalar>(column.begin(), column.end()));
  return all;
}

/// A number, or where the elements differ in it one each.
Json of_materials(const std::vector<physics::ElementMaterial>& materials, double physics::ElementMaterial::*number) {
  std::vector<double> all;
  for (const physics::ElementMaterial& material : materials) all.push_back(material.*number);
  if (std::adjacent_find(all.begin(), all.end(), std::not_equal_to<>()) == all.end()) return all.front();
  return all;
}

/// As a creature's body file has them (body_file.h).
template <int Dim>
void put_elements(const physics::BodyElements<Dim>& elements, Json& json) {
  json["elements"] = Json::array();
  for (const auto nodes : elements.block.nodes.colwise()) json["elements"].push_back(std::vector<int>(nodes.begin(), nodes.end()));
  json["element_fill"] = list(elements.fill);
  json["law"] = name_of(retarget::material_of(elements.block.law));
  json["density_kg_m3"] = of_materials(elements.materials, &physics::ElementMaterial::density);
  json["youngs_modulus_pa"] = of_materials(elements.materials, &physics::ElementMaterial::youngs_modulus);
  json["poissons_ratio"] = of_materials(elements.materials, &physics::ElementMaterial::poissons_ratio);
}

/// Contact points are nodes of the surface: the one of greatest weight.
template <int Dim>
int node_of(const physics::ContactPointsOf<Dim>& points, int p) {
  Eigen::Index k;
  points.weights.col(p).maxCoeff(&k);
  return points.nodes(k, p);
}

/// An embedding that hangs every vertex on one node alone.
retarget::Embedding on_nodes(const Eigen::VectorXi& node_of_vertex) {
  retarget::Embedding embedding;
  embedding.tets = Eigen::VectorXi::Zero(node_of_vertex.size());
  embedding.nodes = node_of_vertex.transpose().replicate<4, 1>();
  embedding.weights = Eigen::Matrix4Xd::Zero(4, node_of_vertex.size());
  embedding.weights.row(0).setOnes();
  return embedding;
}

/// The surface's triangles between nodes of the slab: front, back and rim have vertices of their own, so that edges look sharp.
Eigen::Matrix3Xi slab_skin(const retarget::ScenarioOf<2>& scenario, Eigen::VectorXi& node_of_vertex) {
  const physics::BodyOf<2>& body = scenario.scene.body;
  const int n = body.node_count();
  const auto sides = scenario.scene.contact_faces.cols();
  node_of_vertex.resize(2 * n + 4 * sides);
  node_of_vertex.head(2 * n).setLinSpaced(0, 2 * n - 1);
  Eigen::Matrix3Xi triangles(3, 2 * body.tet_count() + 2 * sides);
  Eigen::Index t = 0;
  for (int s = 0; s < body.tet_count(); ++s) {
    const Eigen::Vector3i corners = body.tets.col(s);
    triangles.col(t++) = corners;
    triangles.col(t++) << corners[0] + n, corners[2] + n, corners[1] + n;
  }
  for (Eigen::Index f = 0; f < sides; ++f) {
    const int from = node_of(scenario.scene.contact_points, scenario.scene.contact_faces(0, f));
    const int to = node_of(scenario.scene.contact_points, scenario.scene.contact_faces(1, f));
    const int v = 2 * n + 4 * static_cast<int>(f);
    node_of_vertex.segment(v, 4) << from, to, from + n, to + n;
    triangles.col(t++) << v, v + 2, v + 1;
    triangles.col(t++) << v + 1, v + 2, v + 3;
  }
  return triangles;
}

}  // namespace

template <int Dim>
retarget::Motion shown_motion(const retarget::ScenarioOf<Dim>& scenario, const retarget::Motion& motion) {
  if constexpr (Dim == 3) {
    return motion;
  } else {
    retarget::Motion shown = motion;
    shown.frames = motion.frames.replicate<2, 1>();
    const Eigen::Index entries = motion.frames.rows();
    for (Eigen::Index r = 2; r < entries; r += 3) {
      shown.frames.row(r).array() += kThickness / 2 * scenario.length;
      shown.frames.row(entries + r).array() -= kThickness / 2 * scenario.length;
    }
    return shown;
  }
}

template <int Dim>
ShownBody shown_body(const retarget::ScenarioOf<Dim>& scenario) {
  const physics::SceneOf<Dim>& scene = scenario.scene;
  const physics::BodyOf<Dim>& body = scene.body;
  ShownBody shown;
  Eigen::VectorXi node_of_vertex;
  if constexpr (Dim == 3) {
    shown.mesh.nodes = body.rest;
    shown.mesh.tets = body.tets;
    shown.mass = body.mass;
    node_of_vertex.resize(scene.contact_points.count());
    for (int p = 0; p < scene.contact_points.count(); ++p) node_of_vertex[p] = node_of(scene.contact_points, p);
    shown.skin.triangles = scene.contact_faces;
  } else {
    retarget::Motion rest;
    rest.frames = Eigen::MatrixXd::Zero(3 * body.node_count(), 1);
    rest.at(0).template topRows<2>() = body.rest;
    shown.mesh.nodes = shown_motion(scenario, rest).at(0);
    shown.mesh.tets.resize(4, 0);
    shown.mass = body.mass.template replicate<2, 1>() / 2;
    shown.skin.triangles = slab_skin(scenario, node_of_vertex);
  }
  shown.mesh.edges = body.edges;
  shown.skin.vertices = shown.mesh.nodes(Eigen::all, node_of_vertex);
  shown.embedding = on_nodes(node_of_vertex);
  return shown;
}

template <int Dim>
std::string scene_body_text(const retarget::ScenarioOf<Dim>& scenario) {
  const physics::SceneOf<Dim>& scene = scenario.scene;
  const physics::BodyOf<Dim>& body = scene.body;
  Eigen::Matrix3Xd nodes = Eigen::Matrix3Xd::Zero(3, body.node_count());
  nodes.template topRows<Dim>() = body.rest.colwise() + scenario.origin;
  Json json;
  json["schema"] = "hydrostat.body/1";
  json["dimension"] = Dim;
  json["length_m"] = scenario.length;
  json["size_m"] = scenario.size;
  json["friction"] = scene.has_ground ? scene.ground.friction : 0.0;
  json["nodes"] = list(nodes);
  json["mass_kg"] = list(body.mass);
  json[Dim == 3 ? "tets" : "triangles"] = list(body.tets);
  json["rest_volume_m3"] = list(body.rest_volume);
  json["volume_stiffness_j"] = list(body.volume_stiffness);
  json["edges"] = list(body.edges);
  json["rest_length_m"] = list(body.rest_length);
  json["edge_stiffness_n_m"] = list(body.edge_stiffness);
  json["edge_damping_n_s_m"] = list(body.edge_damping);
  if (!body.elements.empty()) put_elements(body.elements.front(), json);
  json["contact_points"] = {{"nodes", list(scene.contact_points.nodes)},
                            {"weights", list(scene.contact_points.weights)},
                            {"faces", list(scene.contact_faces)}};
  return json.dump() + "\n";
}

#define HYDROSTAT_INSTANTIATE(Dim)                                                                                    \
  template ShownBody shown_body<Dim>(const retarget::ScenarioOf<Dim>&);                                               \
  template retarget::Motion shown_motion<Dim>(const retarget::ScenarioOf<Dim>&, const retarget::Motion&);             \
  template std::string scene_body_text<Dim>(const retarget::ScenarioOf<Dim>&);
HYDROSTAT_INSTANTIATE(2)
HYDROSTAT_INSTANTIATE(3)
#undef HYDROSTAT_INSTANTIATE

}  // namespace hydrostat::io
