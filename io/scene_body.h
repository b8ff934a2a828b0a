#pragma once

#include <string>

#include "retarget/clip.h"
#include "retarget/control_mesh.h"
#include "retarget/motion.h"
#include "retarget/scenario.h"

namespace hydrostat::io {

/// A scene's body as files and page show it: its own surface as skin. In 2D it is a slab, a tenth of L thick, with a node in
/// front of and one behind every node of the body.
struct ShownBody {
  retarget::ControlMesh mesh;      // nodes, tets (none in 2D) and edges, where the rest shape is placed
  retarget::SkinnedMesh skin;      // without weights
  retarget::Embedding embedding;   // of the skin's vertices in `mesh`
  Eigen::VectorXd mass;            // [kg] of the nodes shown
};
template <int Dim>
ShownBody shown_body(const retarget::ScenarioOf<Dim>& scenario);

/// The motion of the nodes shown, from that of the body's (3N x F).
template <int Dim>
retarget::Motion shown_motion(const retarget::ScenarioOf<Dim>& scenario, const retarget::Motion& motion);

/// body.json of a scene's body, schema "hydrostat.body/1", with `dimension`; without bones and muscles. In 2D nodes have z = 0 and
/// `triangles` stand in the place of `tets`.
template <int Dim>
std::string scene_body_text(const retarget::ScenarioOf<Dim>& scenario);

}  // namespace hydrostat::io
