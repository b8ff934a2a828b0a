#include "retarget/rest_lengths.h"

#include <algorithm>
#include <limits>

namespace hydrostat::retarget {
namespace {

constexpr double kUsual = 1e-9;  // of a natural stretch: what rounding makes of 1

double length_of(const physics::Body& body, int edge, const Eigen::Ref<const Eigen::Matrix3Xd>& x) {
  return (x.col(body.edges(1, edge)) - x.col(body.edges(0, edge))).norm();
}

struct Range {
  double least = std::numeric_limits<double>::infinity(), most = 0;

  double middle() const { return 0.5 * (least + most); }
  bool is_too_wide_about(double rest_length) const {
    return most > (1 + kMostSpringStrain) * rest_length || least < (1 - kMostSpringStrain) * rest_length;
  }
};

/// Lengths [m] that the target takes a spring through.
Range range_of(const Motion& target, const physics::Body& body, int edge) {
  Range range;
  for (Eigen::Index f = 0; f < target.count(); ++f) {
    const double length = length_of(body, edge, target.at(f));
    range.least = std::min(range.least, length);
    range.most = std::max(range.most, length);
  }
  return range;
}

/// Calls visit(edge, range) for what the target takes too far.
template <typename Visit>
void for_overstrained(const Motion& target, const physics::Body& body, const Visit& visit) {
  if (!body.elements.empty() || target.count() == 0) return;
  for (int e = 0; e < body.edge_count(); ++e) {
    const Range range = range_of(target, body, e);
    if (range.is_too_wide_about(body.rest_length[e])) visit(e, range);
  }
}

}  // namespace

double share_overstrained(const Motion& target, const physics::Body& body) {
  int count = 0;
  for_overstrained(target, body, [&](int, const Range&) { ++count; });
  return static_cast<double>(count) / std::max(1, body.edge_count());
}

void fit_rest_lengths(const Motion& target, physics::Body& body) {
  for_overstrained(target, body, [&](int edge, const Range& range) { body.rest_length[edge] = range.middle(); });
}

Eigen::VectorXd natural_stretch(const physics::Body& body) {
  Eigen::VectorXd stretch(body.edge_count());
  for (int e = 0; e < body.edge_count(); ++e) stretch[e] = body.rest_length[e] / length_of(body, e, body.rest);
  return stretch;
}

bool has_fitted_rest_lengths(const physics::Body& body) { return ((natural_stretch(body).array() - 1).abs() > kUsual).any(); }

}  // namespace hydrostat::retarget
