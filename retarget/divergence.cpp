#include "retarget/divergence.h"

#include <cstdio>

namespace hydrostat::retarget {

template <int Dim>
std::string divergence_cause(const physics::BodyOf<Dim>& body, const physics::StateOf<Dim>& state, physics::Method method, double dt_s,
                             double time_s) {
  char text[200];
  std::snprintf(text, sizeof text,
                "at %.3f s no step of %.4g s by the method '%s' led to a finite state; before it the fastest node moved at %.3g m/s and %ld "
                "elements were inverted",
                time_s, dt_s, physics::name_of(method).c_str(), state.v.colwise().norm().maxCoeff(),
                static_cast<long>((physics::jacobians(body, state.x).array() <= 0).count()));
  return text;
}
template std::string divergence_cause<2>(const physics::BodyOf<2>&, const physics::StateOf<2>&, physics::Method, double, double);
template std::string divergence_cause<3>(const physics::BodyOf<3>&, const physics::StateOf<3>&, physics::Method, double, double);

}  // namespace hydrostat::retarget
