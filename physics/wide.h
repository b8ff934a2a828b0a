#pragma once

// A sweep over constraints or elements is compiled twice, for every processor and for those with AVX2 and fused multiply-add, and
// chosen at run time: results then depend on the processor, never on the threads. Sanitizers take the plain one alone (their checks
// do not inline), and HYDROSTAT_WIDE is not defined.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define HYDROSTAT_FLATTEN [[gnu::flatten]]
#define HYDROSTAT_WIDE [[gnu::flatten, gnu::target("avx2,fma")]]
#else
#define HYDROSTAT_FLATTEN
#endif

namespace hydrostat::physics {

inline bool processor_is_wide() {
#ifdef HYDROSTAT_WIDE
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
#else
  return false;
#endif
}

}  // namespace hydrostat::physics
