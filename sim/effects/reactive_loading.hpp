#include "effect.hpp"

struct ReactiveLoading {
  template <typename V>
  static void act(const V* number, const Sheet<V>& sheet, Real<V>* force) {
    const Real<V>* rate = sheet.momentum_rates(nullptr);
    for (int64_t i = 0; i < sheet.vertices; ++i)
      sheet.push_along_normal(force, i, -number[0] * load<V>(rate + Sheet<V>::L * i));
  }
};
EFFECT(SheetForce, ReactiveLoading)
