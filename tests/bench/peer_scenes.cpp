#include "tests/bench/peer_scenes.h"

#include <gtest/gtest.h>  // which the scenes of the tests want

#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/element_body.h"
#include "tests/physics/element_scene.h"

namespace hydrostat::bench {

using physics::State;

namespace {

PeerScene bar(const std::string& name, int cells_along, int cells_across, const physics::ElementMaterial& material) {
  const Eigen::Vector3i cells(cells_along, cells_across, cells_across);
  const physics::ElementMesh<3> mesh =
      physics::element_bar<3>(cells, Eigen::Vector3d(1, 0.25, 0.25), physics::Cut::kSixTets, material);
  PeerScene scene{name, {}, {}, material};
  scene.scene.body = physics::make_body(mesh, physics::ElementBodyOptions{});
  scene.scene.has_ground = false;
  scene.start = {mesh.rest, Eigen::Matrix3Xd::Zero(3, mesh.rest.cols())};
  return scene;
}

}  // namespace

PeerScene cantilever(int cells_along, int cells_across, const physics::ElementMaterial& material) {
  PeerScene scene = bar("cantilever", cells_along, cells_across, material);
  physics::Body& body = scene.scene.body;
  for (int i = 0; i < body.node_count(); ++i) {
    if (body.rest(0, i) < 1e-9) body.held.push_back(i);
  }
  return scene;
}

PeerScene tumbling(int cells_along, int cells_across, const physics::ElementMaterial& material) {
  PeerScene scene = bar("tumbling", cells_along, cells_across, material);
  scene.scene.gravity.setZero();
  scene.start.x.row(0) *= 1.1;
  const Eigen::Vector3d centre = centre_of_mass(scene.scene.body, scene.start.x), rate(6, 3, 4);
  for (Eigen::Index i = 0; i < scene.start.x.cols(); ++i) scene.start.v.col(i) = rate.cross(scene.start.x.col(i) - centre);
  return scene;
}

Motion run(physics::Stepper& stepper, const PeerScene& scene, int steps_per_second) {
  const int steps_per_frame = steps_per_second / kFramesPerSecond;
  const Eigen::VectorXd passive = Eigen::VectorXd::Ones(scene.scene.body.edge_count());
  physics::Impulses impulses = make_impulses(scene.scene);
  State state = scene.start;
  Motion motion{{state}};
  for (int frame = 0; frame < kDuration * kFramesPerSecond; ++frame) {
    for (int k = 0; k < steps_per_frame; ++k) {
      if (stepper.step(1.0 / steps_per_second, passive, nullptr, state, impulses) != physics::Termination::kDone) {
        motion.is_whole = false;
        return motion;
      }
    }
    motion.frames.push_back(state);
  }
  return motion;
}

Verdict judge(const PeerScene& scene, const Motion& motion, const Motion& reference) {
  const physics::Body& body = scene.scene.body;
  Verdict verdict;
  const double rest_volume = volume(body, body.rest);
  const auto volume_off = [&](const State& state) { return std::abs(volume(body, state.x) / rest_volume - 1); };
  double sum = 0;
  for (std::size_t k = 0; k < motion.frames.size(); ++k) {
    const State& state = motion.frames[k];
    sum += (state.x - reference.frames[k].x).squaredNorm() / static_cast<double>(state.x.cols());
    const double least = jacobians(body, state.x).minCoeff();
    if (!(least >= verdict.least_jacobian)) verdict.least_jacobian = least;
    const double off = volume_off(state);
    if (!(off <= verdict.volume_error)) verdict.volume_error = off;
    if (k + 1 == motion.frames.size())
      verdict.is_sound = motion.is_whole && least > 0 && off < volume_off(motion.frames.front()) + 0.02;
  }
  verdict.error = std::sqrt(sum / static_cast<double>(motion.frames.size()));
  if (body.held.empty()) {
    const auto spin = [&](const State& state) {
      return angular_momentum(body, state.x, state.v, centre_of_mass(body, state.x));
    };
    const Eigen::Vector3d start = spin(scene.start);
    verdict.angular_loss = (spin(motion.frames.back()) - start).norm() / start.norm();
  }
  return verdict;
}

}  // namespace hydrostat::bench
