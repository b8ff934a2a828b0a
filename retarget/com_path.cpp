#include "retarget/com_path.h"

namespace hydrostat::retarget {

Eigen::Matrix3Xd com_path(const Motion& nodes, const Eigen::VectorXd& mass) {
  const Eigen::VectorXd shares = mass / mass.sum();
  Eigen::Matrix3Xd path(3, nodes.count());
  for (Eigen::Index f = 0; f < nodes.count(); ++f) path.col(f) = nodes.at(f) * shares;
  return path;
}

double apex_rise(const Eigen::Ref<const Eigen::Matrix3Xd>& path) {
  return path.cols() == 0 ? 0 : path.row(1).maxCoeff() - path(1, 0);
}

}  // namespace hydrostat::retarget
