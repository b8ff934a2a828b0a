#include "retarget/level.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "physics/internal_forces.h"
#include "physics/system_matrix.h"
#include "retarget/balance.h"
#include "retarget/least_squares.h"
#include "retarget/self_contact_plan.h"
#include "retarget/shape_projection.h"
#include "retarget/simulation.h"
#include "retarget/step_cost.h"

namespace hydrostat::retarget {
namespace {

using Triplets = std::vector<Eigen::Triplet<double>>;

constexpr double kFieldCalm = 1e-2;    // per squared difference of the tensors at a constraint's ends
constexpr double kJumps = 1e-3;        // per squared change of the deformation from tet to tet, in cells
constexpr double kInside = 0.3;        // of the inside beside the skin, where nodes are placed
constexpr double kOtherLimb = 0.5;     // share of weights on other bones from which on a place is another limb's
constexpr double kTouching = 0.003;    // per D: points of a contact that ended higher bear no load
constexpr double kLeastSquare = 0.01;  // of an activation
// Of what a level adds to its activations.
constexpr double kHorizon = 1.0 / 30;   // [s]
constexpr double kGroundBalance = 100;  // of what the ground's forces leave, per weight, beside the forces themselves
constexpr double kMissUnit = 1e-3;      // of L
constexpr double kEffort = 1;           // per squared activation, mean over the constraints, in squares of that unit
constexpr int kRounds = 60;
constexpr double kLeastSlope = 1e-3;  // of the first

/// Places in the tets of a mesh.
struct Places {
  Eigen::Matrix4Xi nodes;
  Eigen::Matrix4Xd weights;     // >= 0, sum 1
  std::vector<char> is_inside;  // otherwise: the nearest tet's nearest point, about
};

/// Of places of the rest shape with the bones that own them; where parts of the body lie in one another the limb decides.
Places locate(const ControlMesh& mesh, const Eigen::MatrixXd& bone_weights, const Eigen::Matrix3Xd& points,
              const Eigen::MatrixXd& bones) {
  const Eigen::Index tets = mesh.tets.cols();
  std::vector<Eigen::Matrix3d> inverse(static_cast<std::size_t>(tets));
  Eigen::MatrixXd owners(bone_weights.rows(), tets);
  for (Eigen::Index t = 0; t < tets; ++t) {
    Eigen::Matrix3d spans;
    for (int k = 0; k < 3; ++k) spans.col(k) = mesh.nodes.col(mesh.tets(k + 1, t)) - mesh.nodes.col(mesh.tets(0, t));
    inverse[static_cast<std::size_t>(t)] = spans.inverse();
    owners.col(t) = 0.25 * bone_weights(Eigen::all, mesh.tets.col(t)).rowwise().sum();
  }
  Places places{Eigen::Matrix4Xi(4, points.cols()), Eigen::Matrix4Xd(4, points.cols()),
                std::vector<char>(static_cast<std::size_t>(points.cols()), 0)};
  for (Eigen::Index p = 0; p < points.cols(); ++p) {
    double best = 1e300;
    for (Eigen::Index t = 0; t < tets; ++t) {
      Eigen::Vector4d weights;
      weights.tail<3>() = inverse[static_cast<std::size_t>(t)] * (points.col(p) - mesh.nodes.col(mesh.tets(0, t)));
      weights[0] = 1 - weights.tail<3>().sum();
      const double outside = std::max(0.0, -weights.minCoeff() - 1e-9);
      if (outside >= best) continue;
      const double foreign = 0.5 * (owners.col(t) - bones.col(p)).lpNorm<1>();
      const double cost = outside + std::max(0.0, foreign - kOtherLimb) + 1e-3 * foreign;
      if (cost >= best) continue;
      best = cost;
      places.nodes.col(p) = mesh.tets.col(t);
      places.weights.col(p) = weights.cwiseMax(0) / weights.cwiseMax(0).sum();
      places.is_inside[static_cast<std::size_t>(p)] = outside == 0;
    }
  }
  return places;
}

using Direction = Eigen::Matrix<double, 6, 1>;

/// What a tensor is along a direction, as coefficients of its six numbers.
Direction along(const Eigen::Vector3d& n) {
  Direction c;
  c << n.x() * n.x(), n.y() * n.y(), n.z() * n.z(), 2 * n.x() * n.y(), 2 * n.y() * n.z(), 2 * n.x() * n.z();
  return c;
}

/// Squared lengths over squared rest lengths, E x F.
Eigen::MatrixXd squared_stretches(const physics::Body& body, const Motion& target) {
  Eigen::MatrixXd squares(body.edge_count(), target.count());
  for (Eigen::Index f = 0; f < target.count(); ++f) {
    const auto x = target.at(f);
    for (int e = 0; e < body.edge_count(); ++e) {
      squares(e, f) = (x.col(body.edges(1, e)) - x.col(body.edges(0, e))).squaredNorm() / std::pow(body.rest_length[e], 2);
    }
  }
  return squares;
}

/// The field along the constraints of another mesh: the mean of three places on each. E' x S.
Eigen::MatrixXd evaluate(const Eigen::MatrixXd& tensors, const ControlMesh& solved, const Rig& rig, const ControlMesh& mesh,
                         const Eigen::Matrix2Xi& constraints) {
  constexpr double kOn[] = {1.0 / 6, 0.5, 5.0 / 6};
  const Eigen::Index edges = constraints.cols();
  Eigen::Matrix3Xd points(3, 3 * edges);
  Eigen::MatrixXd bones(mesh.bone_weights.rows(), 3 * edges);
  for (Eigen::Index e = 0; e < edges; ++e) {
    const int i = constraints(0, e), j = constraints(1, e);
    for (int k = 0; k < 3; ++k) {
      points.col(3 * e + k) = (1 - kOn[k]) * mesh.nodes.col(i) + kOn[k] * mesh.nodes.col(j);
      bones.col(3 * e + k) = (1 - kOn[k]) * mesh.bone_weights.col(i) + kOn[k] * mesh.bone_weights.col(j);
    }
  }
  const Places places = locate(solved, rig.bone_weights, points, bones);
  Eigen::MatrixXd values = Eigen::MatrixXd::Zero(edges, tensors.cols());
  for (Eigen::Index e = 0; e < edges; ++e) {
    const Direction direction = along((mesh.nodes.col(constraints(1, e)) - mesh.nodes.col(constraints(0, e))).normalized());
    for (int k = 0; k < 3; ++k) {
      for (int c = 0; c < 4; ++c) {
        values.row(e) +=
            places.weights(c, 3 * e + k) / 3 * direction.transpose() * tensors.middleRows<6>(6 * places.nodes(c, 3 * e + k));
      }
    }
  }
  return values;
}

/// Share of the skin's area that each vertex stands for.
Eigen::VectorXd vertex_shares(const SkinnedMesh& skin) {
  Eigen::VectorXd shares = Eigen::VectorXd::Zero(skin.vertices.cols());
  for (const auto corners : skin.triangles.colwise()) {
    const Eigen::Vector3d origin = skin.vertices.col(corners[0]);
    const double area = (skin.vertices.col(corners[1]) - origin).cross(skin.vertices.col(corners[2]) - origin).norm();
    for (const int v : corners) shares[v] += area;
  }
  shares.array() += 1e-6 * shares.mean();
  return shares / shares.sum();
}

/// Adds the squared changes of the deformation over the faces between tets.
void add_jumps(const ControlMesh& mesh, Triplets& terms) {
  std::map<std::array<int, 3>, Eigen::Index> first;  // tet at a face
  std::vector<std::pair<Eigen::Index, Eigen::Index>> pairs;
  for (Eigen::Index t = 0; t < mesh.tets.cols(); ++t) {
    for (int left_out = 0; left_out < 4; ++left_out) {
      std::array<int, 3> face{};
      for (int k = 0, n = 0; k < 4; ++k) {
        if (k != left_out) face[static_cast<std::size_t>(n++)] = mesh.tets(k, t);
      }
      std::sort(face.begin(), face.end());
      const auto [place, is_new] = first.emplace(face, t);
      if (!is_new) pairs.emplace_back(place->second, t);
    }
  }
  const auto gradients = [&](Eigen::Index t) {
    Eigen::Matrix3d spans;
    for (int k = 0; k < 3; ++k) spans.col(k) = mesh.nodes.col(mesh.tets(k + 1, t)) - mesh.nodes.col(mesh.tets(0, t));
    Eigen::Matrix<double, 4, 3> result;
    result.bottomRows<3>() = spans.inverse();
    result.row(0) = -result.bottomRows<3>().colwise().sum();
    return result;
  };
  const double weight = kJumps * std::pow(mesh.cell_size.mean(), 2) / static_cast<double>(pairs.size());
  for (const auto& [a, b] : pairs) {
    Eigen::Matrix<double, 8, 3> jump;
    jump << gradients(a), -gradients(b);
    const Eigen::Matrix<double, 8, 8> products = weight * jump * jump.transpose();
    for (int r = 0; r < 8; ++r) {
      for (int c = 0; c < 8; ++c)
        terms.emplace_back(mesh.tets(r % 4, r < 4 ? a : b), mesh.tets(c % 4, c < 4 ? a : b), products(r, c));
    }
  }
}

Creature level_body(const Rig& rig, const CreatureOptions& options, int nodes) {
  CreatureOptions wished = options;
  wished.nodes = nodes;
  wished.height_m = rig.skin.vertices.row(1).maxCoeff() - rig.skin.vertices.row(1).minCoeff();  // as it is
  return make_creature({rig.skeleton, rig.skin, {}}, wished);
}

/// The target on the nodes of the level.
Motion carried_target(const Performer& solved, const Rig& rig, const Creature& level) {
  const ControlMesh& mesh = level.mesh;
  const Motion& target = solved.prepared.target;
  const Places inside = locate(solved.mesh, rig.bone_weights, mesh.nodes, mesh.bone_weights);
  const Eigen::VectorXd shares = vertex_shares(rig.skin);
  Triplets terms;
  add_jumps(mesh, terms);
  for (Eigen::Index v = 0; v < level.skin.count(); ++v) {
    for (int r = 0; r < 4; ++r) {
      for (int c = 0; c < 4; ++c) {
        terms.emplace_back(level.skin.nodes(r, v), level.skin.nodes(c, v),
                           shares[v] * level.skin.weights(r, v) * level.skin.weights(c, v));
      }
    }
  }
  const double inner = kInside / mesh.node_count();
  for (int i = 0; i < mesh.node_count(); ++i) {
    if (inside.is_inside[static_cast<std::size_t>(i)]) terms.emplace_back(i, i, inner);
  }
  Eigen::SparseMatrix<double> normal(mesh.node_count(), mesh.node_count());
  normal.setFromTriplets(terms.begin(), terms.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(normal);

  Motion carried = target;
  carried.frames.resize(3 * mesh.node_count(), target.count());
  for (Eigen::Index f = 0; f < target.count(); ++f) {
    const Eigen::Matrix3Xd skin = embedded_positions(solved.embedding, target.at(f));
    Eigen::MatrixXd right = Eigen::MatrixXd::Zero(mesh.node_count(), 3);
    for (Eigen::Index v = 0; v < skin.cols(); ++v) {
      for (int r = 0; r < 4; ++r)
        right.row(level.skin.nodes(r, v)) += shares[v] * level.skin.weights(r, v) * skin.col(v).transpose();
    }
    for (int i = 0; i < mesh.node_count(); ++i) {
      if (!inside.is_inside[static_cast<std::size_t>(i)]) continue;
      for (int c = 0; c < 4; ++c)
        right.row(i) += inner * inside.weights(c, i) * target.at(f).col(inside.nodes(c, i)).transpose();
    }
    carried.at(f) = factor.solve(right).transpose();
  }
  return carried;
}

/// What the patches do, for the contact points of the level: those of the same bone.
ContactSchedule carried_contacts(const ContactSchedule& solved, const Skeleton& skeleton, const Creature& level) {
  ContactSchedule contacts;
  std::vector<Eigen::Index> kept;
  for (std::size_t k = 0; k < solved.patches.size(); ++k) {
    Patch patch{solved.patches[k].name, {}, solved.patches[k].on_leg};
    for (int p = 0; p < level.contacts.bones.size(); ++p) {
      if (skeleton.names[static_cast<std::size_t>(level.contacts.bones[p])] == patch.name) patch.points.push_back(p);
    }
    if (patch.points.empty()) continue;
    contacts.patches.push_back(std::move(patch));
    contacts.state.push_back(solved.state[k]);
    kept.push_back(static_cast<Eigen::Index>(k));
  }
  contacts.sliding_x = solved.sliding_x(kept, Eigen::all);
  contacts.sliding_z = solved.sliding_z(kept, Eigen::all);
  contacts.touching.resize(level.contacts.vertices.size(), solved.touching.cols());
  return contacts;
}

/// Volume and contacts of the target as the preparation leaves them: where they are not, the body would not follow.
void project(const Creature& level, double size, PreparedTarget& prepared) {
  const PrepareOptions options;
  const physics::Scene scene = preparation_scene(level);
  const auto mark = [&](double height) {
    mark_touching(point_motion(scene.contact_points, prepared.target), height * size, prepared.contacts);
  };
  mark(options.contacts.load_height);
  const std::vector<std::vector<Hold>> holds =
      find_holds(prepared.contacts, point_motion(scene.contact_points, prepared.target));
  const Eigen::MatrixXd floor =
      floors(prepared.contacts, prepared.target.loop, options.clearance * size, options.clearance_frames);
  ShapeProjector projector(scene, level.length, true);
  Motion wanted = prepared.target;
  prepared.target = project_frames(wanted, holds, floor, projector, options.smooth_hz);
  mark(kTouching);
  for (int round = 0; round < options.rounds && !scene.gravity.isZero(0); ++round) {
    const Shift shift = find_shift(prepared.target, scene, prepared.contacts, level.length, options.support_friction);
    wanted = shifted(wanted, shift, scene.body);
    prepared.target = project_frames(wanted, holds, floor, projector, options.smooth_hz);
    fall_freely(prepared.contacts, scene, prepared.target);
    mark(kTouching);
  }
}

/// Of the clip's skin the vertices that are contact points, at the rate of the target.
Motion clip_points(const Performer& solved, const ContactPoints& contacts) {
  const MotionCurve curve(solved.clip_skin);
  Motion points = solved.clip_points;
  points.frames.resize(3 * contacts.vertices.size(), points.count());
  Eigen::Matrix3Xd x, v;
  for (Eigen::Index f = 0; f < points.count(); ++f) {
    curve.at(static_cast<double>(f) / points.rate_hz, x, v);
    points.at(f) = x(Eigen::all, contacts.vertices);
  }
  return points;
}

/// The ground's forces [N] on the nodes in a frame: the least inside the friction cones that bear the target's weight and
/// inertia.
Eigen::Matrix3Xd ground_forces(const physics::Scene& scene, const ContactSchedule& contacts, double length,
                               const physics::State& state, const Eigen::Matrix3Xd& acceleration, Eigen::Index f) {
  const physics::Body& body = scene.body;
  Eigen::Matrix3Xd nodes = Eigen::Matrix3Xd::Zero(3, body.node_count());
  const std::vector<ContactGenerator> generators =
      contact_generators(contacts, f, scene.ground.friction, PrepareOptions().support_friction);
  if (generators.empty()) return nodes;
  const int count = static_cast<int>(generators.size());
  const double weight = body.mass.sum() * scene.gravity.norm();
  const Eigen::Vector3d com = physics::centre_of_mass(body, state.x);
  Eigen::Matrix<double, 6, 1> wanted = Eigen::Matrix<double, 6, 1>::Zero();
  for (int i = 0; i < body.node_count(); ++i) {
    const Eigen::Vector3d force = body.mass[i] * (acceleration.col(i) - scene.gravity);
    wanted.head<3>() += force / weight;
    wanted.tail<3>() += (state.x.col(i) - com).cross(force) / (weight * length);
  }
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(6 + count, count);
  for (int k = 0; k < count; ++k) {
    const ContactGenerator& generator = generators[static_cast<std::size_t>(k)];
    rows.col(k).head<3>() = kGroundBalance * generator.force;
    rows.col(k).segment<3>(3) =
        kGroundBalance * (scene.contact_points.of(state.x, generator.point) - com).cross(generator.force) / length;
  }
  rows.bottomRows(count).diagonal().setOnes();
  BoundedLeastSquares problem;
  problem.jacobian = rows.sparseView();
  problem.target = Eigen::VectorXd::Zero(6 + count);
  problem.target.head<6>() = kGroundBalance * wanted;
  problem.lower = Eigen::VectorXd::Zero(count);
  problem.upper = Eigen::VectorXd::Constant(count, std::numeric_limits<double>::infinity());
  problem.row_blocks = {0, 6};
  for (int k = 0; k < count; ++k) problem.row_blocks.push_back(7 + k);
  for (int k = 0; k <= count; ++k) problem.column_blocks.push_back(k);
  const Eigen::VectorXd given = solve(problem, Eigen::VectorXd::Constant(count, 1e-3)).x;
  for (int k = 0; k < count; ++k) {
    const ContactGenerator& generator = generators[static_cast<std::size_t>(k)];
    for (Eigen::Index c = 0; c < scene.contact_points.nodes.rows(); ++c) {
      nodes.col(scene.contact_points.nodes(c, generator.point)) +=
          scene.contact_points.weights(c, generator.point) * weight * given[k] * generator.force;
    }
  }
  return nodes;
}

/// Changes activations (E x F) as little as lets the level hold its own target against weight, inertia and the ground's
/// forces, frame by frame: what a mesh makes of a field is not to the newton what another does. min |W (A^-1 T^2 (r + B
/// d))|^2 + eps |d|^2 with the force r that is left at the target, A = M + T D + T^2 K and W by mass, by conjugate
/// gradients. Source: Paige, Saunders, "LSQR", ACM TOMS 1982, for damped least squares without their matrix.
void even_out(const Performer& level, Eigen::MatrixXd& activation) {
  const physics::Scene& scene = level.scene;
  const physics::Body& body = scene.body;
  const Motion& target = level.prepared.target;
  const Eigen::MatrixXd speeds = velocities(target), pulls = accelerations(target);
  physics::InternalForces<3> forces(body);
  physics::SystemMatrix matrix(body);
  const double square = kHorizon * kHorizon, effort = kEffort / body.edge_count();
  Eigen::VectorXd rows(3 * body.node_count());  // W T^2
  for (int i = 0; i < body.node_count(); ++i)
    rows.segment<3>(3 * i).setConstant(square * std::sqrt(body.mass[i] / body.mass.sum()) / (kMissUnit * level.length));
  Eigen::MatrixXd column(rows.size(), 1);
  for (Eigen::Index f = 0; f < target.count(); ++f) {
    const physics::State state{target.at(f), speeds.col(f).reshaped(3, body.node_count()), {}};
    const Eigen::Matrix3Xd acceleration = pulls.col(f).reshaped(3, body.node_count());
    forces.set_activation(activation.col(f));
    Eigen::Matrix3Xd left = ground_forces(scene, level.prepared.contacts, level.length, state, acceleration, f);
    forces.add_forces(state, left);
    for (int i = 0; i < body.node_count(); ++i) left.col(i) += body.mass[i] * (scene.gravity - acceleration.col(i));
    matrix.set_zero();
    matrix.add_mass(body, 1);
    matrix.add_damping(body, state.x, kHorizon);
    forces.add_stiffness(state.x, square, matrix);
    if (!matrix.factor()) continue;
    const Eigen::SparseMatrix<double> b = forces.force_per_activation(state.x);
    const auto miss_of = [&](const Eigen::VectorXd& force) -> Eigen::VectorXd {
      column = force;
      matrix.solve_in_place(column);
      return rows.cwiseProduct(column.col(0));
    };
    const auto back = [&](const Eigen::VectorXd& miss) -> Eigen::VectorXd {
      column = rows.cwiseProduct(miss);
      matrix.solve_in_place(column);
      return b.transpose() * column.col(0);
    };
    Eigen::VectorXd miss = -miss_of(left.reshaped()), change = Eigen::VectorXd::Zero(body.edge_count());
    Eigen::VectorXd slope = back(miss), way = slope;
    double steepness = slope.squaredNorm();
    const double enough = kLeastSlope * kLeastSlope * steepness;
    for (int round = 0; round < kRounds && steepness > enough; ++round) {
      const Eigen::VectorXd moved = miss_of(b * way);
      const double step = steepness / (moved.squaredNorm() + effort * way.squaredNorm());
      change += step * way;
      miss -= step * moved;
      slope = back(miss) - effort * change;
      const double before = steepness;
      steepness = slope.squaredNorm();
      way = slope + steepness / before * way;
    }
    activation.col(f) += change;
  }
}

SignalSet carried_signals(const Performer& solved, const SignalSet& signals, const Rig& rig, const Performer& level) {
  const physics::Body& body = level.scene.body;
  const Eigen::MatrixXd activation = signal::synthesise_samples(signals.activation, signals.samples()).transpose();
  const Eigen::MatrixXd loads = activation.cwiseAbs2() - squared_stretches(solved.scene.body, solved.prepared.target);
  const Eigen::MatrixXd tensors = tensors_along(solved.scene.body.rest, solved.scene.body.edges, loads);
  const Eigen::MatrixXd stretches = squared_stretches(body, level.prepared.target);
  Eigen::MatrixXd carried =
      (stretches + evaluate(tensors, solved.mesh, rig, level.mesh, body.edges)).cwiseMax(kLeastSquare).cwiseSqrt();
  even_out(level, carried);
  carried = carried.cwiseMax(1 - signals.limit).cwiseMin(1 + signals.limit).eval();
  const Eigen::MatrixXd lengths = (stretches.cwiseSqrt().transpose() * body.rest_length.asDiagonal()).eval();
  const SolvedSignals result{signals.kind(),
                             signals.period_s,
                             signals.limit,
                             carried.transpose(),
                             penalty_forces(carried.transpose(), lengths, body.rest_length, body.edge_stiffness),
                             level.muscles.edge_bone,
                             body.edges,
                             body.rest_length,
                             body.edge_stiffness};
  SignalOptions options;
  options.harmonics = signals.activation.harmonics();
  SignalSet set = analyse_signals(result, options);
  set.layers = signals.layers;
  return set;
}

}  // namespace

Eigen::MatrixXd tensors_along(const Eigen::Ref<const Eigen::Matrix3Xd>& rest,
                              const Eigen::Ref<const Eigen::Matrix2Xi>& edges,
                              const Eigen::Ref<const Eigen::MatrixXd>& values) {
  Triplets terms;
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(6 * rest.cols(), values.cols());
  for (Eigen::Index e = 0; e < edges.cols(); ++e) {
    const int ends[] = {edges(0, e), edges(1, e)};
    const Direction row = 0.5 * along((rest.col(ends[1]) - rest.col(ends[0])).normalized());
    for (const int i : ends) {
      right.middleRows<6>(6 * i) += row * values.row(e);
      for (const int j : ends) {
        for (int r = 0; r < 6; ++r) {
          for (int c = 0; c < 6; ++c) {
            const double calm = r == c ? (i == j ? kFieldCalm : -kFieldCalm) : 0;
            terms.emplace_back(6 * i + r, 6 * j + c, row[r] * row[c] + calm);
          }
        }
      }
    }
  }
  Eigen::SparseMatrix<double> normal(6 * rest.cols(), 6 * rest.cols());
  normal.setFromTriplets(terms.begin(), terms.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(normal);
  return factor.solve(right);
}

double frame_work_ms(const physics::Scene& scene, Eigen::Index muscles, const ReplayOptions& options) {
  constexpr double kFrame = 1.0 / 60, kSettling = 0.1;  // [s]
  ScenarioOf<3> scenario;
  scenario.scene = scene;
  scenario.start = {scene.body.rest, Eigen::Matrix3Xd::Zero(3, scene.body.node_count()), {}};
  SimulationOptions simulation;
  simulation.method = options.method;
  simulation.dt_s = options.step_s;
  simulation.duration_s = options.step_s * std::ceil(kSettling / options.step_s);
  simulation.figures = false;
  const Simulation run = simulate(scenario, simulation);
  const double corrections = options.correct ? kFrame / (options.step_s * options.steps_per_control) : 0;
  return counted_ms(scene, options.method, run.work) / simulation.duration_s * kFrame +
         corrections * counted_ms_of_correction(scene, muscles);
}

std::vector<LevelCost> level_costs(const Performer& solved, const Rig& rig, const CreatureOptions& options,
                                   const ReplayOptions& replay) {
  constexpr int kFewest = 20;
  std::vector<LevelCost> costs;
  for (const double factor : {4.0, 2.0, 1.0, 0.5, 0.25}) {
    const Eigen::Index muscles = solved.muscles.fields.cols();
    LevelCost cost{0, solved.mesh.node_count(), 0};
    if (factor == 1) {
      cost.work_ms = frame_work_ms(solved.scene, muscles, replay);
    } else {
      cost.wished = std::max(kFewest, static_cast<int>(std::lround(factor * cost.nodes)));
      const Creature creature = level_body(rig, options, cost.wished);
      cost.nodes = creature.mesh.node_count();
      cost.work_ms = frame_work_ms(creature.scene, muscles, replay);
    }
    if (costs.empty() || cost.nodes < costs.back().nodes) costs.push_back(cost);
  }
  return costs;
}

Level at_level(const Performer& solved, const SignalSet& signals, const Rig& rig, const CreatureOptions& options) {
  Creature creature = level_body(rig, options, options.nodes);
  creature.scene.ground = solved.scene.ground;
  creature.scene.gravity = solved.scene.gravity;
  Level level;
  Performer& performer = level.performer;
  performer = solved;
  performer.embedding = creature.skin;
  performer.mesh = creature.mesh;
  performer.contacts = creature.contacts;
  performer.scene = creature.scene;
  performer.muscles = make_muscles(creature.scene.body, rig.skeleton, creature.mesh.bone_weights);
  performer.prepared.target = carried_target(solved, rig, creature);
  performer.prepared.contacts = carried_contacts(solved.prepared.contacts, rig.skeleton, creature);
  project(creature, solved.size, performer.prepared);
  performer.clip_points = clip_points(solved, creature.contacts);
  SelfContactPlan plan = plan_self_contact(performer);
  performer.scene.self_contact = std::move(plan.settings);
  performer.self_contact_reason = std::move(plan.reason);
  level.signals = carried_signals(solved, signals, rig, performer);
  return level;
}

}  // namespace hydrostat::retarget
