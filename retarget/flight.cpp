#include "retarget/flight.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace hydrostat::retarget {
namespace {

constexpr double kApart = 1.5;          // of free fall's rise, or its inverse: what is nearer will pass for a jump
constexpr double kWorthTelling = 0.05;  // of L: a smaller difference is one of contact labels
constexpr double kLeastRise = 1e-3;     // of L: what rises less floats, and no size makes it fall freely

}  // namespace

std::vector<Flight> flights(const ContactSchedule& contacts, const Motion& motion,
                            const Eigen::Ref<const Eigen::Matrix3Xd>& com_path, double gravity) {
  std::vector<Flight> result;
  const Eigen::Index frames = contacts.touching.cols();
  const auto touches = [&](Eigen::Index f) { return contacts.touching.col(f % frames).any(); };
  for (Eigen::Index f = 0; f < frames; ++f) {
    if (!touches(f)) continue;
    Flight flight;
    flight.start = f;
    flight.end = f + 1;
    const Eigen::Index last = motion.loop ? f + frames : frames - 1;
    while (flight.end < last && !touches(flight.end)) ++flight.end;
    if (flight.end == f + 1 || flight.end > last || !touches(flight.end)) continue;
    flight.seconds = static_cast<double>(flight.end - f) / motion.rate_hz;
    flight.free_fall_m = gravity * flight.seconds * flight.seconds / 8;
    const double from = com_path(1, f), to = com_path(1, flight.end % frames);
    for (Eigen::Index k = f; k <= flight.end; ++k) {
      const double part = static_cast<double>(k - f) / static_cast<double>(flight.end - f);
      flight.rise_m = std::max(flight.rise_m, com_path(1, k % frames) - (from + part * (to - from)));
    }
    result.push_back(flight);
  }
  return result;
}

std::vector<std::string> flight_warnings(const std::vector<Flight>& flights, double rate_hz, double height, double length) {
  const auto difference = [](const Flight& flight) { return std::abs(flight.rise_m - flight.free_fall_m); };
  const auto worst = std::max_element(flights.begin(), flights.end(),
                                      [&](const Flight& a, const Flight& b) { return difference(a) < difference(b); });
  if (worst == flights.end() || difference(*worst) < kWorthTelling * length) return {};
  const double ratio = worst->rise_m / worst->free_fall_m;
  if (ratio < kApart && 1 / ratio < kApart) return {};
  char text[500];
  int written = std::snprintf(text, sizeof text,
                              "the clip is in the air for %.2f s (frames %ld to %ld, %.3g s on) and rises by %.3g m; free fall of that time "
                              "rises by %.3g m, and so will the creature: ",
                              worst->seconds, static_cast<long>(worst->start), static_cast<long>(worst->end),
                              static_cast<double>(worst->start) / rate_hz, worst->rise_m, worst->free_fall_m);
  const auto rest = [&] { return text + written; };
  const std::size_t room = sizeof text - static_cast<std::size_t>(written);
  if (worst->rise_m < kLeastRise * length) {
    std::snprintf(rest(), room, "it floats; put a foot on the ground there");
  } else {
    std::snprintf(rest(), room, "give --height %.2g, where time and rise agree, or let the flight last %.2f s", height / ratio,
                  worst->seconds * std::sqrt(ratio));
  }
  return {text};
}

}  // namespace hydrostat::retarget
