#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "io/npy.h"
#include "io/write_file.h"

namespace hydrostat {

/// What a trace says about itself, from masses, positions, velocities and forces alone; the largest over the rows where nothing else
/// is said.
struct TraceAudit {
  double duration_s = 0;
  double slowest_row_s = 0, fastest_row_s = 1e300;  // lengths of the rows
  double path_miss = 0;         // RMS of x' - x - dt (v + v') / 2 over all nodes and rows, per that of dt v'
  double com_path_miss = 0;     // the same of the COM, per what the row's forces allow: dt^2 / 2 (|contact| / M + g)
  double momentum_mg = 0;       // |dP/dt - M g - contact - effects| / (M g)
  double angular_mgl = 0;       // the same of the angular momentum about the origin, per M g L
  double moment_mgl = 0;        // booked contact moment against that of the node forces at the row's middle
  double cone_excess_mg = 0;    // tangential contact force of a node beyond friction times the normal one
  double pull_mg = 0;           // contact force of a node toward the ground
  double loaded_height_m = -1e300;  // of the lowest contact point of a node that bears load, less the way it goes in the row
  double effect_mg = 0;         // sum of the effect forces
  double contact_mg = 0;        // of a node
  double correction_ns = 0;     // largest correction impulse
};

namespace audit {

inline Eigen::Map<const Eigen::Matrix3Xd> points(const io::NpyArray<double>& array, std::size_t row) {
  const std::size_t count = array.shape.at(1);
  return {array.values.data() + row * 3 * count, 3, static_cast<Eigen::Index>(count)};
}

inline Eigen::Vector3d moment(const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& f) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (Eigen::Index i = 0; i < x.cols(); ++i) sum += x.col(i).cross(f.col(i));
  return sum;
}

}  // namespace audit

inline TraceAudit audit_trace(const std::filesystem::path& trace, const std::filesystem::path& creature,
                              const Eigen::Vector3d& gravity = {0, -9.81, 0}) {
  const auto read = [&](const char* name) { return io::read_npy_double(trace / name); };
  const auto time = read("time.npy"), mass = read("mass.npy"), position = read("position.npy"), velocity = read("velocity.npy"),
             contact = read("contact_force.npy"), effect = read("effect_force.npy"), correction = read("correction_impulse.npy"),
             contact_moment = read("contact_moment.npy"), effect_moment = read("effect_moment.npy");
  const nlohmann::json body = nlohmann::json::parse(io::read_file(creature / "body.json"));
  const double length = body.at("length_m"), friction = body.at("friction");
  const Eigen::Map<const Eigen::VectorXd> m(mass.values.data(), static_cast<Eigen::Index>(mass.values.size()));
  const double total = m.sum();
  const double weight = total * 9.81;
  const Eigen::Index nodes = m.size();
  const nlohmann::json& point_nodes = body.at("contact_points").at("nodes");
  const nlohmann::json& point_weights = body.at("contact_points").at("weights");

  TraceAudit found;
  found.duration_s = time.values.back();
  const std::size_t rows = time.values.size();
  double squared_miss = 0, squared_way = 0;
  for (const double impulse : correction.values) found.correction_ns = std::max(found.correction_ns, std::abs(impulse));

  for (std::size_t s = 1; s < rows; ++s) {
    const double dt = time.values[s] - time.values[s - 1];
    found.slowest_row_s = std::max(found.slowest_row_s, dt);
    found.fastest_row_s = std::min(found.fastest_row_s, dt);
    const Eigen::Matrix3Xd x0 = audit::points(position, s - 1), x1 = audit::points(position, s);
    const Eigen::Matrix3Xd v0 = audit::points(velocity, s - 1), v1 = audit::points(velocity, s);
    const Eigen::Matrix3Xd f = audit::points(contact, s), e = audit::points(effect, s), middle = 0.5 * (x0 + x1);
    const Eigen::Matrix3Xd miss = x1 - x0 - 0.5 * dt * (v0 + v1);
    squared_miss += miss.squaredNorm();
    squared_way += dt * dt * v1.squaredNorm();
    const double allowed = 0.5 * dt * dt * (f.rowwise().sum().norm() / total + 9.81);
    found.com_path_miss = std::max(found.com_path_miss, (miss * m / total).norm() / allowed);

    const Eigen::Vector3d force = f.rowwise().sum() + e.rowwise().sum();
    const Eigen::Vector3d change = (v1 - v0) * m / dt;
    found.momentum_mg = std::max(found.momentum_mg, (change - total * gravity - force).norm() / weight);
    const Eigen::Map<const Eigen::Vector3d> by_contact(contact_moment.values.data() + 3 * s), by_effect(effect_moment.values.data() + 3 * s);
    const Eigen::Vector3d spin = (audit::moment(x1, v1 * m.asDiagonal()) - audit::moment(x0, v0 * m.asDiagonal())) / dt;
    const Eigen::Vector3d by_gravity = (middle * m).cross(gravity);
    found.angular_mgl = std::max(found.angular_mgl, (spin - by_gravity - by_contact - by_effect).norm() / (weight * length));
    found.moment_mgl = std::max(found.moment_mgl, (audit::moment(middle, f) - by_contact).norm() / (weight * length));
    found.effect_mg = std::max(found.effect_mg, e.rowwise().sum().norm() / weight);

    found.contact_mg = std::max(found.contact_mg, f.colwise().norm().maxCoeff() / weight);

    Eigen::VectorXd height = Eigen::VectorXd::Constant(nodes, 1e300);  // of the lowest point that hangs on a node
    for (std::size_t p = 0; p < point_nodes.size(); ++p) {
      double start = 0, end = 0, way = 0;
      for (std::size_t k = 0; k < point_nodes[p].size(); ++k) {
        const Eigen::Index i = point_nodes[p][k];
        const double share = point_weights[p][k];
        start += share * x0(1, i);
        end += share * x1(1, i);
        way += share * dt * std::max(std::abs(v0(1, i)), std::abs(v1(1, i)));
      }
      for (std::size_t k = 0; k < point_nodes[p].size(); ++k) {
        const Eigen::Index i = point_nodes[p][k];
        if (point_weights[p][k] > 0) height[i] = std::min(height[i], std::min(start, end) - way);
      }
    }
    for (Eigen::Index i = 0; i < nodes; ++i) {
      if (f.col(i).norm() <= 1e-9 * weight) continue;
      found.cone_excess_mg = std::max(found.cone_excess_mg, (std::hypot(f(0, i), f(2, i)) - friction * f(1, i)) / weight);
      found.pull_mg = std::max(found.pull_mg, -f(1, i) / weight);
      found.loaded_height_m = std::max(found.loaded_height_m, height[i]);
    }
  }
  found.path_miss = std::sqrt(squared_miss / squared_way);
  return found;
}

/// What a trace says of the time that its body spends in the air.
struct FlightAudit {
  double longest_s = 0;        // without any contact force
  double height_m = -1e300;    // in that time, the highest that the lowest contact point comes
  double fall_miss = 0;        // in all such times, |COM'' - g| / |g|, COM'' by second differences of the positions
};

namespace audit {

inline double lowest_point(const nlohmann::json& points, const Eigen::Matrix3Xd& x) {
  double lowest = 1e300;
  for (std::size_t p = 0; p < points.at("nodes").size(); ++p) {
    double height = 0;
    for (std::size_t k = 0; k < 4; ++k) height += points["weights"][p][k].get<double>() * x(1, points["nodes"][p][k].get<int>());
    lowest = std::min(lowest, height);
  }
  return lowest;
}

}  // namespace audit

inline FlightAudit audit_flight(const std::filesystem::path& trace, const std::filesystem::path& creature) {
  const auto read = [&](const char* name) { return io::read_npy_double(trace / name); };
  const auto time = read("time.npy"), mass = read("mass.npy"), position = read("position.npy"), contact = read("contact_force.npy");
  const nlohmann::json points = nlohmann::json::parse(io::read_file(creature / "body.json")).at("contact_points");
  const Eigen::Map<const Eigen::VectorXd> m(mass.values.data(), static_cast<Eigen::Index>(mass.values.size()));
  const auto com = [&](std::size_t row) { return Eigen::Vector3d(audit::points(position, row) * m / m.sum()); };
  const Eigen::Vector3d gravity(0, -9.81, 0);
  FlightAudit found;
  double seconds = 0, height = -1e300;
  for (std::size_t s = 1; s < time.values.size(); ++s) {
    if (audit::points(contact, s).norm() > 0) {
      seconds = 0, height = -1e300;
      continue;
    }
    const double dt = time.values[s] - time.values[s - 1];
    if (seconds > 0) {  // the row before was free too
      const Eigen::Vector3d acceleration = (com(s) - 2 * com(s - 1) + com(s - 2)) / (dt * dt);
      found.fall_miss = std::max(found.fall_miss, (acceleration - gravity).norm() / gravity.norm());
    }
    seconds += dt;
    height = std::max(height, audit::lowest_point(points, audit::points(position, s)));
    if (seconds > found.longest_s) found.longest_s = seconds, found.height_m = height;
  }
  return found;
}

}  // namespace hydrostat
