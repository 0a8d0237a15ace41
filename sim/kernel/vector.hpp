// Numbers of several members side by side, in vector registers: every lane does the same operations in the same order.

#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>
#include <utility>

// Bytes of the processor's vector registers. A block of members, and a group of points that a search looks at, are as
// wide: a vector that is wider is kept in memory, and a member then takes three times as long.
#ifdef __AVX512F__
constexpr int REGISTER = 64;
#else
constexpr int REGISTER = 32;
#endif
constexpr int SINGLES = REGISTER / sizeof(float), DOUBLES = REGISTER / sizeof(double);

namespace {

template <typename T, int L>
struct Vector {
  typedef T type __attribute__((vector_size(sizeof(T) * L)));
  typedef int32_t index __attribute__((vector_size(4 * L)));
};

// Coefficients of atan(sqrt(u))/sqrt(u) in powers of 2u - 1 on [0, 1], by Chebyshev interpolation: largest error of
// atan 1.5e-9 (degree 9) and 1.1e-16 (degree 20).
template <typename T>
struct Arctangent;
template <>
struct Arctangent<float> {
  static constexpr int terms = 10;
  static constexpr float c[] = {0.8704197533355914f,   -0.1018765429522826f,   0.02085175296811603f, -0.005030833614468352f,
                                0.0013163640918424742f, -0.0003612200464794893f, 0.00010014512956245252f,
                                -2.8998424551572838e-05f, 1.1063999869689915e-05f, -3.322597781383979e-06f};
};
template <>
struct Arctangent<double> {
  static constexpr int terms = 21;
  static constexpr double c[] = {0.8704197513671031,      -0.10187654235021819,    0.02085185120710812,
                                 -0.005030863660250071,   0.0013155859496292637,   -0.0003609820870537958,
                                 0.00010227656112457649,  -2.9650040727272736e-05, 8.74493865928441e-06,
                                 -2.6140726587443016e-06, 7.898643101492844e-07,   -2.4079970758706004e-07,
                                 7.3946703181214e-08,     -2.2806127912204115e-08, 7.084749388337621e-09,
                                 -2.268247878883474e-09,  7.111461799834528e-10,   -1.7840616846746431e-10,
                                 5.614478327142391e-11,   -3.787822214408087e-11,  1.2046030455090929e-11};
};

// The type of one lane, and of integers as wide.
template <typename V>
using Real = std::remove_cv_t<std::remove_reference_t<decltype(std::declval<V&>()[0])>>;
template <typename V>
struct Integers {
  using Lane = std::conditional_t<sizeof(Real<V>) == 4, int32_t, int64_t>;
  typedef Lane type __attribute__((vector_size(sizeof(V))));
};

template <typename V>
struct Vector3 {
  V x, y, z;
};

template <typename V>
inline V load(const Real<V>* p) {
  V v;
  std::memcpy(&v, p, sizeof v);
  return v;
}
template <typename V>
inline V maximum(V a, V b) { return a > b ? a : b; }
template <typename V>
inline V minimum(V a, V b) { return a < b ? a : b; }
template <typename V>
inline V absolute(V a) { return a < 0 ? -a : a; }
template <typename V>
inline V root(V a) {
  V r;
  for (size_t l = 0; l < sizeof(V) / sizeof(Real<V>); ++l) r[l] = std::sqrt(a[l]);
  return r;
}
template <typename V>
inline V dot(Vector3<V> a, Vector3<V> b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
template <typename V>
inline V norm(Vector3<V> a) { return root(dot(a, a)); }
template <typename V>
inline Vector3<V> sub(Vector3<V> a, Vector3<V> b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
template <typename V>
inline Vector3<V> add(Vector3<V> a, Vector3<V> b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
template <typename V>
inline Vector3<V> scale(Vector3<V> a, V s) { return {a.x * s, a.y * s, a.z * s}; }
template <typename V>
inline Vector3<V> combine(Vector3<V> a, V s, Vector3<V> b, V t) {
  return {a.x * s + b.x * t, a.y * s + b.y * t, a.z * s + b.z * t};
}
template <typename V>
inline Vector3<V> cross(Vector3<V> a, Vector3<V> b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// atan2 for arguments that are not both zero.
template <typename V>
inline V arctangent2(V y, V x) {
  using T = Real<V>;
  V ay = absolute(y), ax = absolute(x);
  V t = minimum(ay, ax) / maximum(ay, ax);
  V w = 2 * t * t - 1;
  V p = V{} + Arctangent<T>::c[Arctangent<T>::terms - 1];
  for (int i = Arctangent<T>::terms - 2; i >= 0; --i) p = p * w + Arctangent<T>::c[i];
  V angle = p * t;
  angle = ay > ax ? T(M_PI / 2) - angle : angle;
  angle = x < 0 ? T(M_PI) - angle : angle;
  return y < 0 ? -angle : angle;
}

// e to the a, held within the range of normal numbers; exactly 1 at 0. Taylor's series on half an octave: the first term
// left out is 5e-9 of it in single precision, 4e-18 in double.
template <typename V>
inline V exponential(V a) {
  using T = Real<V>;
  using I = typename Integers<V>::type;
  constexpr bool single = sizeof(T) == 4;
  constexpr int terms = single ? 7 : 13, mantissa = single ? 23 : 52, bias = single ? 127 : 1023;
  const T least = single ? T(-87) : T(-708), most = single ? T(88) : T(709);
  a = minimum(maximum(a, V{} + least), V{} + most);
  const V octaves = a * T(1.4426950408889634);
  const I whole = __builtin_convertvector(octaves + (a < 0 ? V{} - T(0.5) : V{} + T(0.5)), I);
  const V n = __builtin_convertvector(whole, V);
  // ln 2 in two parts, the first of few digits, so that its multiples are exact.
  const V rest = a - n * T(0.693145751953125) - n * T(1.4286068203094172e-06);
  V series = V{} + 1;
  for (int i = terms; i > 0; --i) series = 1 + series * (rest * (T(1) / T(i)));  // what is in brackets does not wait
  const I bits = (whole + bias) << mantissa;
  V power;
  std::memcpy(&power, &bits, sizeof power);
  return series * power;
}

// Natural logarithm of a positive normal number; exactly 0 at 1. By 2 artanh((m - 1)/(m + 1)) of the mantissa: the first
// term left out is 1e-10 of it in single precision, 1e-18 in double.
template <typename V>
inline V logarithm(V a) {
  using T = Real<V>;
  using I = typename Integers<V>::type;
  using Lane = typename Integers<V>::Lane;
  constexpr bool single = sizeof(T) == 4;
  constexpr int terms = single ? 6 : 12, mantissa = single ? 23 : 52, bias = single ? 127 : 1023;
  I bits;
  std::memcpy(&bits, &a, sizeof bits);
  I exponent = (bits >> mantissa) - bias;
  bits = (bits & ((Lane(1) << mantissa) - 1)) | (Lane(bias) << mantissa);
  V m;
  std::memcpy(&m, &bits, sizeof m);
  const auto upper = m > T(1.4142135623730951);
  m = upper ? m * T(0.5) : m;
  exponent = upper ? exponent + 1 : exponent;
  const V s = (m - 1) / (m + 1), square = s * s;
  V series = V{} + T(1) / T(2 * terms + 1);
  for (int i = terms - 1; i >= 0; --i) series = series * square + T(1) / T(2 * i + 1);
  const V n = __builtin_convertvector(exponent, V);
  return n * T(0.693145751953125) + (n * T(1.4286068203094172e-06) + 2 * s * series);
}

// A positive number to a power; exactly 1 to the power 0.
template <typename V>
inline V power(V base, V exponent) { return exponential(exponent * logarithm(base)); }

}  // namespace
