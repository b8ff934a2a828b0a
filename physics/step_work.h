#pragma once

namespace hydrostat::physics {

/// What contact has done. Features of the surface are its places, and the edges and faces between them.
struct ContactWork {
  double searched = 0;      // pairs of a feature and something that it may touch, looked through for those that are near
  double own_searched = 0;  // features that were held against the whole surface of the body itself
  double looks = 0;         // at how far a near place is from what it may touch
  double wide_looks = 0;    // the same of edges and faces, and of the body against itself
  double pushes = 0;        // of what touches: solved for within Coulomb's cone, or from a potential

  ContactWork& operator+=(const ContactWork& other) {
    searched += other.searched;
    own_searched += other.own_searched;
    looks += other.looks;
    wide_looks += other.wide_looks;
    pushes += other.pushes;
    return *this;
  }
};

/// What a stepper has done so far, counted: the same input gives the same counts on every machine. What each costs is told by
/// retarget/step_cost.h.
struct StepWork {
  double passes = 0;      // over the whole body, for its forces or its energy
  double stages = 0;      // of dashpots by themselves: passes over these alone
  double placings = 0;    // of the dashpots for such stages
  double sweeps = 0;      // over all of xpbd's constraints
  double assemblies = 0;  // of the system matrix
  double products = 0;    // of its blocks (Dim x Dim), to factor it and to solve with it
  double rounds = 0;      // of what iterates: substeps, Newton's steps, those of L-BFGS
  ContactWork by_impulses, by_potential;

  StepWork& operator+=(const StepWork& other) {
    passes += other.passes;
    stages += other.stages;
    placings += other.placings;
    sweeps += other.sweeps;
    assemblies += other.assemblies;
    products += other.products;
    rounds += other.rounds;
    by_impulses += other.by_impulses;
    by_potential += other.by_potential;
    return *this;
  }
};
inline StepWork operator+(StepWork a, const StepWork& b) { return a += b; }

}  // namespace hydrostat::physics
