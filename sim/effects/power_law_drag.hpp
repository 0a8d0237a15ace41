#include "effect.hpp"

struct PowerLawDrag {
  template <typename V>
  static void act(const V* number, Real<V>, const V& across, V& factor) {
    const V exponent = number[0], speed = number[1], slowest = V{} + Real<V>(1e-3);
    factor *= power(maximum(absolute(across), slowest) / speed, -exponent);
  }
};
EFFECT(PressureFactor, PowerLawDrag)
