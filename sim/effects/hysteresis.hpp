#include "effect.hpp"

struct Hysteresis {
  template <typename V>
  static void act(const V* number, const Hinge<V>& hinge, V& moment) {
    const V couple = number[0], curvature = number[1], bend = hinge.own[0], half = hinge.own[1];
    if (hinge.elapsed > 0) {
      const V change = bend * (hinge.angle - *hinge.angle_before);
      const V goal = change > 0 ? V{} + 1 : (change < 0 ? V{} - 1 : V{});
      *hinge.past = goal + (*hinge.past - goal) * exponential(-absolute(change) / curvature);
      *hinge.angle_before = hinge.angle;
    }
    moment -= half * couple * *hinge.past;
  }
};
EFFECT(HingeMoment, Hysteresis)
