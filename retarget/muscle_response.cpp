#include "retarget/muscle_response.h"

#include <Eigen/Geometry>
#include <Eigen/LU>

namespace hydrostat::retarget {
namespace {

constexpr std::size_t kMostChanges = 30;  // directions that come or go before the system is made anew

/// In how many directions a point is held.
int directions_held(ContactState state) {
  if (state == ContactState::kOff) return 0;
  return state == ContactState::kStick ? 3 : 1;
}

}  // namespace

MuscleResponse::MuscleResponse(const physics::Scene& scene, const Muscles& muscles, double horizon_s, double contact_stiffness,
                               Eigen::VectorXd node_shares)
    : scene_(scene),
      muscles_(muscles),
      horizon_s_(horizon_s),
      contact_stiffness_(contact_stiffness),
      node_shares_(std::move(node_shares)),
      matrix_(scene.body) {
  find_fields();
}

void MuscleResponse::find_fields() {
  for (const auto field : muscles_.fields.colwise()) {
    std::vector<int>& springs = springs_of_.emplace_back();
    for (int e = 0; e < scene_.body.edge_count(); ++e) {
      if (field[e] != 0 && scene_.body.edge_stiffness[e] != 0) springs.push_back(e);
    }
  }
  for (const physics::BodyElements<3>& elements : scene_.body.elements) {
    std::vector<ElementFields>& all = element_fields_.emplace_back();
    for (const auto pairs : elements.fit.of_element.colwise()) {
      const Eigen::MatrixXd rows = muscles_.fields(pairs, Eigen::all);
      ElementFields& element = all.emplace_back();
      for (Eigen::Index k = 0; k < rows.cols(); ++k) {
        if (!rows.col(k).isZero(0)) element.muscles.push_back(k);
      }
      element.fields = rows(Eigen::all, element.muscles);
    }
  }
}

bool MuscleResponse::update(const physics::State& state, physics::InternalForces<3>& forces,
                            const std::vector<ContactState>& touching, int calls) {
  bool keeps = is_made_ && ++age_ < calls;
  if (keeps && touching == touching_now_) return true;
  touching_now_ = touching;
  if (keeps) {
    find_changes(touching);
    keeps = changes_.size() <= kMostChanges;
  }
  if (!keeps) {
    is_made_ = make(state, forces, touching);
    if (!is_made_) return false;
    changes_.clear();
    age_ = 0;
  }
  apply_changes();
  return true;
}

bool MuscleResponse::make(const physics::State& state, physics::InternalForces<3>& forces,
                          const std::vector<ContactState>& touching) {
  if (!factor(state, forces, touching)) return false;
  touching_ = touching;
  made_.setZero(3 * scene_.body.node_count(), muscles_.fields.cols());
  add_springs(state);
  add_elements(state, forces);
  matrix_.solve_in_place(made_);
  is_normal_made_ = false;
  return true;
}

bool MuscleResponse::factor(const physics::State& state, physics::InternalForces<3>& forces,
                            const std::vector<ContactState>& touching) {
  const double th = horizon_s_;
  matrix_.set_zero();
  matrix_.add_mass(scene_.body, 1);
  matrix_.add_damping(scene_.body, state.x, th);
  forces.add_stiffness(state.x, th * th, matrix_);
  const Eigen::Matrix3d stick_block = th * th * contact_stiffness_ * Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d slide_block = th * th * contact_stiffness_ * scene_.ground.normal * scene_.ground.normal.transpose();
  for (int p = 0; p < scene_.contact_points.count(); ++p) {
    const ContactState state_of_point = touching[static_cast<std::size_t>(p)];
    if (state_of_point == ContactState::kOff) continue;
    matrix_.add_contact(scene_.contact_points, p, state_of_point == ContactState::kStick ? stick_block : slide_block);
  }
  return matrix_.factor();
}

/// Adds th B phi for each muscle to its column.
void MuscleResponse::add_springs(const physics::State& state) {
  const physics::Body& body = scene_.body;
  pull_.resize(3, body.edge_count());
  for (int e = 0; e < body.edge_count(); ++e) {
    pull_.col(e) = horizon_s_ * body.edge_stiffness[e] * body.rest_length[e] *
                   (state.x.col(body.edges(1, e)) - state.x.col(body.edges(0, e))).normalized();
  }
  for (std::size_t k = 0; k < springs_of_.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    for (const int e : springs_of_[k]) {
      const Eigen::Vector3d push = muscles_.fields(e, column) * pull_.col(e);
      made_.col(column).segment<3>(3 * body.edges(1, e)) += push;
      made_.col(column).segment<3>(3 * body.edges(0, e)) -= push;
    }
  }
}

void MuscleResponse::add_elements(const physics::State& state, const physics::InternalForces<3>& forces) {
  for (std::size_t b = 0; b < element_fields_.size(); ++b) {
    const auto& [block, fit, materials, fill] = scene_.body.elements[b];
    for (int e = 0; e < block.element_count(); ++e) {
      const ElementFields& element = element_fields_[b][static_cast<std::size_t>(e)];
      const Eigen::MatrixXd push =
          horizon_s_ * physics::element_force_per_activation<3>(block, fit, e, state.x, forces.activation()) * element.fields;
      for (std::size_t k = 0; k < element.muscles.size(); ++k) {
        for (int n = 0; n < block.nodes_per_element(); ++n) {
          made_.col(element.muscles[k]).segment<3>(3 * block.nodes(n, e)) +=
              push.col(static_cast<Eigen::Index>(k)).segment<3>(3 * n);
        }
      }
    }
  }
}

void MuscleResponse::find_changes(const std::vector<ContactState>& touching) {
  changes_.clear();
  const Eigen::Vector3d normal = scene_.ground.normal, side = normal.unitOrthogonal(), other = normal.cross(side);
  const Eigen::Vector3d* directions[] = {&normal, &side, &other};
  for (int p = 0; p < scene_.contact_points.count(); ++p) {
    const auto k = static_cast<std::size_t>(p);
    const int now = directions_held(touching[k]), before = directions_held(touching_[k]);
    for (int d = std::min(now, before); d < std::max(now, before); ++d)
      changes_.push_back({p, now > before ? 1.0 : -1.0, *directions[d]});
  }
}

void MuscleResponse::apply_changes() {
  is_normal_current_ = false;
  if (changes_.empty()) {
    velocities_ = made_;
    return;
  }
  const physics::ContactPoints& points = scene_.contact_points;
  const auto count = static_cast<Eigen::Index>(changes_.size());
  held_.setZero(made_.rows(), count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const Change& change = changes_[static_cast<std::size_t>(k)];
    for (int c = 0; c < points.nodes.rows(); ++c)
      held_.col(k).segment<3>(3 * points.nodes(c, change.point)) += points.weights(c, change.point) * change.direction;
  }
  matrix_.solve_in_place(held_);
  Eigen::MatrixXd capacitance = along_changes(held_);
  const double stiffness = horizon_s_ * horizon_s_ * contact_stiffness_;
  for (Eigen::Index k = 0; k < count; ++k) capacitance(k, k) += changes_[static_cast<std::size_t>(k)].sign / stiffness;
  capacitance_.compute(capacitance);

  taken_ = capacitance_.solve(along_changes(made_));
  velocities_.noalias() = made_ - held_ * taken_;
}

void MuscleResponse::find_made_normal() {
  if (is_normal_made_) return;
  scaled_ = node_shares_.cwiseSqrt().asDiagonal() * made_;
  made_normal_.setZero(made_.cols(), made_.cols());
  made_normal_.selfadjointView<Eigen::Lower>().rankUpdate(scaled_.transpose());
  is_normal_made_ = true;
}

const Eigen::MatrixXd& MuscleResponse::node_normal() {
  if (is_normal_current_) return node_normal_;
  find_made_normal();
  node_normal_ = made_normal_;
  is_normal_current_ = true;
  if (changes_.empty()) return node_normal_;
  const Eigen::MatrixXd weighted = node_shares_.asDiagonal() * held_;
  const Eigen::MatrixXd half = taken_.transpose() * (weighted.transpose() * made_ - 0.5 * (weighted.transpose() * held_) * taken_);
  node_normal_.triangularView<Eigen::Lower>() -= half + half.transpose();
  return node_normal_;
}

Eigen::MatrixXd MuscleResponse::along_changes(const Eigen::MatrixXd& x) const {
  const physics::ContactPoints& points = scene_.contact_points;
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(changes_.size()), x.cols());
  for (std::size_t k = 0; k < changes_.size(); ++k) {
    const Change& change = changes_[k];
    for (int c = 0; c < points.nodes.rows(); ++c) {
      rows.row(static_cast<Eigen::Index>(k)) += points.weights(c, change.point) * change.direction.transpose() *
                                                x.middleRows<3>(3 * points.nodes(c, change.point));
    }
  }
  return rows;
}

void MuscleResponse::solve_in_place(Eigen::VectorXd& x) const {
  matrix_.solve_in_place(x);
  if (!changes_.empty()) x -= held_ * capacitance_.solve(along_changes(x));
}

}  // namespace hydrostat::retarget
