#include "physics/dashpot_stages.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "physics/wide.h"

namespace hydrostat::physics {
namespace {

constexpr std::size_t kUsualStages = 32;  // up to which nothing is allocated later

template <int Dim>
Lanes lanes_of(const PointsOf<Dim>& points, int column) {
  const double* const at = points.col(column).data();
  return Lanes(Lanes::Vector{at[0], at[1], Dim == 3 ? at[Dim - 1] : 0.0, 0.0});
}

/// Scalar products of four pairs.
inline Lanes products(const Lanes (&a)[Lanes::kCount], const Lanes (&b)[Lanes::kCount]) {
  return Lanes(Lanes::Vector{sum_of(a[0] * b[0]), sum_of(a[1] * b[1]), sum_of(a[2] * b[2]), sum_of(a[3] * b[3])});
}

}  // namespace

template <int Dim>
DashpotStages<Dim>::DashpotStages(const BodyOf<Dim>& body)
    : body_(body),
      inverse_mass_(inverse_masses(body)),
      nodes_(static_cast<std::size_t>(body.node_count())),
      courses_(nodes_.size()),
      blocks_(static_cast<std::size_t>(body.node_count())) {
  stages_.reserve(kUsualStages);
  // Neighbours in the body's list share nodes, whose sums would have to wait for each other.
  const int quarter = (body.edge_count() + Lanes::kCount - 1) / Lanes::kCount;
  for (int first = 0; first < quarter; ++first) {
    for (int e = first; e < body.edge_count(); e += quarter) {
      if (body.edge_damping[e] == 0) continue;
      edges_.push_back({body.edges(0, e), body.edges(1, e)});
      damping_.push_back(body.edge_damping[e]);
    }
  }
  while (edges_.size() % Lanes::kCount != 0) {
    edges_.push_back({0, 0});
    damping_.push_back(0);
  }
  along_.resize(edges_.size());
  turning_.resize(edges_.size());
  most_at_rest_ = most_at_a_node(body.rest);
}

/// Largest eigenvalue of any node's own block of M^-1 D [1/s].
template <int Dim>
double DashpotStages<Dim>::most_at_a_node(const PointsOf<Dim>& x) {
  for (auto& block : blocks_) block.setZero();
  for (std::size_t e = 0; e < edges_.size(); ++e) {
    const VectorOf<Dim> span = x.col(edges_[e].high) - x.col(edges_[e].low);
    const double squared = span.squaredNorm();
    if (squared == 0) continue;
    const Eigen::Matrix<double, Dim, Dim> block = (damping_[e] / squared) * span * span.transpose();
    blocks_[static_cast<std::size_t>(edges_[e].low)] += block;
    blocks_[static_cast<std::size_t>(edges_[e].high)] += block;
  }
  double most = 0;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, Dim, Dim>> solver;
  for (int i = 0; i < body_.node_count(); ++i) {
    const Eigen::Matrix<double, Dim, Dim>& block = blocks_[static_cast<std::size_t>(i)];
    if (inverse_mass_[i] * block.trace() <= most) continue;  // no eigenvalue is above the sum of all
    solver.computeDirect(block, Eigen::EigenvaluesOnly);
    most = std::max(most, inverse_mass_[i] * solver.eigenvalues()[Dim - 1]);
  }
  return most;
}

template <int Dim>
double DashpotStages<Dim>::stiffening(const PointsOf<Dim>& x) {
  return std::max(1.0, most_at_a_node(x) / most_at_rest_);
}

template <int Dim>
void DashpotStages<Dim>::set_stages(int stages) {
  if (static_cast<int>(stages_.size()) == stages) return;
  stages_.clear();
  const auto weight = [](int j) { return j < 2 ? 1.0 / 3 : (j * j + j - 2.0) / (2.0 * j * (j + 1)); };
  const double scale = 2 / reach(stages);
  const auto time = [&](int j) { return (j == 1 ? reach(2) / 3 : reach(j)) / reach(stages); };
  stages_.push_back({0, 0, 0, weight(1) * scale, 0});
  for (int j = 2; j <= stages; ++j) {
    const double last = (2.0 * j - 1) / j * weight(j) / weight(j - 1), before = -(j - 1.0) / j * weight(j) / weight(j - 2);
    stages_.push_back({time(j - 1), last, before, last * scale, (weight(j - 1) - 1) * last * scale});
  }
}

/// From places in the nodes' velocities. An edge that turns comes to lie so that |across|^2 / l more of its ends' velocity a second is
/// along it; until half a substep from now never more than the whole.
template <int Dim>
void DashpotStages<Dim>::set_edges(double h) {
  const Node* const nodes = nodes_.data();
  const Course* const courses = courses_.data();
  for (std::size_t e = 0; e < edges_.size(); e += Lanes::kCount) {
    const Ends* const four = edges_.data() + e;
    const double* const damping = damping_.data() + e;
    Lanes span[Lanes::kCount], rate[Lanes::kCount];
    for (int k = 0; k < Lanes::kCount; ++k) {
      span[k] = nodes[four[k].high].velocity - nodes[four[k].low].velocity;
      rate[k] = courses[four[k].high].start - courses[four[k].low].start;
    }
    const Lanes squared = products(span, span), along = products(span, rate);
    Lanes root = sqrt(Lanes(Lanes::Vector{damping[0], damping[1], damping[2], damping[3]}) / squared);
    const Lanes across = products(rate, rate) - along * along / squared;
    const Lanes turning = where_positive(squared, root * across / sqrt(1.0 + (0.25 * h * h) * across / squared), Lanes(0.0));
    root = where_positive(squared, root, Lanes(0.0));  // without a length no direction
    for (int k = 0; k < Lanes::kCount; ++k) {
      along_[e + static_cast<std::size_t>(k)] = Lanes(root[k]) * span[k];
      turning_[e + static_cast<std::size_t>(k)] = turning[k];
    }
  }
}

/// `time` [s] from when the edges lie at their places.
template <int Dim>
void DashpotStages<Dim>::add_forces(double time) {
  Node* const nodes = nodes_.data();
  for (std::size_t e = 0; e < edges_.size(); ++e) {
    Node &low = nodes[edges_[e].low], &high = nodes[edges_[e].high];
    const Lanes pull = (sum_of((high.velocity - low.velocity) * along_[e]) + time * turning_[e]) * along_[e];
    low.force += pull;
    high.force -= pull;
  }
}

/// In momentum that comes in, so that what all nodes get sums to the constant forces' impulse in every stage.
template <int Dim>
void DashpotStages<Dim>::integrate(double h) {
  set_edges(h);
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    nodes_[i] = {courses_[i].start, courses_[i].constant};
    courses_[i].impulse = courses_[i].last_impulse = Lanes(0.0);
  }
  for (std::size_t j = 0; j < stages_.size(); ++j) {
    add_forces((stages_[j].time - 0.5) * h);
    const Lanes last(stages_[j].last), before(stages_[j].before), rate(h * stages_[j].rate), first_rate(h * stages_[j].first_rate);
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      Node& node = nodes_[i];
      Course& course = courses_[i];
      if (j == 0) course.first_force = node.force;
      const Lanes next = last * course.impulse + before * course.last_impulse + rate * node.force + first_rate * course.first_force;
      course.last_impulse = course.impulse;
      course.impulse = next;
      node = {course.start + Lanes(inverse_mass_[static_cast<Eigen::Index>(i)]) * next, course.constant};
    }
  }
}

template <int Dim>
HYDROSTAT_FLATTEN void DashpotStages<Dim>::integrate_here(double h) {
  integrate(h);
}

#ifdef HYDROSTAT_WIDE
template <int Dim>
HYDROSTAT_WIDE void DashpotStages<Dim>::integrate_wide(double h) {
  integrate(h);
}
#endif

template <int Dim>
void DashpotStages<Dim>::add_mean_forces(const PointsOf<Dim>& x, const PointsOf<Dim>& v, double h, int stages, PointsOf<Dim>& force) {
  set_stages(stages);
  for (int i = 0; i < body_.node_count(); ++i) {
    const auto n = static_cast<std::size_t>(i);
    courses_[n].start = lanes_of<Dim>(v, i);
    courses_[n].constant = lanes_of<Dim>(force, i);
    nodes_[n].velocity = lanes_of<Dim>(x, i);  // until the edges know where they lie
  }
#ifdef HYDROSTAT_WIDE
  static const bool is_wide = processor_is_wide();
  is_wide ? integrate_wide(h) : integrate_here(h);
#else
  integrate_here(h);
#endif
  const double rate = 1 / h;
  for (int i = 0; i < body_.node_count(); ++i) {
    const Lanes& impulse = courses_[static_cast<std::size_t>(i)].impulse;
    for (int k = 0; k < Dim; ++k) force(k, i) = rate * impulse[k];
  }
}

template class DashpotStages<2>;
template class DashpotStages<3>;

}  // namespace hydrostat::physics
