#include "effect.hpp"

struct AirDensityChange {
  template <typename V>
  static void act(const V* number, Real<V>, const V&, V& factor) {
    factor *= 1 + number[0];
  }
};
EFFECT(PressureFactor, AirDensityChange)
