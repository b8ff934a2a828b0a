#pragma once

#include <Eigen/Core>
#include <string>

#include "retarget/motion.h"

namespace hydrostat::retarget {

struct Performer;

/// Flesh that swings over what a creature's control mesh carries: vibration modes of a finer mesh, each a damped oscillator
/// that the body's own motion drives. An effect of the picture: nothing of it acts back on the body. Without modes it is off.
struct Wobble {
  Eigen::MatrixXd shapes;        // 3V x K [-]: offsets of the skin's vertices, in the bind pose, the largest of each mode 1
  Eigen::VectorXd frequency_hz;  // K, ascending
  Eigen::MatrixXd drive;         // 3N x K [-]: how much of the load at a control node, in the node's frame, drives a mode
  Eigen::VectorXd mean_load;     // K [m/s2]: what the target drives it by on average, which the skin as it is drawn bears
  Eigen::VectorXd most;          // K [m]: amplitude at which the skin is sheared as far as it may be
  Eigen::MatrixX2d start;        // K x 2, amplitude [m] and its speed [m/s] with which a replay begins
  std::string reason = "nobody asked for it";  // why it is on or off

  Eigen::Index count() const { return frequency_hz.size(); }
  bool is_on() const { return count() > 0; }
};

/// Share of critical damping of every mode. Source: Wakeling and Nigg, "Modification of soft tissue vibrations in the leg by
/// muscular activity", Journal of Applied Physiology 90, 2001, who find free vibrations of the leg's soft tissues heavily
/// damped; the number is ours.
constexpr double kWobbleDamping = 0.15;

/// Amplitude and speed of an oscillator q'' + 2 d w q' + w^2 q = a over a step h [s] in which a goes straight from a0 to a1
/// [m/s2]: exact, for any step; w > 0 [rad/s], 0 < d < 1.
/// Source: Nigam and Jennings, "Calculation of response spectra from strong-motion earthquake records", BSSA 59, 1969.
Eigen::Vector2d oscillated(const Eigen::Vector2d& from, double w, double d, double h, double a0, double a1);

/// The loads [m/s2] that a motion of the control nodes, 3N x F, drives the modes by, K x F, mean_load not taken out: gravity
/// less acceleration at each node, in the frame that the node's neighbours have turned by.
Eigen::MatrixXd wobble_loads(const Wobble& wobble, const Performer& performer, const Motion& motion);

/// Amplitudes [m] of the modes, K x F, from `wobble.start` on, as the oscillators have them: not limited.
Eigen::MatrixXd swung(const Wobble& wobble, const Eigen::MatrixXd& loads, double rate_hz);

/// Scales amplitudes of one frame (K) so that their shares of `most` sum to less than 1; what is small stays as it is.
void limit_wobble(const Wobble& wobble, Eigen::Ref<Eigen::VectorXd> amplitudes);

/// The amplitudes of a replay, K x F, limited, and scaled down in frames where they would push skin under the ground.
Eigen::MatrixXd wobble_of(const Performer& performer, const Motion& motion);

}  // namespace hydrostat::retarget
