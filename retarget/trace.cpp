#include "retarget/trace.h"

namespace hydrostat::retarget {
namespace {

/// Row 0 of the result is the trace's; row r the mean of the rows that end its interval. One column a row.
template <typename Matrix>
Matrix interval_means(const Matrix& rows, Eigen::Index every) {
  const Eigen::Index intervals = (rows.cols() - 1) / every;
  Matrix means(rows.rows(), intervals + 1);
  means.col(0) = rows.col(0);
  for (Eigen::Index r = 1; r <= intervals; ++r) means.col(r) = rows.middleCols((r - 1) * every + 1, every).rowwise().mean();
  return means;
}

}  // namespace

template <int Dim>
Trace empty_trace(const physics::BodyOf<Dim>& body, Eigen::Index rows) {
  const Eigen::Index entries = 3 * body.node_count();
  Trace trace;
  trace.time_s.resize(rows);
  trace.mass_kg = body.mass;
  trace.position.resize(entries, rows);
  trace.velocity = trace.position;
  trace.contact_force = Eigen::MatrixXd::Zero(entries, rows);
  trace.effect_force = trace.correction_impulse = trace.contact_force;
  trace.contact_moment = Eigen::Matrix3Xd::Zero(3, rows);
  trace.effect_moment = trace.contact_moment;
  trace.activation.resize(body.edge_count(), rows);
  trace.edges = body.edges;
  trace.rest_length_m = body.rest_length;
  trace.elements = body.tets;
  return trace;
}
template Trace empty_trace<2>(const physics::BodyOf<2>&, Eigen::Index);
template Trace empty_trace<3>(const physics::BodyOf<3>&, Eigen::Index);

void shorten(Trace& trace, Eigen::Index rows) {
  trace.time_s.conservativeResize(rows);
  for (Eigen::MatrixXd* course : {&trace.position, &trace.velocity, &trace.contact_force, &trace.effect_force, &trace.correction_impulse, &trace.activation}) {
    course->conservativeResize(Eigen::NoChange, rows);
  }
  trace.contact_moment.conservativeResize(Eigen::NoChange, rows);
  trace.effect_moment.conservativeResize(Eigen::NoChange, rows);
}

Trace thinned(const Trace& trace, int every) {
  if (every == 1 || trace.count() == 0) return trace;
  const Eigen::Index intervals = (trace.count() - 1) / every;
  const Eigen::VectorXi ends = Eigen::VectorXi::LinSpaced(intervals + 1, 0, static_cast<int>(intervals * every));
  Trace result = trace;
  result.time_s = trace.time_s(ends);
  result.position = trace.position(Eigen::all, ends);
  result.velocity = trace.velocity(Eigen::all, ends);
  result.contact_force = interval_means(trace.contact_force, every);
  result.effect_force = interval_means(trace.effect_force, every);
  result.correction_impulse = every * interval_means(trace.correction_impulse, every);
  result.contact_moment = interval_means(trace.contact_moment, every);
  result.effect_moment = interval_means(trace.effect_moment, every);
  result.activation = interval_means(trace.activation, every);
  return result;
}

}  // namespace hydrostat::retarget
