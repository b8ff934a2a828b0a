#include "retarget/prepare.h"

#include "retarget/needed_strain.h"
#include "retarget/smooth.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>

#include "tests/retarget/box_creature.h"

namespace hydrostat::retarget::prepare_test {
namespace {

double volume_error_rms(const physics::Body& body, const Motion& motion) {
  double squared = 0;
  for (Eigen::Index f = 0; f < motion.count(); ++f) {
    squared += (physics::jacobians(body, motion.at(f)).array() - 1).square().mean() / static_cast<double>(motion.count());
  }
  return std::sqrt(squared);
}

/// Of the centre of mass [m/s2], 3 x F.
Eigen::MatrixXd com_acceleration(const physics::Body& body, const Motion& motion) {
  Motion com = motion;
  com.frames.resize(3, motion.count());
  for (Eigen::Index f = 0; f < motion.count(); ++f) com.frames.col(f) = physics::centre_of_mass(body, motion.at(f));
  return accelerations(com);
}

/// A loop of 36 frames: 18 on the ground, then an arc of the whole body, drawn as an animator would and not as gravity does.
Motion hopping(const BoxCreature& creature) {
  return played(creature, 36, true, [](const Eigen::Vector3d& x, Eigen::Index f) {
    const double rise = f < 18 ? 0 : 0.12 * std::pow(std::sin(M_PI * static_cast<double>(f - 18) / 18), 2);
    const double squat = f < 18 ? 0.06 * std::pow(std::sin(M_PI * static_cast<double>(f) / 18), 2) : 0;
    return Eigen::Vector3d(x.x(), x.y() * (1 - squat) + rise, x.z());
  });
}

TEST(Smooth, KeepsStraightLines) {
  for (const bool loop : {false, true}) {
    Motion motion;
    motion.loop = loop;
    motion.frames.resize(6, 30);
    const Eigen::Vector3d speed(0.3, loop ? 0 : 0.2, -0.7);
    for (int f = 0; f < 30; ++f) {
      motion.frames.col(f).head<3>() = Eigen::Vector3d(1, 2, 3) + f / 60.0 * speed;
      motion.frames.col(f).tail<3>() = Eigen::Vector3d(-1, 0, 1) + f / 60.0 * speed;
    }
    if (loop) motion.travel = 0.5 * speed;
    EXPECT_LT((smooth(motion, 10).frames - motion.frames).cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(Smooth, HalvesTheAmplitudeAtTheCutOff) {
  const auto gain = [](double hz, double cutoff) {
    Motion motion;
    motion.loop = true;
    motion.frames.resize(3, 60);
    for (int f = 0; f < 60; ++f) motion.frames.col(f).setConstant(std::sin(2 * M_PI * hz * f / 60));
    return smooth(motion, cutoff).frames.norm() / motion.frames.norm();
  };
  for (const double cutoff : {4.0, 6.0, 10.0, 15.0}) {
    SCOPED_TRACE("cut-off " + std::to_string(cutoff));
    EXPECT_NEAR(gain(cutoff, cutoff), 0.5, 1e-3);
    EXPECT_GT(gain(std::floor(cutoff / 2), cutoff), 0.95);
    EXPECT_LT(gain(std::min(29.0, 2 * cutoff), cutoff), 0.13);
  }
}

TEST(Prepare, LeavesABodyThatStandsAlone) {
  const BoxCreature creature = make_box_creature();
  const Motion motion = standing(creature, 12);
  const PreparedTarget target = prepared(creature, motion);
  EXPECT_LT((target.target.frames - motion.frames).cwiseAbs().maxCoeff(), 1e-5 * BoxCreature::kLength);
  EXPECT_LT(target.report.missing_wrench_max_mg, 1e-3);
  EXPECT_EQ(target.report.flight_s, 0);
  EXPECT_EQ(target.contacts.patches.size(), 4u);
}

TEST(Prepare, BringsTheVolumeBack) {
  const BoxCreature creature = make_box_creature();
  const Motion motion = bobbing(creature, 30, 0.06);
  const PreparedTarget target = prepared(creature, motion);
  const double before = volume_error_rms(creature.scene.body, motion), after = volume_error_rms(creature.scene.body, target.target);
  EXPECT_GT(before, 0.03);
  EXPECT_LT(after, before / 5);
  EXPECT_NEAR(after, target.report.volume_error_rms, 1e-12);
  EXPECT_GT(target.report.min_jacobian, 0.8);
  PrepareOptions ablation;
  ablation.volume = false;
  EXPECT_GT(volume_error_rms(creature.scene.body, prepared(creature, motion, ablation).target), before / 3);
}

TEST(Prepare, LaysTheSolesOnTheGround) {
  const BoxCreature creature = make_box_creature();
  // Feet that sink, float and creep by a few millimetres while they stand.
  const Motion motion = played(creature, 30, true, [](const Eigen::Vector3d& x, Eigen::Index f) {
    const double phase = 2 * M_PI * static_cast<double>(f) / 30;
    return Eigen::Vector3d(x + Eigen::Vector3d(0.004 * std::sin(phase + 9 * x.x()), 0.003 * std::sin(phase + 7 * x.x()), 0));
  });
  const PreparedTarget target = prepared(creature, motion);
  const Motion points = point_motion(creature.scene.contact_points, target.target);
  ASSERT_EQ(target.contacts.patches.size(), 4u);
  double highest = 0, furthest = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    for (const int p : target.contacts.patches[k].points) {
      Eigen::Vector3d mean = Eigen::Vector3d::Zero();
      for (Eigen::Index f = 0; f < 30; ++f) mean += points.at(f).col(p) / 30;
      for (Eigen::Index f = 0; f < 30; ++f) {
        ASSERT_EQ(target.contacts.state[k][static_cast<std::size_t>(f)], ContactState::kStick);
        highest = std::max(highest, std::abs(points.at(f)(1, p)));
        furthest = std::max(furthest, (points.at(f).col(p) - mean).norm());
      }
    }
  }
  EXPECT_LT(highest, 1e-4 * BoxCreature::kLength);
  EXPECT_LT(furthest, 1e-4 * BoxCreature::kLength);
}

TEST(Prepare, BalancesWhatFeetCanBear) {
  const BoxCreature creature = make_box_creature();
  const PreparedTarget target = prepared(creature, bobbing(creature, 30, 0.06));
  EXPECT_LT(target.report.missing_wrench_max_mg, 0.01);
  EXPECT_LT(target.missing_wrench.cwiseAbs().maxCoeff(), 0.01);
}

TEST(Prepare, FliesAsGravityWantsIt) {
  const BoxCreature creature = make_box_creature();
  const PreparedTarget target = prepared(creature, hopping(creature));
  const Eigen::MatrixXd acceleration = com_acceleration(creature.scene.body, target.target);
  int flying = 0;
  for (Eigen::Index f = 0; f < 36; ++f) {
    if (target.contacts.touching.col(f).any()) continue;
    ++flying;
    EXPECT_LT((acceleration.col(f) - creature.scene.gravity).norm(), 0.01 * 9.81) << "frame " << f;
  }
  EXPECT_GT(flying, 8);
  EXPECT_NEAR(target.report.flight_s, flying / 60.0, 1e-12);
}

TEST(Prepare, HoldsAShapeBackThatIsOutOfReach) {
  const BoxCreature creature = make_box_creature();
  // Stretched along x to `stretch` in the midst of the clip.
  const auto stretched = [&](double stretch) {
    return played(creature, 30, true, [stretch](const Eigen::Vector3d& x, Eigen::Index f) {
      const double grown = 1 + (stretch - 1) * std::pow(std::sin(M_PI * static_cast<double>(f) / 30), 2);
      return Eigen::Vector3d(x.x() * grown, x.y(), x.z());
    });
  };
  PrepareOptions endless;
  endless.reach = 10;
  const auto& body = creature.scene.body;
  const PreparedTarget held = prepared(creature, stretched(2)), free = prepared(creature, stretched(2), endless);
  EXPECT_GT(needed_strain(body, free.target), 0.7);
  EXPECT_LT(needed_strain(body, held.target), 0.55);
  ASSERT_EQ(held.warnings.size(), 1u);
  EXPECT_NE(held.warnings[0].find("the body reaches 45 %"), std::string::npos) << held.warnings[0];
  EXPECT_TRUE(free.warnings.empty());
  // What is within reach stays as it is.
  EXPECT_EQ(prepared(creature, stretched(1.2)).target.frames, prepared(creature, stretched(1.2), endless).target.frames);
}

/// Twice as long as at rest all the time; it hops by `rise` [m] in 0.3 s, in which free fall rises by 0.11 m.
PreparedTarget long_and_leaping(const BoxCreature& creature, double rise, const PrepareOptions& options) {
  return prepared(creature, played(creature, 36, true, [rise](const Eigen::Vector3d& x, Eigen::Index f) {
                    const double height = f < 18 ? 0 : rise * std::pow(std::sin(M_PI * static_cast<double>(f - 18) / 18), 2);
                    return Eigen::Vector3d(2 * x.x(), x.y() + height, x.z());
                  }), options);
}

TEST(Prepare, AFarLeapIsHeldBackLessWhereItIsClearOfTheGroundAndUsesMoreFriction) {
  const BoxCreature creature = make_box_creature();
  PrepareOptions usual, no_leaps;
  no_leaps.momentum = false;  // what no momentum is asked of is no leap
  const auto strain_above = [&](const PreparedTarget& plan) {
    Motion still = plan.target;
    still.frames = still.frames.col(25).eval();
    return needed_strain(creature.scene.body, still);
  };
  const PreparedTarget leap = long_and_leaping(creature, 0.4, usual), none = long_and_leaping(creature, 0.4, no_leaps);
  EXPECT_GT(strain_above(leap), strain_above(none) + 0.01);
  EXPECT_NEAR(leap.support_friction, 1.05 * usual.support_friction, 1e-12);
  EXPECT_EQ(none.support_friction, usual.support_friction);
  const PreparedTarget grounded = long_and_leaping(creature, 0, usual);
  EXPECT_NEAR(strain_above(grounded), strain_above(long_and_leaping(creature, 0, no_leaps)), 1e-3) << "what never flies";
  EXPECT_EQ(grounded.support_friction, usual.support_friction);
}

TEST(Prepare, BalancesAHopThatNobodyCouldDo) {
  const BoxCreature creature = make_box_creature();
  PrepareOptions as_it_is;
  as_it_is.momentum = false;
  const PreparationReport given = prepared(creature, hopping(creature), as_it_is).report, made = prepared(creature, hopping(creature)).report;
  EXPECT_GT(given.missing_wrench_max_mg, 0.5);
  EXPECT_LT(made.missing_wrench_max_mg, 0.01);
  EXPECT_EQ(given.momentum_shift_rms_length, 0);
  EXPECT_GT(made.momentum_shift_rms_length, 1e-3);  // what it cost is told
}

TEST(Prepare, TellsTheForceThatIsMissingInTheAir) {
  // A hover of most of a second that no jump is: what the plan cannot make of it is told frame by frame, and nothing is told that is not so.
  const BoxCreature creature = make_box_creature();
  const Motion motion = played(creature, 72, true, [](const Eigen::Vector3d& x, Eigen::Index f) {
    const double share = std::clamp(static_cast<double>(f - 20) / 10, 0.0, 1.0) - std::clamp(static_cast<double>(f - 60) / 10, 0.0, 1.0);
    return Eigen::Vector3d(x + Eigen::Vector3d(0, 0.5 * share, 0));
  });
  for (const bool momentum : {false, true}) {
    PrepareOptions options;
    options.momentum = momentum;
    const PreparedTarget target = prepared(creature, motion, options);
    const Eigen::MatrixXd acceleration = com_acceleration(creature.scene.body, target.target);
    double largest = 0;
    for (Eigen::Index f = 0; f < 72; ++f) {
      largest = std::max(largest, target.missing_wrench.col(f).head<3>().norm());
      if (target.contacts.touching.col(f).any()) continue;
      const Eigen::Vector3d missing = (acceleration.col(f) - creature.scene.gravity) / 9.81;
      EXPECT_LT((target.missing_wrench.col(f).head<3>() - missing).norm(), 1e-6) << "frame " << f;
    }
    EXPECT_DOUBLE_EQ(target.report.missing_wrench_max_mg, largest);
    // Either it lacks a force, or it was moved far enough to be a jump: the report shows which.
    EXPECT_GT(largest + target.report.momentum_shift_rms_length, 0.2);
    EXPECT_EQ(target.report.momentum_shift_rms_length > 0, momentum);
  }
}

TEST(Prepare, LeansABodyOverTheFeetItStandsOn) {
  // It stands on its front feet alone, a fifth of a metre before its centre of mass, and the back feet are held up.
  const BoxCreature creature = make_box_creature();
  const Motion motion = played(creature, 24, true, [](const Eigen::Vector3d& x, Eigen::Index) {
    return Eigen::Vector3d(x + Eigen::Vector3d(0, x.x() < 0.15 && x.y() < 0.05 ? 0.05 : 0, 0));
  });
  PrepareOptions as_it_is, balanced;
  as_it_is.momentum = false;
  as_it_is.contacts.height = balanced.contacts.height = 0.012;  // per D: at five times that the back feet are still in the air
  const PreparedTarget given = prepared(creature, motion, as_it_is), target = prepared(creature, motion, balanced);
  ASSERT_EQ(given.contacts.patches.size(), 2u);
  const auto lacks = [](const PreparedTarget& prepared_target) { return prepared_target.missing_wrench.colwise().norm().maxCoeff(); };
  const auto com_x = [&](const PreparedTarget& prepared_target) {
    return physics::centre_of_mass(creature.scene.body, prepared_target.target.at(12)).x();
  };
  EXPECT_GT(lacks(given), 0.1);  // told, not hidden
  EXPECT_LT(com_x(given), 0.3);
  EXPECT_GT(com_x(target), 0.39);  // the heels of the front feet are at 0.4
  EXPECT_LT(lacks(target), 0.1 * lacks(given));
}

/// A loop in which the box paces: for a third of it it stands on its right legs alone, for a third on its left.
Motion pacing(const BoxCreature& creature, Eigen::Index frames) {
  return played(creature, frames, true, [frames](const Eigen::Vector3d& x, Eigen::Index f) {
    const double phase = 2 * M_PI * static_cast<double>(f) / static_cast<double>(frames);
    const double rise = std::clamp((x.z() > 0.2 ? 1 : -1) * 2 * std::sin(phase) - 1, 0.0, 1.0);
    return Eigen::Vector3d(x + Eigen::Vector3d(0, x.y() < 0.05 ? 0.06 * rise : 0, 0));
  });
}

/// Where it stands on its right or left feet alone: how far the centre of mass is from the middle of their soles sideways, in the mean [m].
double overhang(const BoxCreature& creature, const PreparedTarget& plan) {
  const Motion points = point_motion(creature.scene.contact_points, plan.target);
  double sum = 0;
  int count = 0;
  for (Eigen::Index f = 0; f < plan.target.count(); ++f) {
    double middle = 0, bearing = 0;
    for (Eigen::Index p = 0; p < plan.contacts.touching.rows(); ++p) {
      if (plan.contacts.touching(p, f)) middle += points.at(f)(2, p), ++bearing;
    }
    if (bearing == 0 || std::abs(middle / bearing - 0.2) < 0.1) continue;  // in the air, or on both sides
    sum += std::abs(physics::centre_of_mass(creature.scene.body, plan.target.at(f)).z() - middle / bearing);
    ++count;
  }
  return sum / count;
}

TEST(Prepare, ASpreadLoadIsBalancedFurtherInside) {
  const BoxCreature creature = make_box_creature();
  for (const Eigen::Index frames : {48, 60}) {
    SCOPED_TRACE(std::to_string(frames) + " frames");
    const Motion motion = pacing(creature, frames);
    PrepareOptions spread;
    spread.spread_load = true;
    const PreparedTarget usual = prepared(creature, motion), wide = prepared(creature, motion, spread);
    EXPECT_LT(wide.report.missing_wrench_max_mg, 2e-3);
    EXPECT_LT(overhang(creature, wide), 0.98 * overhang(creature, usual));
    EXPECT_GT(wide.report.total_shift_rms_length, usual.report.total_shift_rms_length);  // what it costs
  }
}

/// [m/s] of the centre of mass from the first frame to the second and from the last but one to the last.
std::array<double, 2> end_speeds(const physics::Body& body, const Motion& motion) {
  const auto speed = [&](Eigen::Index f) {
    return motion.rate_hz * (physics::centre_of_mass(body, motion.at(f + 1)) - physics::centre_of_mass(body, motion.at(f))).norm();
  };
  return {speed(0), speed(motion.count() - 2)};
}

TEST(Prepare, AOneShotStartsFromRestAndComesToRest) {
  // Cut from where a box that squats on its soles comes up and goes down.
  const BoxCreature creature = make_box_creature();
  const physics::Body& body = creature.scene.body;
  for (const double depth : {0.03, 0.05}) {
    for (const double phase : {0.0, 0.8, 2.5, 4.0}) {
      SCOPED_TRACE("depth " + std::to_string(depth) + ", phase " + std::to_string(phase));
      const Motion motion = played(creature, 40, false, [&](const Eigen::Vector3d& x, Eigen::Index f) {
        const double squat = depth * std::sin(phase + 2 * M_PI * static_cast<double>(f) / 30);
        return Eigen::Vector3d(x.x(), x.y() * (1 - squat), x.z());
      });
      const PreparedTarget target = prepared(creature, motion);
      EXPECT_TRUE(target.ends.first);
      EXPECT_TRUE(target.ends.last);
      EXPECT_LT(target.report.missing_wrench_max_mg, 1e-3);
      const double fastest = depth * 0.2 * 2 * M_PI * 2;  // [m/s] of its centre, 0.2 m high, at 2 Hz
      for (const double speed : end_speeds(body, target.target)) EXPECT_LT(speed, 0.35 * fastest);  // what a push within a frame gives
    }
  }
}

TEST(Prepare, WhatRisesInTheAirStartsWithItsSpeed) {
  const BoxCreature creature = make_box_creature();
  for (const double speed : {1.5, 2.0}) {
    SCOPED_TRACE("speed " + std::to_string(speed));
    const Motion motion = played(creature, 50, false, [&](const Eigen::Vector3d& x, Eigen::Index f) {
      const double time = static_cast<double>(f) / 60;
      return Eigen::Vector3d(x + Eigen::Vector3d(0, std::max(0.0, 0.05 + speed * time - 0.5 * 9.81 * time * time), 0));
    });
    const PreparedTarget target = prepared(creature, motion);
    EXPECT_FALSE(target.ends.first);
    EXPECT_TRUE(target.ends.last);
    EXPECT_GT(end_speeds(creature.scene.body, target.target)[0], 0.8 * speed);
  }
}

TEST(Prepare, ABodyThatNeverTouchesLacksItsWholeWeight) {
  const BoxCreature creature = make_box_creature();
  Motion motion = standing(creature, 12);
  PreparedTarget target = prepared(creature, motion);
  // Every contact forbidden: nothing bears it.
  PrepareOptions options;
  options.contacts.height = -1;
  options.momentum = false;
  target = prepared(creature, motion, options);
  EXPECT_TRUE(target.contacts.patches.empty());
  EXPECT_NEAR(target.report.missing_wrench_max_mg, 1, 1e-6);
  EXPECT_NEAR(target.report.missing_wrench_rms_mg, 1, 1e-6);
}

TEST(Prepare, OfALoopThatTravelsTravelsOn) {
  const BoxCreature creature = make_box_creature();
  Motion motion = bobbing(creature, 24, 0.03);
  motion.travel << 0.1, 0, -0.05;  // a body that slides along on its soles
  for (Eigen::Index f = 0; f < 24; ++f) motion.at(f).colwise() += static_cast<double>(f) / 24 * motion.travel;
  const PreparedTarget target = prepared(creature, motion);
  EXPECT_TRUE(target.target.loop);
  EXPECT_EQ(target.target.travel, motion.travel);
  const Eigen::MatrixXd bend = accelerations(target.target);
  EXPECT_LT(bend.col(0).cwiseAbs().maxCoeff(), 2 * bend.middleCols(5, 14).cwiseAbs().maxCoeff() + 0.1);
}

}  // namespace
}  // namespace hydrostat::retarget::prepare_test
