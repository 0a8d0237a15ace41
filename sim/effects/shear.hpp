#include "effect.hpp"

struct Shear {
  template <typename V>
  static void act(const V* number, const Vector3<V>& offset, Vector3<V>& wind) {
    const V exponent = number[0], height = number[1], lowest = V{} + Real<V>(0.05);
    wind = scale(wind, power(maximum(1 + offset.z / height, lowest), exponent));
  }
};
EFFECT(Flow, Shear)
