#include "effect.hpp"

struct Permeability {
  template <typename V>
  static void act(const V* number, Real<V> density, const V& across, V& factor) {
    const V left = 2 / (1 + root(1 + 4 * density * number[0] * absolute(across)));
    factor *= left * left;
  }
};
EFFECT(PressureFactor, Permeability)
