#include "effect.hpp"

struct Lift {
  template <typename V>
  static void act(const V* number, const Face<V>& seen, Vector3<V>& push) {
    const V coefficient = number[0], density = number[1];
    const V speed = norm(seen.relative), tiny = V{} + std::numeric_limits<Real<V>>::min();
    const V size = Real<V>(0.5) * density * coefficient * seen.across;
    push = add(push, combine(seen.normal, size * speed, seen.relative, -size * seen.across / maximum(speed, tiny)));
  }
};
EFFECT(FaceForce, Lift)
