#include "io/body_file.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "physics/element_body.h"
#include "retarget/body_material.h"
#include "retarget/error.h"

namespace hydrostat::io {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kBodySchema = "hydrostat.body/1";
constexpr const char* kMendBody = "Make the creature again with 'hydrostat convert'.";

/// A matrix as a list of its columns, a vector as a list.
template <typename Derived>
Json list(const Eigen::MatrixBase<Derived>& values) {
  Json columns = Json::array();
  for (Eigen::Index c = 0; c < values.cols(); ++c) {
    if constexpr (Derived::RowsAtCompileTime == Eigen::Dynamic) {
      for (Eigen::Index r = 0; r < values.rows(); ++r) columns.push_back(values(r, c));
    } else {
      Json column = Json::array();
      for (Eigen::Index r = 0; r < values.rows(); ++r) column.push_back(values(r, c));
      columns.push_back(std::move(column));
    }
  }
  return columns;
}

class BodyReader {
 public:
  BodyReader(const Json& json, std::string file) : json_(json), file_(std::move(file)) {}

  [[noreturn]] void refuse(const std::string& place, const std::string& what) const { throw Error(file_, place, what, kMendBody); }

  const Json& at(const Json& parent, const std::string& key) const {
    const auto found = parent.is_object() ? parent.find(key) : parent.end();
    if (!parent.is_object() || found == parent.end()) refuse("'" + key + "'", "is missing");
    return *found;
  }
  const Json& list_at(const Json& parent, const std::string& key) const {
    const Json& value = at(parent, key);
    if (!value.is_array()) refuse("'" + key + "'", "is no list");
    return value;
  }
  double number(const std::string& key) const {
    const Json& value = at(json_, key);
    if (!value.is_number() || !(value.get<double>() > 0)) refuse("'" + key + "'", "is no number above 0");
    return value;
  }
  std::vector<std::string> names(const std::string& key) const {
    std::vector<std::string> result;
    for (const Json& name : list_at(json_, key)) {
      if (!name.is_string()) refuse("'" + key + "'", "holds something that is no name");
      result.push_back(name);
    }
    return result;
  }

  /// A list of lists of `Rows` numbers each.
  template <typename Scalar, int Rows>
  Eigen::Matrix<Scalar, Rows, Eigen::Dynamic> columns(const Json& parent, const std::string& key) const {
    const Json& all = list_at(parent, key);
    Eigen::Matrix<Scalar, Rows, Eigen::Dynamic> result(Rows, static_cast<Eigen::Index>(all.size()));
    for (std::size_t c = 0; c < all.size(); ++c) {
      if (!all[c].is_array() || all[c].size() != Rows) refuse_entry(key, c, "has not " + std::to_string(Rows) + " numbers");
      for (int r = 0; r < Rows; ++r) {
        result(r, static_cast<Eigen::Index>(c)) = entry<Scalar>(all[c][static_cast<std::size_t>(r)], key, c);
      }
    }
    return result;
  }
  template <typename Scalar>
  Eigen::Matrix<Scalar, Eigen::Dynamic, 1> column(const Json& parent, const std::string& key, Eigen::Index count) const {
    const Json& all = list_at(parent, key);
    if (static_cast<Eigen::Index>(all.size()) != count) {
      refuse("'" + key + "'", "has " + std::to_string(all.size()) + " entries where " + std::to_string(count) + " belong");
    }
    Eigen::Matrix<Scalar, Eigen::Dynamic, 1> result(count);
    for (std::size_t i = 0; i < all.size(); ++i) result[static_cast<Eigen::Index>(i)] = entry<Scalar>(all[i], key, i);
    return result;
  }
  Eigen::VectorXd positive(const std::string& key, Eigen::Index count) const {
    const Eigen::VectorXd values = column<double>(json_, key, count);
    if (count > 0 && !(values.minCoeff() > 0)) refuse("'" + key + "'", "holds a number that is not above 0");
    return values;
  }
  template <typename Derived>
  void expect_indices(const Eigen::MatrixBase<Derived>& indices, Eigen::Index count, const std::string& key) const {
    if (indices.size() > 0 && (indices.minCoeff() < 0 || indices.maxCoeff() >= count)) {
      refuse("'" + key + "'", "points at something that does not exist");
    }
  }

 private:
  [[noreturn]] void refuse_entry(const std::string& key, std::size_t place, const std::string& what) const {
    refuse("'" + key + "', entry " + std::to_string(place), what);
  }
  template <typename Scalar>
  Scalar entry(const Json& value, const std::string& key, std::size_t place) const {
    if (std::is_integral_v<Scalar> ? !value.is_number_integer() : !value.is_number()) refuse_entry(key, place, "is no number");
    return value.get<Scalar>();
  }

  const Json& json_;
  std::string file_;
};

retarget::Embedding read_embedding(const BodyReader& reader, const Json& parent, Eigen::Index count, Eigen::Index nodes) {
  retarget::Embedding embedding;
  embedding.nodes = reader.columns<int, 4>(parent, "nodes");
  embedding.weights = reader.columns<double, 4>(parent, "weights");
  if (embedding.nodes.cols() != count || embedding.weights.cols() != count) reader.refuse("'weights'", "are not as many as the points");
  reader.expect_indices(embedding.nodes, nodes, "nodes");
  embedding.tets = Eigen::VectorXi::Constant(count, -1);  // the file does not tell them, but points are counted by them
  return embedding;
}

/// The edges 01 02 03 12 13 23 of each tet.
Eigen::Matrix<int, 6, Eigen::Dynamic> edges_of_tets(const BodyReader& reader, const Eigen::Matrix4Xi& tets, const Eigen::Matrix2Xi& edges) {
  std::map<std::pair<int, int>, int> place;
  for (int e = 0; e < edges.cols(); ++e) place[{edges(0, e), edges(1, e)}] = e;
  constexpr int kEnds[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};
  Eigen::Matrix<int, 6, Eigen::Dynamic> result(6, tets.cols());
  for (Eigen::Index t = 0; t < tets.cols(); ++t) {
    for (int k = 0; k < 6; ++k) {
      const auto ends = std::minmax(tets(kEnds[k][0], t), tets(kEnds[k][1], t));
      const auto found = place.find({ends.first, ends.second});
      if (found == place.end()) reader.refuse("'edges'", "lack an edge of tet " + std::to_string(t));
      result(k, t) = found->second;
    }
  }
  return result;
}

/// A creature's elements are of one material.
void put_elements(const physics::BodyElements<3>& elements, Json& json) {
  const physics::ElementMaterial& material = elements.materials.front();
  json["elements"] = Json::array();
  for (const auto nodes : elements.block.nodes.colwise())
    json["elements"].push_back(std::vector<int>(nodes.begin(), nodes.end()));
  json["element_fill"] = list(elements.fill);
  json["law"] = name_of(retarget::material_of(elements.block.law));
  json["density_kg_m3"] = material.density;
  json["youngs_modulus_pa"] = material.youngs_modulus;
  json["poissons_ratio"] = material.poissons_ratio;
}

physics::BodyElements<3> read_elements(const BodyReader& reader, const Json& json, const physics::Body& body) {
  physics::ElementMesh<3> mesh;
  mesh.rest = body.rest;
  const Json& all = reader.list_at(json, "elements");
  if (!all.empty() && all[0].size() == 8) {
    mesh.nodes = reader.columns<int, 8>(json, "elements");
  } else {
    mesh.nodes = reader.columns<int, 4>(json, "elements");
  }
  mesh.fill = reader.column<double>(json, "element_fill", mesh.nodes.cols());
  mesh.materials = {{reader.number("density_kg_m3"), reader.number("youngs_modulus_pa"), reader.number("poissons_ratio")}};
  const std::string broken = physics::broken_rule<3>(mesh);
  if (!broken.empty()) reader.refuse("'elements'", "break a rule: " + broken);
  if (physics::make_element_constraints(mesh.nodes).nodes != body.edges)
    reader.refuse("'edges'", "are not the pairs of nodes of the elements");
  const Json& law = reader.at(json, "law");
  for (const physics::ElasticLaw each : {physics::ElasticLaw::kStableNeoHookean, physics::ElasticLaw::kCorotatedLinear}) {
    if (law == name_of(retarget::material_of(each))) return physics::make_body_elements<3>(mesh, each);
  }
  reader.refuse("'law'", "is none that elements have");
}

}  // namespace

std::string body_text(const retarget::Performer& performer, const std::vector<std::string>& bones, const Eigen::VectorXi& node_bones) {
  const physics::Body& body = performer.scene.body;
  Json json;
  json["schema"] = kBodySchema;
  json["length_m"] = performer.length;
  json["size_m"] = performer.size;
  json["friction"] = performer.scene.ground.friction;
  json["bones"] = bones;
  json["nodes"] = list(performer.mesh.nodes);
  json["mass_kg"] = list(body.mass);
  json["node_bones"] = list(node_bones);
  json["tets"] = list(body.tets);
  json["rest_volume_m3"] = list(body.rest_volume);
  json["volume_stiffness_j"] = list(body.volume_stiffness);
  json["edges"] = list(body.edges);
  json["rest_length_m"] = list(body.rest_length);
  json["edge_stiffness_n_m"] = list(body.edge_stiffness);
  json["edge_damping_n_s_m"] = list(body.edge_damping);
  if (!body.elements.empty()) put_elements(body.elements.front(), json);
  json["edge_bones"] = performer.muscles.edge_bone;
  json["muscles"] = performer.muscles.names;
  json["skin"] = {{"vertices", list(performer.skin.vertices)},
                  {"triangles", list(performer.skin.triangles)},
                  {"nodes", list(performer.embedding.nodes)},
                  {"weights", list(performer.embedding.weights)}};
  json["contact_points"] = {{"vertices", list(performer.contacts.vertices)},
                            {"bones", list(performer.contacts.bones)},
                            {"nodes", list(performer.contacts.embedding.nodes)},
                            {"weights", list(performer.contacts.embedding.weights)}};
  json["patches"] = Json::array();
  for (const retarget::Patch& patch : performer.prepared.contacts.patches) {
    json["patches"].push_back({{"name", patch.name}, {"points", patch.points}, {"on_leg", patch.on_leg}});
  }
  std::string text;
  for (const auto& [key, value] : json.items()) {
    // A bone's name comes from a foreign file: bytes that are no UTF-8 become U+FFFD.
    text += (text.empty() ? "{\n" : ",\n") + Json(key).dump() + ": " + value.dump(-1, ' ', false, Json::error_handler_t::replace);
  }
  return text + "\n}\n";
}

void parse_body(const std::string& text, const std::string& file, retarget::Performer& performer) {
  const Json json = Json::parse(text, nullptr, /*allow_exceptions=*/false);
  const BodyReader reader(json, file);
  if (!json.is_object()) reader.refuse("", "is not JSON");
  if (reader.at(json, "schema") != kBodySchema) reader.refuse("'schema'", "is not '" + std::string(kBodySchema) + "'");
  physics::Body& body = performer.scene.body;
  performer.length = reader.number("length_m");
  performer.size = reader.number("size_m");
  performer.scene.ground.friction = reader.number("friction");
  body.rest = reader.columns<double, 3>(json, "nodes");
  body.mass = reader.positive("mass_kg", body.rest.cols());
  body.tets = reader.columns<int, 4>(json, "tets");
  reader.expect_indices(body.tets, body.rest.cols(), "tets");
  body.rest_volume = reader.positive("rest_volume_m3", body.tets.cols());
  const bool has_elements = json.contains("elements");
  body.volume_stiffness = reader.column<double>(json, "volume_stiffness_j", has_elements ? 0 : body.tets.cols());
  body.edges = reader.columns<int, 2>(json, "edges");
  reader.expect_indices(body.edges, body.rest.cols(), "edges");
  body.rest_length = reader.positive("rest_length_m", body.edges.cols());
  body.edge_stiffness = reader.column<double>(json, "edge_stiffness_n_m", body.edges.cols());
  body.edge_damping = reader.column<double>(json, "edge_damping_n_s_m", body.edges.cols());
  body.tet_edges = edges_of_tets(reader, body.tets, body.edges);
  body.elements.clear();
  if (has_elements) body.elements.push_back(read_elements(reader, json, body));
  performer.mesh.nodes = body.rest;
  performer.mesh.tets = body.tets;
  performer.mesh.edges = body.edges;
  performer.muscles.edge_bone = reader.names("edge_bones");
  performer.muscles.names = reader.names("muscles");
  if (static_cast<Eigen::Index>(performer.muscles.edge_bone.size()) != body.edges.cols()) {
    reader.refuse("'edge_bones'", "are not as many as the edges");
  }
  const Json& skin = reader.at(json, "skin");
  performer.skin.vertices = reader.columns<double, 3>(skin, "vertices");
  performer.skin.triangles = reader.columns<int, 3>(skin, "triangles");
  reader.expect_indices(performer.skin.triangles, performer.skin.vertices.cols(), "triangles");
  performer.embedding = read_embedding(reader, skin, performer.skin.vertices.cols(), body.rest.cols());
  const Json& contacts = reader.at(json, "contact_points");
  const Json& vertices = reader.list_at(contacts, "vertices");
  const auto points = static_cast<Eigen::Index>(vertices.size());
  performer.contacts.vertices = reader.column<int>(contacts, "vertices", points);
  performer.contacts.bones = reader.column<int>(contacts, "bones", points);
  performer.contacts.embedding = read_embedding(reader, contacts, points, body.rest.cols());
  performer.scene.contact_points = {performer.contacts.embedding.nodes, performer.contacts.embedding.weights};
}

}  // namespace hydrostat::io
