#pragma once

#include <filesystem>
#include <string>

#include "retarget/performance.h"

namespace hydrostat::io {

/// body.json, schema "hydrostat.body/1", in SI units; lists run over nodes, tets and so on in the order of the control mesh:
///   length_m (L), size_m (D), friction;
///   nodes [[x, y, z]] in the bind pose, mass_kg, bones (names), node_bones (the bone that owns a node most);
///   tets [[4 nodes]], rest_volume_m3, volume_stiffness_j;
///   edges [[2 nodes]], rest_length_m, edge_stiffness_n_m, edge_damping_n_s_m, edge_bones (bone regions);
///   where finite elements bear the stress: elements [[4 or 8 nodes]], element_fill, law, density_kg_m3, youngs_modulus_pa,
///   poissons_ratio;
///   muscles (names);
///   skin {vertices, triangles, nodes, weights}: vertex v stands at the sum of weights[v] times nodes[v];
///   contact_points {vertices, bones, nodes, weights}; patches [{name, points, on_leg}]: contact points that touch together; those on legs step.
/// Numbers come back to the bit.
std::string body_text(const retarget::Performer& performer, const std::vector<std::string>& bones,
                      const Eigen::VectorXi& node_bones);

/// The body in such a text: fills skin, embedding, mesh, contacts, scene, muscles (names and edge_bone), length and size; the rest
/// is left as it is. `file` is what messages call it. Throws Error for anything that is not of the form above.
void parse_body(const std::string& text, const std::string& file, retarget::Performer& performer);

}  // namespace hydrostat::io
