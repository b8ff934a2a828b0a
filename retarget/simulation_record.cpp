#include "retarget/simulation_record.h"

#include <algorithm>
#include <cmath>

namespace hydrostat::retarget {
namespace {

using physics::PointsOf;
using physics::SpinOf;
using physics::VectorOf;

/// A column as Motion and Trace hold it: x0 y0 z0 x1 ...
template <int Dim>
Eigen::VectorXd column_of(const PointsOf<Dim>& points) {
  Eigen::Matrix3Xd all = Eigen::Matrix3Xd::Zero(3, points.cols());
  all.template topRows<Dim>() = points;
  return all.reshaped();
}

template <int Dim>
Eigen::Vector3d moment_of(const SpinOf<Dim>& spin) {
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  moment.tail<SpinOf<Dim>::RowsAtCompileTime>() = spin;
  return moment;
}

/// The sum over all nodes of a column.
template <int Dim>
VectorOf<Dim> sum_of(const Eigen::VectorXd& column) {
  return column.reshaped(3, column.size() / 3).rowwise().sum().template head<Dim>();
}

}  // namespace

template <int Dim>
SimulationRecord<Dim>::SimulationRecord(const ScenarioOf<Dim>& scenario, const SimulationOptions& options,
                                        const physics::BodyOf<Dim>& body)
    : scenario_(scenario), options_(options) {
  if (!options.trace) return;
  const long steps = std::max(1L, std::lround(options.duration_s / options.dt_s));
  trace_ = empty_trace(body, steps / options.steps_per_row + 1);
  contact_ = effect_ = correction_ = Eigen::VectorXd::Zero(3 * body.node_count());
  activation_ = Eigen::VectorXd::Zero(body.edge_count());
}

template <int Dim>
Eigen::VectorXd SimulationRecord<Dim>::of_nodes(const PointsOf<Dim>& points) const {
  return written_.node.size() == 0 ? column_of<Dim>(points) : column_of<Dim>(points(Eigen::all, written_.node));
}

/// What acts on a node acts on its copies by their masses.
template <int Dim>
Eigen::VectorXd SimulationRecord<Dim>::shares_of(const PointsOf<Dim>& forces) const {
  if (written_.node.size() == 0) return column_of<Dim>(forces);
  return column_of<Dim>(forces(Eigen::all, written_.node) * written_.share.asDiagonal());
}

template <int Dim>
Eigen::VectorXd SimulationRecord<Dim>::of_edges(const Eigen::VectorXd& activation) const {
  return written_.node.size() == 0 ? activation : activation(written_.edges);
}

template <int Dim>
void SimulationRecord<Dim>::add_step(const physics::ImpulsesOf<Dim>& impulses, const std::vector<int>& held,
                                     const SpinOf<Dim>& hold_moment, const Eigen::VectorXd& activation) {
  PointsOf<Dim> effect = impulses.effect_nodes;
  for (std::size_t n = 0; n < held.size(); ++n) effect.col(held[n]) += impulses.hold.col(static_cast<Eigen::Index>(n));
  contact_ += shares_of(impulses.contact_nodes);
  effect_ += shares_of(effect);
  correction_ += shares_of(impulses.correction_nodes);
  contact_moment_ += impulses.contact_moment;
  effect_moment_ += impulses.effect_moment + hold_moment;
  activation_ += of_edges(activation);
  ++steps_in_row_;
}

template <int Dim>
void SimulationRecord<Dim>::begin_trace(const physics::StateOf<Dim>& state, const Eigen::VectorXd& activation) {
  trace_.activation.col(0) = of_edges(activation);
  write_row(0, state);
}

template <int Dim>
void SimulationRecord<Dim>::write_row(double time_s, const physics::StateOf<Dim>& state) {
  const Eigen::Index row = rows_++;
  trace_.time_s[row] = time_s;
  trace_.position.col(row) = of_nodes(state.x.colwise() + scenario_.origin);
  trace_.velocity.col(row) = of_nodes(state.v);
  if (steps_in_row_ == 0) return;
  const double seconds = steps_in_row_ * options_.dt_s;
  trace_.contact_force.col(row) = contact_ / seconds;
  trace_.effect_force.col(row) = effect_ / seconds;
  trace_.correction_impulse.col(row) = correction_;
  const SpinOf<Dim> of_contact = contact_moment_ + physics::cross<Dim>(scenario_.origin, sum_of<Dim>(contact_));
  const SpinOf<Dim> of_effect = effect_moment_ + physics::cross<Dim>(scenario_.origin, sum_of<Dim>(effect_));
  trace_.contact_moment.col(row) = moment_of<Dim>(of_contact / seconds);
  trace_.effect_moment.col(row) = moment_of<Dim>(of_effect / seconds);
  trace_.activation.col(row) = activation_ / steps_in_row_;
  for (Eigen::VectorXd* sum : {&contact_, &effect_, &correction_, &activation_}) sum->setZero();
  contact_moment_.setZero();
  effect_moment_.setZero();
  steps_in_row_ = 0;
}

template <int Dim>
void SimulationRecord<Dim>::write_frame(const physics::StateOf<Dim>& state, const Eigen::Vector3d& com,
                                        const std::array<double, 9>& figures) {
  frames_.push_back(of_nodes(state.x));
  if (options_.velocities) velocities_.emplace_back(of_nodes(state.v).reshaped(3, frames_.back().size() / 3));
  travels_.push_back(state.obstacle_travel);
  com_.push_back(com);
  course_.push_back(figures);
}

template <int Dim>
void SimulationRecord<Dim>::finish(double rate_hz, Simulation& simulation) {
  const auto count = static_cast<Eigen::Index>(frames_.size()), obstacles = travels_.front().cols();
  simulation.velocities = std::move(velocities_);
  Motion& motion = simulation.motion;
  motion.rate_hz = rate_hz;
  motion.frames.resize(frames_.front().size(), count);
  simulation.obstacle_travels.assign(static_cast<std::size_t>(obstacles), {rate_hz, Eigen::MatrixXd::Zero(3, count)});
  SimulationCourse& course = simulation.course;
  course.com.resize(3, count);
  Eigen::VectorXd* const columns[] = {&course.time_s, &course.kinetic_j, &course.elastic_j, &course.gravity_j, &course.work_j,
                                      &course.volume_ratio, &course.penetration_m, &course.contact_weights, &course.mean_activation};
  for (Eigen::VectorXd* column : columns) column->resize(count);
  for (Eigen::Index f = 0; f < count; ++f) {
    const auto frame = static_cast<std::size_t>(f);
    motion.frames.col(f) = frames_[frame];
    course.com.col(f) = com_[frame];
    for (std::size_t k = 0; k < std::size(columns); ++k) (*columns[k])[f] = course_[frame][k];
    for (Eigen::Index o = 0; o < obstacles; ++o) {
      simulation.obstacle_travels[static_cast<std::size_t>(o)].frames.template block<Dim, 1>(0, f) = travels_[frame].col(o);
    }
  }
  if (options_.trace) shorten(trace_, rows_);
  simulation.trace = std::move(trace_);
}

template <int Dim>
ScenarioOf<Dim> written_scenario(const ScenarioOf<Dim>& scenario) {
  ScenarioOf<Dim> written = scenario;
  if (!scenario.fracture) return written;
  const physics::FractureOf<Dim>& fracture = *scenario.fracture;
  const physics::SplitMesh<Dim> apart =
      physics::split_mesh(fracture.mesh, fracture.faces, std::vector<char>(fracture.faces.size(), 1));
  written.scene.body = physics::split_body(fracture, scenario.scene.body, apart);
  written.scene.self_contact = fracture.self_contact;
  physics::touch_with_whole_surface(written.scene);
  written.start.x = scenario.start.x(Eigen::all, apart.origin);
  written.start.v = scenario.start.v(Eigen::all, apart.origin);
  const Eigen::VectorXi edges = physics::whole_edges(scenario.scene.body, written.scene.body, apart.origin);
  for (Wave& wave : written.waves) {
    wave.share = wave.share(edges).eval();
    wave.phase = wave.phase(edges).eval();
  }
  for (Clamp& clamp : written.clamps) clamp.nodes = physics::copies_of(clamp.nodes, apart.origin);
  written.fracture.reset();
  return written;
}
template ScenarioOf<2> written_scenario<2>(const ScenarioOf<2>&);
template ScenarioOf<3> written_scenario<3>(const ScenarioOf<3>&);

template class SimulationRecord<2>;
template class SimulationRecord<3>;

}  // namespace hydrostat::retarget
