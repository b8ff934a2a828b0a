#pragma once

#include <Eigen/Core>
#include <cmath>

namespace hydrostat::physics {

/// One number of each of four elements: the scalar with which the element kernels work on four elements at once.
/// Made of the compiler's vector extension, so that it lives in whatever registers the function at hand is compiled for.
struct alignas(4 * sizeof(double)) Lanes {
  static constexpr int kCount = 4;
  typedef double Vector __attribute__((vector_size(kCount * sizeof(double))));  // NOLINT: attributes want a typedef

  Vector value;

  Lanes() = default;
  Lanes(double same) : value{same, same, same, same} {}  // implicit, as for double: constants read the same in a formula
  explicit Lanes(const Vector& each) : value(each) {}

  double operator[](int lane) const { return value[lane]; }
  Lanes operator-() const { return Lanes(-value); }
  Lanes& operator+=(const Lanes& other) { return value += other.value, *this; }
  Lanes& operator-=(const Lanes& other) { return value -= other.value, *this; }
  Lanes& operator*=(const Lanes& other) { return value *= other.value, *this; }
  Lanes& operator/=(const Lanes& other) { return value /= other.value, *this; }

  friend Lanes operator+(const Lanes& a, const Lanes& b) { return Lanes(a.value + b.value); }
  friend Lanes operator-(const Lanes& a, const Lanes& b) { return Lanes(a.value - b.value); }
  friend Lanes operator*(const Lanes& a, const Lanes& b) { return Lanes(a.value * b.value); }
  friend Lanes operator/(const Lanes& a, const Lanes& b) { return Lanes(a.value / b.value); }
};

inline Lanes sqrt(const Lanes& x) {
  Lanes result;
  for (int lane = 0; lane < Lanes::kCount; ++lane) result.value[lane] = std::sqrt(x[lane]);
  return result;
}

inline Lanes log1p(const Lanes& x) {
  Lanes result;
  for (int lane = 0; lane < Lanes::kCount; ++lane) result.value[lane] = std::log1p(x[lane]);
  return result;
}

/// The greater of the two, lane by lane; a NaN on the left gives the right.
inline Lanes greater_of(const Lanes& a, const Lanes& b) { return Lanes(a.value > b.value ? a.value : b.value); }
inline double greater_of(double a, double b) { return a > b ? a : b; }
/// a where test > 0, else b, lane by lane.
inline Lanes where_positive(const Lanes& test, const Lanes& a, const Lanes& b) {
  return Lanes(test.value > 0 ? a.value : b.value);
}
inline double where_positive(double test, double a, double b) { return test > 0 ? a : b; }

/// Whether x > 0 in every lane; false for NaN.
inline bool all_positive(const Lanes& x) { return x[0] > 0 && x[1] > 0 && x[2] > 0 && x[3] > 0; }
inline bool all_positive(double x) { return x > 0; }
inline double sum_of(const Lanes& x) { return (x[0] + x[1]) + (x[2] + x[3]); }
inline double sum_of(double x) { return x; }

}  // namespace hydrostat::physics

namespace Eigen {

template <>
struct NumTraits<hydrostat::physics::Lanes> : GenericNumTraits<double> {
  using Real = hydrostat::physics::Lanes;
  using NonInteger = hydrostat::physics::Lanes;
  using Nested = hydrostat::physics::Lanes;
  using Literal = hydrostat::physics::Lanes;
  enum { IsComplex = 0, IsInteger = 0, IsSigned = 1, RequireInitialization = 0, ReadCost = 1, AddCost = 1, MulCost = 1 };
};

}  // namespace Eigen
