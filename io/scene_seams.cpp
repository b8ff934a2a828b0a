#include "io/scene_seams.h"

#include <algorithm>

#include "io/scene_shapes.h"

namespace hydrostat::io {
namespace {

constexpr double kStrength = 0.1;  // over Young's modulus [-]

template <int Dim>
physics::SeamOf<Dim> read_seam(const TomlReader& table, double youngs_modulus) {
  physics::SeamOf<Dim> seam;
  const physics::VectorOf<Dim> normal = table.numbers("normal", Dim);
  if (normal.norm() == 0) throw table.refusal("normal", "'normal' has no direction", "Give one that is not zero.");
  seam.normal = normal.normalized();
  seam.offset = table.number_or("offset_m", 0, kPlace);
  if (table.has("box_m")) {
    const Eigen::MatrixXd corners = table.lists("box_m", Dim, kPlace);
    if (corners.cols() != 2) throw table.refusal("box_m", "'box_m' has not two corners", "Write it like box_m = [[low ...], [high ...]].");
    seam.low = corners.col(0);
    seam.high = corners.col(1);
  }
  seam.strength = table.number_or("strength_pa", kStrength * youngs_modulus, {.least = 0, .most = 1e15, .without_least = true});
  table.refuse_others();
  return seam;
}

}  // namespace

template <int Dim>
physics::FractureOf<Dim> read_seams(const TomlReader& root, const physics::ElementMesh<Dim>& mesh, BodyMaker<Dim> make_body,
                                    double youngs_modulus) {
  physics::FractureOf<Dim> fracture;
  const std::vector<TomlReader> tables = root.tables("seam");
  for (const TomlReader& table : tables) fracture.seams.push_back(read_seam<Dim>(table, youngs_modulus));
  fracture.mesh = mesh;
  fracture.faces = physics::find_seam_faces(mesh, fracture.seams);
  fracture.make_body = std::move(make_body);
  for (std::size_t s = 0; s < tables.size(); ++s) {
    const auto is_of_seam = [&](const physics::SeamFace& face) { return face.seam == static_cast<int>(s); };
    if (std::any_of(fracture.faces.begin(), fracture.faces.end(), is_of_seam)) continue;
    throw tables[s].refusal(tables[s].has("box_m") ? "box_m" : "normal", "the seam parts nothing of the body",
                            "Let its plane run between elements of the body, which unturned, in its own frame, reaches " +
                                extent_in_words<Dim>(mesh.rest) + "; of a part of it mark more than one element's width.");
  }
  return fracture;
}
template physics::FractureOf<2> read_seams<2>(const TomlReader&, const physics::ElementMesh<2>&, BodyMaker<2>, double);
template physics::FractureOf<3> read_seams<3>(const TomlReader&, const physics::ElementMesh<3>&, BodyMaker<3>, double);

}  // namespace hydrostat::io
