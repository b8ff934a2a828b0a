#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <random>
#include <vector>

#include "retarget/control_mesh.h"
#include "retarget/morphs.h"
#include "retarget/motion.h"

namespace hydrostat::io::moving_creature {

/// A body of random tets over a cloud of nodes, points inside of them, and nodes that turn, travel and wobble.
struct Creature {
  retarget::ControlMesh body;
  Eigen::VectorXd mass;
  Eigen::Matrix3Xd vertices;
  Eigen::Matrix3Xi triangles;
  retarget::Embedding embedding;
  retarget::Motion motion;
};

inline Creature random_creature(unsigned seed, int nodes, int vertices, int frames) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<> uniform(0, 1);
  Creature creature;
  creature.body.nodes = Eigen::Matrix3Xd::NullaryExpr(3, nodes, [&] { return uniform(random); });
  creature.mass = Eigen::VectorXd::NullaryExpr(nodes, [&] { return 0.1 + uniform(random); });
  creature.vertices.resize(3, vertices);
  creature.embedding.nodes.resize(4, vertices);
  creature.embedding.weights.resize(4, vertices);
  for (int v = 0; v < vertices; ++v) {
    const int first = static_cast<int>(random() % static_cast<unsigned>(nodes));
    for (int k = 0; k < 4; ++k) {
      creature.embedding.nodes(k, v) = (first + k) % nodes;
      creature.embedding.weights(k, v) = v % 5 == 0 && k > 0 ? 0 : uniform(random);  // some vertices lie on a node
    }
    creature.embedding.weights.col(v) /= creature.embedding.weights.col(v).sum();
    creature.vertices.col(v).setZero();
    for (int k = 0; k < 4; ++k) {
      creature.vertices.col(v) += creature.embedding.weights(k, v) * creature.body.nodes.col(creature.embedding.nodes(k, v));
    }
  }
  creature.triangles.resize(3, vertices - 2);
  for (int t = 0; t < vertices - 2; ++t) creature.triangles.col(t) << t, t + 1, t + 2;
  creature.motion.rate_hz = 30;
  creature.motion.frames.resize(3 * nodes, frames);
  for (int f = 0; f < frames; ++f) {
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.7 * f, Eigen::Vector3d(0.2, 1, 0.1).normalized()).toRotationMatrix();
    const Eigen::Matrix3Xd wobble = Eigen::Matrix3Xd::NullaryExpr(3, nodes, [&] { return 0.05 * uniform(random); });
    creature.motion.at(f) = (turn * (creature.body.nodes + wobble)).colwise() + Eigen::Vector3d(0.1 * f, 0, 0);
  }
  return creature;
}

inline Eigen::Matrix3Xd embedded(const Creature& creature, const Eigen::Matrix3Xd& nodes) {
  Eigen::Matrix3Xd positions = Eigen::Matrix3Xd::Zero(3, creature.vertices.cols());
  for (Eigen::Index v = 0; v < positions.cols(); ++v) {
    for (int k = 0; k < 4; ++k)
      positions.col(v) += creature.embedding.weights(k, v) * nodes.col(creature.embedding.nodes(k, v));
  }
  return positions;
}

/// A bar along x of square section whose nodes are its skin's vertices; `bend`: by how much [rad] its ends are turned to
/// each other.
inline Eigen::Matrix3Xd bent_bar(double bend) {
  constexpr int kSections = 9;
  Eigen::Matrix3Xd nodes(3, 4 * kSections);
  for (int n = 0; n < nodes.cols(); ++n) {
    const double along = n / 4 / (kSections - 1.0) - 0.5, up = 0.1 * (n / 2 % 2) - 0.05, aside = 0.1 * (n % 2) - 0.05;
    const double angle = bend * along, radius = std::abs(bend) > 1e-9 ? 1 / bend : 0;
    nodes.col(n) = radius == 0
                       ? Eigen::Vector3d(along, up, aside)
                       : Eigen::Vector3d((radius + up) * std::sin(angle), (radius + up) * std::cos(angle) - radius, aside);
  }
  return nodes;
}

inline Creature bar(const std::vector<double>& bends) {
  Creature creature;
  creature.body.nodes = creature.vertices = bent_bar(0);
  const Eigen::Index count = creature.vertices.cols();
  creature.mass = Eigen::VectorXd::Ones(count);
  creature.embedding.nodes = Eigen::Matrix4Xi::Zero(4, count);
  creature.embedding.nodes.row(0) = Eigen::RowVectorXi::LinSpaced(count, 0, static_cast<int>(count) - 1);
  creature.embedding.weights = Eigen::Matrix4Xd::Zero(4, count);
  creature.embedding.weights.row(0).setOnes();
  std::vector<int> corners;
  const int ring[] = {0, 1, 3, 2, 0};
  for (int n = 0; n + 4 < count; n += 4) {
    for (int k = 0; k < 4; ++k) {
      const int a = n + ring[k], b = n + ring[k + 1];
      corners.insert(corners.end(), {a, b, a + 4, b, b + 4, a + 4});
    }
  }
  creature.triangles = Eigen::Map<const Eigen::Matrix3Xi>(corners.data(), 3, static_cast<Eigen::Index>(corners.size()) / 3);
  creature.motion.rate_hz = 30;
  creature.motion.frames.resize(3 * count, static_cast<Eigen::Index>(bends.size()));
  for (std::size_t f = 0; f < bends.size(); ++f) {
    const Eigen::AngleAxisd turn(0.3 * static_cast<double>(f), Eigen::Vector3d::UnitY());
    creature.motion.at(static_cast<Eigen::Index>(f)) = turn.toRotationMatrix() * bent_bar(bends[f]);
  }
  return creature;
}

inline Eigen::Matrix3Xd surface_normals(const Eigen::Matrix3Xd& vertices, const Eigen::Matrix3Xi& triangles) {
  Eigen::Matrix3Xd normals = Eigen::Matrix3Xd::Zero(3, vertices.cols());
  for (const auto corners : triangles.colwise()) {
    const Eigen::Vector3d a = vertices.col(corners[0]);
    for (const int corner : corners)
      normals.col(corner) += (vertices.col(corners[1]) - a).cross(vertices.col(corners[2]) - a);
  }
  return normals.colwise().normalized();
}

/// The bar with edges, and a face: its last section swells by a centimetre or two, away from the bar.
struct Face {
  Creature creature;
  retarget::MovingMorphs morphs;

  explicit Face(const std::vector<double>& bends) : creature(bar(bends)) {
    std::vector<int> edges;
    const auto count = static_cast<int>(creature.vertices.cols());
    for (int a = 0; a < count; ++a) {
      for (int b = a + 1; b < count && b / 4 <= a / 4 + 1; ++b) edges.insert(edges.end(), {a, b});
    }
    creature.body.edges = Eigen::Map<const Eigen::Matrix2Xi>(edges.data(), 2, static_cast<Eigen::Index>(edges.size() / 2));
    const Eigen::VectorXi last = Eigen::VectorXi::LinSpaced(4, count - 4, count - 1);
    morphs.targets = {{"pout", last, Eigen::Vector3d(0.02, 0, 0).replicate(1, 4)},
                      {"brow", last.head(2), Eigen::Vector3d(0, 0.01, 0.01).replicate(1, 2)}};
    const auto frames = static_cast<Eigen::Index>(bends.size());
    morphs.rate_hz = creature.motion.rate_hz;
    morphs.weights.resize(2, frames);
    for (Eigen::Index f = 0; f < frames; ++f) morphs.weights.col(f) << 0.3 + 0.1 * static_cast<double>(f % 5), f % 2;
  }
};

}  // namespace hydrostat::io::moving_creature
