#pragma once

#include <functional>
#include <vector>

#include "retarget/corrector.h"
#include "retarget/observer.h"
#include "retarget/prepare.h"
#include "retarget/push.h"
#include "retarget/run_report.h"
#include "retarget/scenario.h"
#include "retarget/trace.h"

namespace hydrostat::retarget {

class CostSource;
class ModelAnswers;
struct Lesson;
struct NominalPath;

struct ReplayOptions {
  double duration_s = 9;
  double step_s = 1.0 / 480;    // outer step of the solver, over which activations are held
  int steps_per_control = 4;    // 120 Hz
  physics::Method method = physics::Method::kExplicit;
  bool correct = true;
  bool keep_way = true;  // by what is fed back from cycle to cycle: bends, strides, leaps
  CorrectorOptions corrector;
  Observation observation;  // of the corrector
  std::vector<Push> pushes;
  std::vector<MoveOf<3>> moves = {};  // of the plant's obstacles
  bool trace = false;
  Lesson* lesson = nullptr;  // to be filled by a replay that is corrected
};

/// What a replay is compared with and driven by. All refer to one body; everything must outlive the call.
struct ReplayInput {
  const physics::Scene& scene;            // the plant
  const physics::Scene& model;            // what the corrector believes; the same but where seeds vary the plant
  const PreparedTarget& prepared;
  const Muscles& muscles;
  std::function<void(double time_s, Eigen::VectorXd& activation)> feed_forward;  // E
  Motion clip_skin;                       // the imported clip's skin points, 3V x F, on the ground and with its travel
  physics::ContactPoints skin_points;     // the same points in the body
  double clip_rise = 0;                   // [m] of the centre of mass of the imported clip: apex_rise of its com_path
  double length = 1, size = 1, limit = 0.3;
  const NominalPath* path = nullptr;      // where the feed-forward takes the body; none: to the target
  const CostSource* costs = nullptr;      // of the model, muscles, target, path and signals that are here; none: a regulator's cost is found anew
  const ModelAnswers* answers = nullptr;  // likewise; none: the model is asked anew
};

/// Time courses of one replay, one entry a control step.
struct ReplayCourse {
  Eigen::VectorXd time_s, height, heading_deg, correction, saturated, volume_ratio, slip_speed;
  Eigen::MatrixXd com, target_com;        // 3 x S [m]
  std::vector<std::vector<ContactState>> patch_state;  // patches x S, as simulated
};

struct Replay {
  Motion motion;          // nodes, at the rate of control steps, or of every n-th, that is nearest to the target's
  ReplayReport report;
  ReplayCourse course;
  Trace trace;            // filled where asked
  physics::Termination termination = physics::Termination::kDone;
};

/// Lets the body go: from the target's first state on nothing acts but its own activations, gravity, contact, the scene's water and
/// air, and the pushes.
Replay replay(const ReplayInput& input, const ReplayOptions& options);

/// min(15 cycles, 10 s) of a loop; a one-shot with a second more to stand on its feet.
double usual_duration(const Motion& target);

}  // namespace hydrostat::retarget
