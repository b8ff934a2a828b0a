#include "physics/dashpot_stages.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "physics/wide.h"

namespace hydrostat::physics {
namespace {

constexpr std::size_t kUsualStages = 32;  // up to which nothing is allocated later

template <int Dim>
Lanes lanes_of(const double* at) {
  return Lanes(Lanes::Vector{at[0], at[1], Dim == 3 ? at[Dim - 1] : 0.0, 0.0});
}

/// Scalar products of four pairs, each summed as by sum_of: four at once by six permutations and three sums.
inline Lanes products(const Lanes (&a)[Lanes::kCount], const Lanes (&b)[Lanes::kCount]) {
  using Order = long long __attribute__((vector_size(sizeof(Lanes))));
  constexpr Order kEven{0, 4, 2, 6}, kOdd{1, 5, 3, 7}, kFirst{0, 1, 4, 5}, kLast{2, 3, 6, 7};
  const Lanes::Vector p[] = {a[0].value * b[0].value, a[1].value * b[1].value, a[2].value * b[2].value, a[3].value * b[3].value};
  const Lanes::Vector low = __builtin_shuffle(p[0], p[1], kEven) + __builtin_shuffle(p[0], p[1], kOdd);
  const Lanes::Vector high = __builtin_shuffle(p[2], p[3], kEven) + __builtin_shuffle(p[2], p[3], kOdd);
  return Lanes(__builtin_shuffle(low, high, kFirst) + __builtin_shuffle(low, high, kLast));
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
  turning_.resize(edges_.size() / Lanes::kCount);
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
    for (int k = 0; k < Lanes::kCount; ++k) along_[e + static_cast<std::size_t>(k)] = Lanes(root[k]) * span[k];
    turning_[e / Lanes::kCount] = turning;
  }
}

/// `time` [s] from when the edges lie at their places.
template <int Dim>
void DashpotStages<Dim>::add_forces(double time) {
  Node* const nodes = nodes_.data();
  const Ends* const ends = edges_.data();
  const Lanes since(time);
  for (std::size_t e = 0; e < edges_.size(); e += Lanes::kCount) {
    const Ends* const four = ends + e;
    const Lanes* const turning = turning_.data() + e / Lanes::kCount;
    Lanes rate[Lanes::kCount], along[Lanes::kCount];
    for (int k = 0; k < Lanes::kCount; ++k) {
      rate[k].value = nodes[four[k].high].velocity.value - nodes[four[k].low].velocity.value;
      along[k].value = along_[e + static_cast<std::size_t>(k)].value;
    }
    const Lanes::Vector pull = products(rate, along).value + since.value * turning->value;
    for (int k = 0; k < Lanes::kCount; ++k) {
      const Lanes one(pull[k]);
      nodes[four[k].low].force.value += one.value * along[k].value;
      nodes[four[k].high].force.value -= one.value * along[k].value;
    }
  }
}

/// In momentum that comes in, so that what all nodes get sums to the constant forces' impulse in every stage.
template <int Dim>
void DashpotStages<Dim>::integrate(const double* x, const double* v, double h, double* force) {
  Node* const nodes = nodes_.data();
  Course* const courses = courses_.data();
  const std::size_t count = nodes_.size();
  for (std::size_t i = 0; i < count; ++i) {
    courses[i].start.value = lanes_of<Dim>(v + Dim * i).value;
    courses[i].constant.value = lanes_of<Dim>(force + Dim * i).value;
    nodes[i].velocity.value = lanes_of<Dim>(x + Dim * i).value;  // until the edges know where they lie
  }
  set_edges(h);
  for (std::size_t i = 0; i < count; ++i) {
    nodes[i].velocity.value = courses[i].start.value;
    nodes[i].force.value = courses[i].constant.value;
    courses[i].impulse.value = courses[i].last_impulse.value = Lanes(0.0).value;
  }
  for (std::size_t j = 0; j < stages_.size(); ++j) {
    add_forces((stages_[j].time - 0.5) * h);
    const Lanes last(stages_[j].last), before(stages_[j].before), rate(h * stages_[j].rate), first_rate(h * stages_[j].first_rate);
    for (std::size_t i = 0; i < count; ++i) {
      Node& node = nodes[i];
      Course& course = courses[i];
      if (j == 0) course.first_force.value = node.force.value;
      const Lanes impulse(course.impulse.value);
      const Lanes next = last * impulse + before * course.last_impulse + rate * node.force + first_rate * course.first_force;
      course.last_impulse.value = impulse.value;
      course.impulse.value = next.value;
      node.velocity.value = course.start.value + Lanes(inverse_mass_[static_cast<Eigen::Index>(i)]).value * next.value;
      node.force.value = course.constant.value;
    }
  }
  const double rate = 1 / h;
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t k = 0; k < Dim; ++k) force[Dim * i + k] = rate * courses[i].impulse[static_cast<int>(k)];
  }
}

template <int Dim>
HYDROSTAT_FLATTEN void DashpotStages<Dim>::integrate_here(const double* x, const double* v, double h, double* force) {
  integrate(x, v, h, force);
}

#ifdef HYDROSTAT_WIDE
template <int Dim>
HYDROSTAT_WIDE void DashpotStages<Dim>::integrate_wide(const double* x, const double* v, double h, double* force) {
  integrate(x, v, h, force);
}
#endif

template <int Dim>
void DashpotStages<Dim>::add_mean_forces(const PointsOf<Dim>& x, const PointsOf<Dim>& v, double h, int stages, PointsOf<Dim>& force) {
  set_stages(stages);
#ifdef HYDROSTAT_WIDE
  static const bool is_wide = processor_is_wide();
  is_wide ? integrate_wide(x.data(), v.data(), h, force.data()) : integrate_here(x.data(), v.data(), h, force.data());
#else
  integrate_here(x.data(), v.data(), h, force.data());
#endif
}

template class DashpotStages<2>;
template class DashpotStages<3>;

}  // namespace hydrostat::physics
