#include "retarget/trace.h"

#include <gtest/gtest.h>

namespace hydrostat::retarget::trace_test {
namespace {

/// Eight steps of a tenth of a second after the start; every time course counts its columns.
Trace counting_trace() {
  Trace trace;
  const Eigen::RowVectorXd count = Eigen::RowVectorXd::LinSpaced(9, 0, 8);
  trace.time_s = 0.1 * count.transpose();
  for (Eigen::MatrixXd* course : {&trace.position, &trace.velocity, &trace.contact_force, &trace.effect_force, &trace.correction_impulse}) {
    *course = count.replicate(3, 1);
  }
  trace.contact_moment = trace.effect_moment = count.replicate(3, 1);
  trace.activation = count.replicate(2, 1);
  return trace;
}

TEST(Thinned, TakesStatesAtTheEndsAndMeansOfForces) {
  const Trace thin = thinned(counting_trace(), 4);
  ASSERT_EQ(thin.count(), 3);
  EXPECT_TRUE(thin.time_s.isApprox(Eigen::Vector3d(0, 0.4, 0.8)));
  EXPECT_EQ(thin.position.row(0), Eigen::RowVector3d(0, 4, 8));
  EXPECT_EQ(thin.velocity.row(2), Eigen::RowVector3d(0, 4, 8));
  EXPECT_EQ(thin.contact_force.row(0), Eigen::RowVector3d(0, 2.5, 6.5));
  EXPECT_EQ(thin.effect_moment.row(1), Eigen::RowVector3d(0, 2.5, 6.5));
  EXPECT_EQ(thin.activation.row(1), Eigen::RowVector3d(0, 2.5, 6.5));
  EXPECT_EQ(thin.correction_impulse.row(0), Eigen::RowVector3d(0, 10, 26));
}

TEST(Thinned, LeavesOutWhatFillsNoInterval) {
  EXPECT_EQ(thinned(counting_trace(), 3).count(), 3);
  EXPECT_EQ(thinned(counting_trace(), 9).count(), 1);
  EXPECT_EQ(thinned(counting_trace(), 1).count(), 9);
  EXPECT_EQ(thinned(Trace(), 2).count(), 0);
}

TEST(Shorten, CutsEveryCourseAlike) {
  Trace trace = counting_trace();
  shorten(trace, 3);
  EXPECT_EQ(trace.count(), 3);
  for (const Eigen::MatrixXd* course : {&trace.position, &trace.velocity, &trace.contact_force, &trace.effect_force, &trace.correction_impulse}) {
    EXPECT_EQ(course->row(0), Eigen::RowVector3d(0, 1, 2));
  }
  EXPECT_EQ(trace.contact_moment.row(2), Eigen::RowVector3d(0, 1, 2));
  EXPECT_EQ(trace.effect_moment.cols(), 3);
  EXPECT_EQ(trace.activation.cols(), 3);
}

}  // namespace
}  // namespace hydrostat::retarget::trace_test
