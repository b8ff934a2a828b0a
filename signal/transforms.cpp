#include "signal/transforms.h"

#include <fftw3.h>

#include <cassert>
#include <mutex>

namespace hydrostat::signal {

namespace {

Eigen::MatrixXd transformed(const Eigen::Ref<const Eigen::MatrixXd>& samples, fftw_r2r_kind kind) {
  assert(samples.rows() > 0);
  Eigen::MatrixXd data = samples;
  if (data.cols() == 0) return data;
  static std::mutex planner;  // FFTW plans for one thread at a time; only execution is free of it
  const int n = static_cast<int>(data.rows());
  // An estimated plan that assumes no alignment depends on nothing but n and C: same bits on every run.
  const auto make_plan = [&] {
    const std::lock_guard lock(planner);
    return fftw_plan_many_r2r(1, &n, static_cast<int>(data.cols()), data.data(), nullptr, 1, n, data.data(), nullptr, 1, n,
                              &kind, FFTW_ESTIMATE | FFTW_UNALIGNED);
  };
  const fftw_plan plan = make_plan();
  assert(plan != nullptr);
  fftw_execute(plan);
  const std::lock_guard lock(planner);
  fftw_destroy_plan(plan);
  return data;
}

}  // namespace

Eigen::MatrixXd real_fourier_transform(const Eigen::Ref<const Eigen::MatrixXd>& samples) {
  return transformed(samples, FFTW_R2HC);
}

Eigen::MatrixXd cosine_transform(const Eigen::Ref<const Eigen::MatrixXd>& samples) {
  return transformed(samples, FFTW_REDFT10);
}

}  // namespace hydrostat::signal
