#pragma once

namespace hydrostat::physics {

/// What a stepper has done so far, counted: the same input gives the same counts on every machine. What each costs is told by
/// retarget/step_cost.h.
struct StepWork {
  double passes = 0;      // over the whole body, for its forces or its energy
  double sweeps = 0;      // over all of xpbd's constraints
  double assemblies = 0;  // of the system matrix
  double products = 0;    // of its blocks (Dim x Dim), to factor it and to solve with it
  double rounds = 0;      // of what iterates: substeps, Newton's steps, those of L-BFGS
  double searched = 0;    // pairs of a place of the surface and what it may touch, looked through for those that are near
  double looks = 0;       // at how far a near place is from what it may touch
  double pushes = 0;      // of a touching place: solved for within Coulomb's cone, or from a potential

  StepWork& operator+=(const StepWork& other) {
    passes += other.passes;
    sweeps += other.sweeps;
    assemblies += other.assemblies;
    products += other.products;
    rounds += other.rounds;
    searched += other.searched;
    looks += other.looks;
    pushes += other.pushes;
    return *this;
  }
};
inline StepWork operator+(StepWork a, const StepWork& b) { return a += b; }

}  // namespace hydrostat::physics
