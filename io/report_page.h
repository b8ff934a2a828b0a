#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "io/appearance.h"
#include "retarget/clip.h"
#include "retarget/contacts.h"
#include "retarget/control_mesh.h"
#include "retarget/morphs.h"
#include "retarget/motion.h"
#include "retarget/run_report.h"

namespace hydrostat::io {

/// Whose motion something on the page shows: gives it its name and colour there.
enum class PageRole { kClip, kTarget, kReplay, kOpenLoop, kNaive, kOther };

/// A motion in the page's view. Time 0 is the first frame of each; a loop goes on for as long as the page plays.
struct PageMotion {
  PageRole role = PageRole::kOther;
  bool of_skin = false;  // holds the skin's vertices (3V x F); otherwise the control nodes (3N x F)
  retarget::Motion motion;
  retarget::MovingMorphs morphs = {};  // that the skin wears in this motion alone
};

struct PageCurve {
  std::string name;
  PageRole role = PageRole::kOther;
  Eigen::VectorXd x, y;  // as many each; x ascends in a chart over time; a NaN in y is a gap
};

/// One diagram. Over time, x is seconds and the page's time cursor runs in it; otherwise it is a map with equal axes (COM
/// path).
struct PageChart {
  std::string title, x_label, y_label;  // labels with unit: "height [m]"
  bool over_time = true;
  std::vector<PageCurve> curves;
};

/// One row of the contact timeline: state s holds from s / rate_hz on. A loop starts again after its last.
struct PageContactRow {
  std::string patch;  // "left front foot"
  PageRole role = PageRole::kTarget;
  double rate_hz = 60;
  bool loop = false;
  std::vector<retarget::ContactState> states;
};

/// Something that stands in the body's way.
struct PageObstacle {
  Eigen::Matrix3Xd vertices;   // [m] 3 x V at the start
  Eigen::Matrix3Xi triangles;  // 3 x T
  retarget::Motion travel;     // 3 x F, from there
  bool is_endless = false;     // a piece of a half space's rim
};

struct PageInput {
  const retarget::RunReport& report;
  const retarget::SkinnedMesh& skin;
  const retarget::Embedding& embedding;  // of the skin's vertices in `body`
  const retarget::ControlMesh& body;
  std::vector<PageMotion> motions;  // at most one of each role; clip, target and replay are shown at the start
  std::vector<PageChart> charts;
  std::vector<PageContactRow> contacts;
  double ground_height = 0;  // [m] where x and z are 0
  bool has_ground = true;
  Eigen::Vector3d ground_normal = Eigen::Vector3d::UnitY();
  std::vector<PageObstacle> obstacles = {};
  std::string accuracy_svg = {};           // error against time of what was tried, where an accuracy was asked for
  const Appearance* appearance = nullptr;  // what the replay wears; null, or without parts: one colour
  const retarget::MovingMorphs* morphs = nullptr;  // worn by whatever the nodes move; null, or without targets: nothing
};

/// Writes one HTML file that needs nothing else, no network either: the view of the motions, the charts, the contact
/// timeline and the report's tables. Motions are thinned to at most 60 Hz (control nodes) and 30 Hz (skin), positions kept
/// to a 65535th of the largest extent. Images of the appearance come along up to 16 MiB in all. `#t=1.25&view=side&theme=dark` in its address sets time, view and theme. Throws Error
/// when the file cannot be written.
void write_report_page(const std::filesystem::path& path, const PageInput& input);

}  // namespace hydrostat::io
