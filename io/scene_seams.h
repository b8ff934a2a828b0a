#pragma once

#include <functional>

#include "io/toml_reader.h"
#include "physics/seam.h"

namespace hydrostat::io {

template <int Dim>
using BodyMaker = std::function<physics::BodyOf<Dim>(const physics::ElementMesh<Dim>&)>;

/// What all [[seam]] of a scene mark in its mesh. A seam breaks at a tenth of Young's modulus [Pa] where it tells no strength.
/// Throws Error where a seam parts nothing of the body.
template <int Dim>
physics::FractureOf<Dim> read_seams(const TomlReader& root, const physics::ElementMesh<Dim>& mesh, BodyMaker<Dim> make_body,
                                    double youngs_modulus);

}  // namespace hydrostat::io
