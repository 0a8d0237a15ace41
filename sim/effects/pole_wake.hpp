#include "effect.hpp"

struct PoleWake {
  template <typename V>
  static void act(const V* number, const Vector3<V>& offset, Vector3<V>& wind) {
    using T = Real<V>;
    const V share = number[0], diameter = number[1], drag = number[2], tiny = V{} + std::numeric_limits<T>::min();
    const V speed = maximum(root(wind.x * wind.x + wind.y * wind.y), tiny);
    const V along = (offset.x * wind.x + offset.y * wind.y) / speed;
    const V across = (offset.y * wind.x - offset.x * wind.y) / speed;
    const V thickness = drag * diameter / 2, downstream = maximum(along, V{});
    const V grown = downstream + T(2.5) * thickness + tiny;
    const V width = T(0.252 * 0.252) * thickness * grown + tiny;
    const V depth = T(1.58) * root(thickness / grown) * exponential(-(across * across) / (2 * width));
    const V loss = share * depth * downstream / (downstream + diameter);
    wind.x -= loss * wind.x;
    wind.y -= loss * wind.y;
  }
};
EFFECT(Flow, PoleWake)
