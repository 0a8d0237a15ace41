#include "effect.hpp"

struct Curl {
  template <typename V>
  static void act(const V*, const Hinge<V>& hinge, V& moment) {
    moment += hinge.stiffness * hinge.own[0];
  }
};
EFFECT(HingeMoment, Curl)
