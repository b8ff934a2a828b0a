#include "retarget/needed_strain.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace hydrostat::retarget {
namespace {

constexpr double kNeedShare = 0.99;  // of a clip's strains that the limit should hold

}  // namespace

double needed_strain(const physics::Body& body, const Motion& nodes) {
  std::vector<double> strains;
  for (Eigen::Index f = 0; f < nodes.count(); ++f) {
    const auto x = nodes.at(f);
    for (int e = 0; e < body.edge_count(); ++e) {
      strains.push_back(std::abs((x.col(body.edges(1, e)) - x.col(body.edges(0, e))).norm() / body.rest_length[e] - 1));
    }
  }
  const auto place = strains.begin() + static_cast<long>(kNeedShare * static_cast<double>(strains.size() - 1));
  std::nth_element(strains.begin(), place, strains.end());
  return *place;
}

}  // namespace hydrostat::retarget
