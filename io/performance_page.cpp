#include "io/performance_page.h"

#include <algorithm>
#include <cmath>

#include "io/page_obstacle.h"

namespace hydrostat::io {
namespace {

using retarget::Replay;

constexpr double kSignalRate = 60;  // [Hz] at which the activations are drawn

struct Run {
  const char* name;
  PageRole role;
  const Replay& replay;
};

std::vector<Run> runs_of(const retarget::Performances& performances) {
  std::vector<Run> runs;
  if (performances.closed_loop) runs.push_back({"replay", PageRole::kReplay, *performances.closed_loop});
  if (performances.open_loop) runs.push_back({"open loop", PageRole::kOpenLoop, *performances.open_loop});
  if (performances.naive) runs.push_back({"naive", PageRole::kNaive, *performances.naive});
  return runs;
}

/// The run that holds out longest: its course of the target is drawn.
const Replay& longest(const std::vector<Run>& runs) {
  const Run* best = &runs.front();
  for (const Run& run : runs) {
    if (run.replay.course.time_s.size() > best->replay.course.time_s.size()) best = &run;
  }
  return best->replay;
}

PageCurve row_of(const char* name, PageRole role, const Eigen::VectorXd& time, const Eigen::MatrixXd& points, int row) {
  return {name, role, time, points.row(row).transpose()};
}

PageChart com_path(const std::vector<Run>& runs) {
  PageChart chart{"Way of the centre of mass, from above", "x [m]", "z [m]", false, {}};
  const Eigen::MatrixXd& target = longest(runs).course.target_com;
  chart.curves.push_back({"target", PageRole::kTarget, target.row(0).transpose(), target.row(2).transpose()});
  for (const Run& run : runs) {
    const Eigen::MatrixXd& com = run.replay.course.com;
    chart.curves.push_back({run.name, run.role, com.row(0).transpose(), com.row(2).transpose()});
  }
  return chart;
}

PageChart com_height(const std::vector<Run>& runs) {
  PageChart chart{"Height of the centre of mass", "time [s]", "height [m]", true, {}};
  const retarget::ReplayCourse& longest_course = longest(runs).course;
  chart.curves.push_back(row_of("target", PageRole::kTarget, longest_course.time_s, longest_course.target_com, 1));
  for (const Run& run : runs) chart.curves.push_back({run.name, run.role, run.replay.course.time_s, run.replay.course.height});
  return chart;
}

PageChart drift(const std::vector<Run>& runs, double length) {
  PageChart chart{"Distance from the target over the ground", "time [s]", "drift [% L]", true, {}};
  for (const Run& run : runs) {
    const Eigen::MatrixXd error = run.replay.course.com - run.replay.course.target_com;
    const Eigen::VectorXd away = (error.row(0).array().square() + error.row(2).array().square()).sqrt().matrix().transpose();
    chart.curves.push_back({run.name, run.role, run.replay.course.time_s, 100 / length * away});
  }
  return chart;
}

/// One of the courses' curves, for every run.
PageChart course_chart(const std::vector<Run>& runs, const char* title, const char* y_label, double factor,
                       Eigen::VectorXd retarget::ReplayCourse::*values) {
  PageChart chart{title, "time [s]", y_label, true, {}};
  for (const Run& run : runs) {
    chart.curves.push_back({run.name, run.role, run.replay.course.time_s, factor * run.replay.course.*values});
  }
  return chart;
}

PageChart activations_chart(const retarget::SignalSet& signals, double duration_s) {
  PageChart chart{"Mean activation of each bone region", "time [s]", "rest length over that of the bind pose [-]", true, {}};
  signal::Synthesiser player = retarget::activations(signals);
  const auto samples = static_cast<Eigen::Index>(std::floor(duration_s * kSignalRate)) + 1;
  Eigen::MatrixXd values(signals.count(), samples);
  for (Eigen::Index s = 0; s < samples; ++s) player.at(static_cast<double>(s) / kSignalRate, values.col(s));
  const Eigen::VectorXd time = Eigen::VectorXd::LinSpaced(samples, 0, static_cast<double>(samples - 1) / kSignalRate);
  std::vector<std::string> bones;
  for (const signal::Label& channel : signals.channels) {
    if (std::find(bones.begin(), bones.end(), channel.group) == bones.end()) bones.push_back(channel.group);
  }
  for (const std::string& bone : bones) {
    Eigen::RowVectorXd mean = Eigen::RowVectorXd::Zero(samples);
    int count = 0;
    for (int e = 0; e < signals.count(); ++e) {
      if (signals.channels[static_cast<std::size_t>(e)].group != bone) continue;
      mean += values.row(e);
      ++count;
    }
    chart.curves.push_back({bone, PageRole::kOther, time, mean.transpose() / count});
  }
  return chart;
}

PageChart missing_wrench(const retarget::PreparedTarget& prepared) {
  PageChart chart{"What the target needs and contact cannot give", "time [s]", "missing wrench [mg, mgL]", true, {}};
  const Eigen::Index frames = prepared.missing_wrench.cols();
  const Eigen::VectorXd time = Eigen::VectorXd::LinSpaced(frames, 0, static_cast<double>(frames - 1) / prepared.target.rate_hz);
  chart.curves.push_back({"force", PageRole::kTarget, time, prepared.missing_wrench.topRows(3).colwise().norm().transpose()});
  chart.curves.push_back({"moment", PageRole::kOther, time, prepared.missing_wrench.bottomRows(3).colwise().norm().transpose()});
  return chart;
}

std::vector<PageContactRow> contact_rows(const retarget::PreparedTarget& prepared, const Run& run) {
  std::vector<PageContactRow> rows;
  const Eigen::VectorXd& time = run.replay.course.time_s;
  const double rate = time.size() > 0 ? static_cast<double>(time.size()) / time[time.size() - 1] : 1;
  for (std::size_t k = 0; k < prepared.contacts.patches.size(); ++k) {
    const std::string& name = prepared.contacts.patches[k].name;
    rows.push_back({name, PageRole::kTarget, prepared.target.rate_hz, prepared.target.loop, prepared.contacts.state[k]});
    rows.push_back({name, run.role, rate, false, run.replay.course.patch_state[k]});
  }
  return rows;
}

/// Ground and obstacles as the world has them.
void show_surroundings(const retarget::Performer& performer, const retarget::Motion& motion, PageInput& page) {
  const retarget::World& world = performer.world;
  page.has_ground = performer.scene.has_ground;
  page.ground_normal = world.turn * performer.scene.ground.normal;
  page.ground_height = (performer.scene.ground.offset + page.ground_normal.dot(world.pivot)) / page.ground_normal.y();
  for (std::size_t o = 0; o < performer.scene.obstacles.size(); ++o) {
    physics::ObstacleOf<3> obstacle = performer.scene.obstacles[o];
    obstacle.place = world.pivot + world.turn * (obstacle.place - world.pivot);
    obstacle.turn = world.turn * obstacle.turn;
    retarget::Motion travel = retarget::travel_of(world.moves, static_cast<int>(o), motion.rate_hz, motion.count());
    travel.frames = world.turn * travel.frames;
    page.obstacles.push_back(page_obstacle<3>(obstacle, travel, performer.length));
  }
}

}  // namespace

void write_performance_page(const std::filesystem::path& path, const retarget::Performer& performer,
                            const Appearance& appearance, const retarget::SignalSet& signals,
                            const retarget::Performances& performances, const retarget::RunReport& report,
                            const std::string& curve, const retarget::MovingMorphs& wobble) {
  const std::vector<Run> runs = runs_of(performances);
  PageInput page{report, performer.skin, performer.embedding, performer.mesh, {}, {}, {}, 0};
  page.appearance = &appearance;
  page.morphs = &performer.morphs;
  const double duration_s = longest(runs).report.duration_s;
  const auto seen = [&](const retarget::Motion& motion) { return retarget::in_world(performer.world, motion, duration_s); };
  page.motions.push_back({PageRole::kClip, true, seen(performer.clip_skin)});
  page.motions.push_back({PageRole::kTarget, false, seen(performer.prepared.target)});
  for (const Run& run : runs) page.motions.push_back({run.role, false, seen(run.replay.motion)});
  show_surroundings(performer, runs.front().replay.motion, page);
  page.motions[2].morphs = wobble;  // the main run is the first
  using Course = retarget::ReplayCourse;
  page.charts = {com_path(runs),
                 com_height(runs),
                 course_chart(runs, "Turn away from the target's heading", "heading [deg]", 1, &Course::heading_deg),
                 drift(runs, performer.length),
                 course_chart(runs, "Slip of the fastest loaded patch", "speed [m/s]", 1, &Course::slip_speed),
                 course_chart(runs, "Volume of the whole body", "volume over that at rest [-]", 1, &Course::volume_ratio),
                 course_chart(runs, "Share of the activations at the limit", "saturated [%]", 100, &Course::saturated),
                 activations_chart(signals, longest(runs).report.duration_s),
                 missing_wrench(performer.prepared)};
  if (performances.closed_loop) {
    const Course& course = performances.closed_loop->course;
    page.charts.push_back({"Size of the correction", "time [s]", "RMS over the muscles [-]", true,
                           {{"replay", PageRole::kReplay, course.time_s, course.correction}}});
  }
  page.contacts = contact_rows(performer.prepared, runs.front());
  page.accuracy_svg = curve;
  write_report_page(path, page);
}

}  // namespace hydrostat::io
