#pragma once

#include <string>
#include <vector>

namespace hydrostat::stability {

/// One hard scene at one size, with one kind of body and one method.
struct Case {
  std::string group;   // a row of README's table
  std::string name;    // what is told apart in a group, such as "dt_1_60"
  std::string body;    // "springs", "tets" or "hexes"; in the plane "flat springs", "triangles" or "quads"
  std::string method;  // as README names it
  int nodes;           // wished
  std::string scene;   // a scene file (README, "Scene files")
  std::string mesh = {};        // what its mesh file holds, where it has one
  bool is_refused = false;      // the scene is broken: reading it must say so
  bool is_told = false;         // the scene is mended: reading it must say so
  bool is_in_flight = false;    // touches nothing: angular momentum counts
  double least_creep_m_s = -1;  // where above 0: the body stands, and its middle may creep so fast at most
  bool is_in_slice = false;     // belongs to the short run

  std::string mesh_name() const { return name + "_" + body + "_" + method + "_" + std::to_string(nodes) + ".obj"; }
  std::string key() const { return group + "," + name + "," + body + "," + method + "," + std::to_string(nodes); }
};

std::vector<Case> all_cases();

}  // namespace hydrostat::stability
