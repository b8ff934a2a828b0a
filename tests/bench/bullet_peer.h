#pragma once

// Bullet's deformable body behind a table of functions: its builds with float and with double have the same symbols, so each
// is a module of its own, opened at run time (peer_bench.cpp).

extern "C" {

/// Copied; arrays of nodes are 3 x N, a node after the other.
struct BulletScene {
  int nodes, tets;
  const double* x;     // [m] at the start
  const double* v;     // [m/s]
  const double* rest;  // [m]
  const double* mass;  // [kg] N
  const char* held;    // N, 1 where a node stays
  const int* tet;      // 4 x T, positive volume
  double lambda, mu;   // [Pa] Lamé's
  double gravity;      // [m/s2] along y
  int implicit;        // 0: Bullet's explicit scheme
};

/// To be given to step, read and destroy.
void* bullet_make(const BulletScene* scene);
void bullet_step(void* world, double dt);
/// Places [m] and velocities [m/s], 3 x N.
void bullet_read(const void* world, double* x, double* v);
void bullet_destroy(void* world);
}
