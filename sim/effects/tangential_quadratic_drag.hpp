#include "effect.hpp"

struct TangentialQuadraticDrag {
  template <typename V>
  static void act(const V* number, const Face<V>& seen, Vector3<V>& push) {
    const V coefficient = number[0], density = number[1];
    const Vector3<V> along = seen.along();
    push = add(push, scale(along, density * coefficient * norm(along)));
  }
};
EFFECT(FaceForce, TangentialQuadraticDrag)
