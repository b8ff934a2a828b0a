#include <array>
#include <cstdio>
#include <functional>
#include <sstream>
#include <utility>

#include "tests/stability/stability_case.h"

// The scenes of the suite, as their files tell them. Each is a bar of 1 x 0.25 x 0.25 m unless it says otherwise, as stiff
// as a creature of its size is by default (it sags under its own weight by about half a percent).

namespace hydrostat::stability {
namespace {

constexpr const char* kMethods[] = {"explicit", "implicit", "euler"};
constexpr const char* kBodies[] = {"springs", "tets", "hexes"};
constexpr const char* kFlatBodies[] = {"flat springs", "triangles", "quads"};
constexpr int kSizes[] = {81, 325};

struct Hard {
  std::string group, name;
  std::string top;        // keys of the scene itself, such as dt_s
  std::string body;       // further keys of [body]
  std::string material;   // further keys of [material]
  std::string rest;       // tables behind
  std::string size = "[1.0, 0.25, 0.25]";
  bool is_in_flight = false;
  double least_creep_m_s = -1;
  bool is_in_slice = false;
  bool is_flat_too = false;  // in the plane as well
  std::string left_out = {};  // the method that the short run does without: it takes long there
  bool is_refused = false;
  std::string mesh = {};  // of shape "mesh", which no lattice of hexahedra has
};

std::string number(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", value);
  const std::string found = text;
  return found.find_first_of(".en") == std::string::npos ? found + ".0" : found;
}

/// The scene in the plane: of vectors the first two numbers, of turns that about z.
std::string flattened(const std::string& text) {
  std::istringstream lines(text);
  std::string flat = "dimension = 2\n", line;
  while (std::getline(lines, line)) {
    const std::size_t open = line.find(" = ["), first = line.find(','), second = line.find(',', first + 1), close = line.find(']');
    if (open != std::string::npos && second != std::string::npos) {
      const bool is_turn = line.starts_with("rotation_deg") || line.starts_with("spin_deg_s");
      line = is_turn ? line.substr(0, open + 3) + line.substr(second + 2, close - second - 2) : line.substr(0, second) + "]";
    }
    flat += line + "\n";
  }
  return flat;
}

/// A TOML of a scene: tables in the order that a reader would look for them.
std::string scene_text(const Hard& hard, const std::string& body, const std::string& method, int nodes, const std::string& mesh_name) {
  const std::string shape = hard.mesh.empty() ? "shape = \"bar\"\nsize_m = " + hard.size : "shape = \"mesh\"\nfile = \"" + mesh_name + "\"";
  std::string text = "method = \"" + method + "\"\n" + hard.top + "\n[body]\n" + shape + "\nnodes = " + std::to_string(nodes) + "\n";
  if (body == "hexes") text += "element = \"hex\"\n";
  if (body == "quads") text += "element = \"quad\"\n";
  text += hard.body + "\n[material]\n";
  const bool is_of_springs = body == kBodies[0] || body == kFlatBodies[0];
  if (!is_of_springs) text += "law = \"stable_neo_hookean\"\n";
  return text + hard.material + hard.rest;
}

const std::string kGround = "\n[ground]\nfriction = 0.5\n";

std::string with_duration(double seconds) { return "duration_s = " + number(seconds) + "\n"; }

void add_broken_starts(std::vector<Hard>& list) {
  for (const char* start : {"random", "collapsed", "flattened"}) {
    for (int seed = 1; seed <= 2; ++seed) {
      Hard hard;
      hard.group = std::string(start) + " start";
      hard.name = "seed_" + std::to_string(seed);
      hard.top = with_duration(3) + "seed = " + std::to_string(seed) + "\ngravity_m_s2 = [0.0, 0.0, 0.0]\n";
      hard.body = std::string("start = \"") + start + "\"\n";
      hard.material = "youngs_modulus_pa = 5e5\n";
      hard.is_in_slice = hard.is_flat_too = seed == 1;
      list.push_back(hard);
    }
  }
}

void add_materials(std::vector<Hard>& list) {
  const std::string drop = "gap_m = 0.1\nrotation_deg = [0.0, 0.0, 20.0]\n";
  const auto add = [&](const char* group, const char* name, const char* material, const char* region) {
    Hard hard;
    hard.group = group;
    hard.name = name;
    hard.top = with_duration(3);
    hard.body = drop;
    hard.material = material;
    if (*region != '\0') hard.rest = std::string("\n[[region]]\n") + region;
    hard.rest += kGround;
    hard.is_in_slice = hard.is_flat_too = std::string(name) != "lighter_end";
    list.push_back(hard);
  };
  add("mass ratio 1000:1", "heavy_above", "density_kg_m3 = 10.0\n", "normal = [0.0, 1.0, 0.0]\noffset_m = 0.0\ndensity_kg_m3 = 10000.0\n");
  list.back().left_out = "explicit";
  add("mass ratio 1000:1", "lighter_end", "density_kg_m3 = 1000.0\n", "normal = [1.0, 0.0, 0.0]\noffset_m = 0.0\ndensity_kg_m3 = 1.0\n");
  add("stiffness ratio 1000:1", "stiff_end", "youngs_modulus_pa = 5e5\n",
      "normal = [1.0, 0.0, 0.0]\noffset_m = 0.0\nyoungs_modulus_pa = 5e8\n");
  add("Poisson's ratio 0.499", "drop", "poissons_ratio = 0.499\n", "");
}

void add_steps_and_drops(std::vector<Hard>& list) {
  for (const auto& [name, dt] : {std::pair{"dt_1_960", 1.0 / 960}, {"dt_1_240", 1.0 / 240}, {"dt_1_60", 1.0 / 60}, {"dt_1_15", 1.0 / 15}}) {
    Hard hard;
    hard.group = "steps of 1/960 to 1/15 s";
    hard.name = name;
    hard.top = with_duration(3) + "dt_s = " + number(dt) + "\n";
    hard.body = "gap_m = 0.3\nrotation_deg = [0.0, 0.0, 20.0]\nvelocity_m_s = [1.0, 0.0, 0.0]\n";
    hard.rest = kGround;
    hard.is_in_slice = hard.is_flat_too = dt > 0.05;
    list.push_back(hard);
  }
  Hard hard;
  hard.group = "drop from ten body heights";
  hard.name = "drop";
  hard.top = with_duration(4);
  hard.body = "gap_m = 2.5\nrotation_deg = [0.0, 0.0, 20.0]\n";
  hard.rest = kGround;
  hard.is_in_slice = true;
  list.push_back(hard);
}

void add_long_rest(std::vector<Hard>& list) {
  for (const auto& [name, seconds] : {std::pair{"ten_seconds", 10.0}, {"ten_minutes", 600.0}}) {
    Hard hard;
    hard.group = "at rest on a slope of 20 degrees";
    hard.name = name;
    hard.top = with_duration(seconds);
    hard.body = "gap_m = 0.0\nrotation_deg = [0.0, 0.0, 20.0]\n";
    hard.rest = "\n[ground]\nfriction = 0.5\nslope_deg = 20.0\n";
    hard.least_creep_m_s = 0.0005;
    hard.is_in_slice = hard.is_flat_too = seconds < 60;
    list.push_back(hard);
  }
}

void add_activations(std::vector<Hard>& list) {
  const auto add = [&](const char* group, const std::string& name, const std::string& wave, bool in_slice) {
    Hard hard;
    hard.group = group;
    hard.name = name;
    hard.top = with_duration(4);
    hard.body = "gap_m = 0.0\n";
    hard.rest = kGround + "\n[[activation]]\nuntil_s = 2.0\n" + wave;
    hard.is_in_slice = in_slice;
    hard.is_flat_too = name == "all";
    list.push_back(hard);
  };
  // A sample of 1/240 s falls on the middle of each half wave of 120 Hz.
  add("activation from limit to limit at every step", "all", "amplitude = 0.4\nfrequency_hz = 120.0\nwaveform = \"square\"\n", true);
  list.back().left_out = "euler";
  add("activation from limit to limit at every step", "travelling",
      "amplitude = 0.4\nfrequency_hz = 60.0\nwaveform = \"square\"\nwave_direction = [1.0, 0.0, 0.0]\nwavelength_m = 0.5\n", false);
  for (const int hertz : {1, 5, 20}) {
    add("contraction by 20 % at 1 to 20 Hz", "hertz_" + std::to_string(hertz),
        "amplitude = 0.1\noffset = -0.1\naxis = [1.0, 0.0, 0.0]\nnormal = [0.0, 1.0, 0.0]\noffset_m = 0.0\nfrequency_hz = " +
            number(hertz) + "\n",
        hertz == 20);
  }
}

void add_contacts(std::vector<Hard>& list) {
  Hard squeeze;
  squeeze.group = "squeezed to 30 % of its height and released";
  squeeze.name = "plates";
  squeeze.top = with_duration(4);
  squeeze.size = "[0.3, 0.3, 0.3]";
  squeeze.body = "gap_m = 0.0\n";
  squeeze.material = "youngs_modulus_pa = 5e5\n";
  squeeze.rest = kGround +
                 "\n[[obstacle]]\nshape = \"half_space\"\nrotation_deg = [0.0, 0.0, 180.0]\nposition_m = [0.0, 0.3, 0.0]\nfriction = 0.5\n"
                 "\n[[obstacle.move]]\nvelocity_m_s = [0.0, -0.21, 0.0]\nuntil_s = 1.0\n"
                 "\n[[obstacle.move]]\nvelocity_m_s = [0.0, 1.0, 0.0]\nfrom_s = 1.5\nuntil_s = 1.9\n";
  squeeze.is_in_slice = squeeze.is_flat_too = true;
  list.push_back(squeeze);

  const auto add = [&](const char* group, const char* name, const char* body, const std::string& rest) {
    Hard hard;
    hard.group = group;
    hard.name = name;
    hard.top = with_duration(4);
    hard.body = body;
    hard.rest = rest;
    hard.is_in_slice = std::string(name) != "in_box";
    hard.is_flat_too = std::string(name) != "in_box" && std::string(name) != "corner";
    list.push_back(hard);
  };
  add("deep in an obstacle at the start", "in_ground", "gap_m = -0.125\n", kGround);
  // 40 % of the body's height lie in it.
  add("deep in an obstacle at the start", "in_box", "gap_m = 0.1\n",
      kGround + "\n[[obstacle]]\nshape = \"box\"\nsize_m = [0.4, 0.2, 0.6]\nposition_m = [0.45, 0.1, 0.0]\n");
  add("deep in an obstacle at the start", "swallowed", "position_m = [0.0, 0.35, 0.0]\n",
      kGround + "\n[[obstacle]]\nshape = \"box\"\nsize_m = [1.6, 0.8, 0.8]\nposition_m = [0.1, 0.4, 0.0]\n");
  add("an obstacle's edge inside one element", "edge", "gap_m = 0.25\nposition_m = [0.02, 0.0, 0.02]\n",
      kGround + "\n[[obstacle]]\nshape = \"box\"\nsize_m = [0.05, 0.05, 1.0]\nrotation_deg = [0.0, 0.0, 45.0]\nposition_m = [0.0, 0.15, 0.0]\n");
  add("an obstacle's edge inside one element", "corner", "gap_m = 0.25\nposition_m = [0.03, 0.0, 0.05]\n",
      kGround + "\n[[obstacle]]\nshape = \"box\"\nsize_m = [0.06, 0.06, 0.06]\nrotation_deg = [35.264, 0.0, 45.0]\nposition_m = [0.0, 0.15, 0.0]\n");
}

void add_scales(std::vector<Hard>& list) {
  for (const auto& [name, length] : {std::pair{"one_millimetre", 0.001}, {"one_centimetre", 0.01}, {"ten_metres", 10.0}, {"hundred_metres", 100.0}}) {
    Hard hard;
    hard.group = "bodies of 1 mm to 100 m";
    hard.name = name;
    hard.top = with_duration(length < 1 ? 1 : 10);
    hard.size = "[" + number(length) + ", " + number(0.25 * length) + ", " + number(0.25 * length) + "]";
    hard.body = "gap_m = " + number(0.3 * length) + "\nrotation_deg = [0.0, 0.0, 20.0]\n";
    hard.material = "youngs_modulus_pa = " + number(2e6 * length) + "\n";
    hard.rest = kGround;
    hard.is_in_slice = length < 0.005 || length > 50;
    list.push_back(hard);
  }
  Hard far;
  far.group = "10 km from the origin";
  far.name = "drop";
  far.top = with_duration(3);
  far.body = "position_m = [10000.0, 0.4, -7000.0]\nrotation_deg = [0.0, 0.0, 20.0]\n";
  far.rest = kGround;
  far.is_in_slice = true;
  list.push_back(far);
}

void add_flights(std::vector<Hard>& list) {
  Hard hard;
  hard.group = "tumbling in free flight";
  hard.name = "tumble";
  hard.top = with_duration(2) + "gravity_m_s2 = [0.0, 0.0, 0.0]\n";
  hard.body = "spin_deg_s = [343.8, 171.9, 229.2]\n";
  hard.material = "youngs_modulus_pa = 5e5\ndamping_time_s = 0.0\n";
  hard.is_in_flight = true;
  hard.is_in_slice = hard.is_flat_too = true;
  list.push_back(hard);
}

/// A bar's surface but for one triangle: between an edge and its middle, without area, or between two vertices that are nearly one.
void add_slivers(std::vector<Hard>& list) {
  const std::string vertices =
      "v -0.5 -0.125 -0.125\nv 0.5 -0.125 -0.125\nv 0.5 0.125 -0.125\nv -0.5 0.125 -0.125\nv -0.5 -0.125 0.125\nv 0.5 -0.125 0.125\n"
      "v 0.5 0.125 0.125\nv -0.5 0.125 0.125\nv 0 0.125 -0.125\nv 0.5 0.125 0.125000001\n";
  const std::string faces = "f 1 3 2\nf 5 6 7\nf 5 7 8\nf 1 2 6\nf 1 6 5\nf 4 8 7\nf 4 7 3\nf 1 5 8\nf 1 8 4\nf 2 7 6\n";
  const auto add = [&](const char* name, const std::string& rest, bool is_refused) {
    Hard hard;
    hard.group = "slivers and elements without volume";
    hard.name = name;
    hard.top = with_duration(2);
    hard.body = "gap_m = 0.1\n";
    hard.rest = kGround;
    hard.mesh = vertices + faces + rest;
    hard.is_refused = is_refused;
    hard.is_in_slice = true;
    list.push_back(hard);
  };
  add("sliver", "f 1 4 9\nf 1 9 3\nf 4 3 9\nf 2 3 7\n", true);
  add("needle", "f 1 4 3\nf 2 3 10\nf 3 7 10\n", false);
}

void add_broken_bodies(std::vector<Hard>& list) {
  const auto add = [&](const char* name, const char* size, const char* material) {
    Hard hard;
    hard.group = "slivers and elements without volume";
    hard.name = name;
    hard.size = size;
    hard.material = material;
    hard.rest = kGround;
    hard.is_refused = true;
    hard.is_in_slice = true;
    list.push_back(hard);
  };
  add("no_height", "[1.0, 0.0, 0.25]", "");
  add("sheet", "[1.0, 1e-7, 0.25]", "");
  add("massless", "[1.0, 0.25, 0.25]", "density_kg_m3 = 0.0\n");
  add_slivers(list);
}

}  // namespace

std::vector<Case> all_cases() {
  std::vector<Hard> list;
  add_broken_starts(list);
  add_materials(list);
  add_steps_and_drops(list);
  add_long_rest(list);
  add_activations(list);
  add_contacts(list);
  add_scales(list);
  add_flights(list);
  add_broken_bodies(list);
  std::vector<Case> cases;
  const auto add = [&](const Hard& hard, const std::string& body, bool is_flat, int nodes) {
    for (const char* method : kMethods) {
      Case one{hard.group, hard.name, body, method, nodes, {}};
      one.scene = scene_text(hard, body, method, nodes, one.mesh_name());
      if (is_flat) one.scene = flattened(one.scene);
      one.mesh = hard.mesh;
      one.is_told = !hard.mesh.empty() && !hard.is_refused;
      one.is_refused = hard.is_refused;
      one.is_in_flight = hard.is_in_flight;
      one.least_creep_m_s = hard.least_creep_m_s;
      one.is_in_slice = hard.is_in_slice && nodes == kSizes[0] && method != hard.left_out;
      cases.push_back(one);
    }
  };
  for (const Hard& hard : list) {
    for (const int nodes : kSizes) {
      for (const std::string body : kBodies) {
        if (hard.mesh.empty() || body != "hexes") add(hard, body, false, nodes);
      }
      for (const std::string body : kFlatBodies) {
        if (hard.is_flat_too) add(hard, body, true, nodes);
      }
    }
  }
  return cases;
}

}  // namespace hydrostat::stability
