#include "effect.hpp"

struct TangentialLinearDrag {
  template <typename V>
  static void act(const V* number, const Face<V>& seen, Vector3<V>& push) {
    push = add(push, scale(seen.along(), number[0]));
  }
};
EFFECT(FaceForce, TangentialLinearDrag)
