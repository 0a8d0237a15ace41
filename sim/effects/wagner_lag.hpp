#include "effect.hpp"

struct WagnerLag {
  template <typename V>
  static void act(const V* number, const Face<V>& seen, Vector3<V>& push) {
    constexpr double amplitude[2] = {0.165, 0.335}, rate[2] = {0.0455, 0.3};  // as in wagner_lag.py
    const V share = number[0], half_chords_a_metre = number[1], density = number[2];
    const V load = density * absolute(seen.across) * seen.across;
    V lacking = V{};
    for (int k = 0; k < 2; ++k) {
      V& past = *seen.past[k];
      if (seen.elapsed > 0)
        past = load + (past - load) * exponential(-Real<V>(rate[k]) * half_chords_a_metre * (seen.elapsed * norm(seen.relative)));
      lacking += Real<V>(amplitude[k]) * (load - past);
    }
    push = add(push, scale(seen.normal, -share * lacking));
  }
};
EFFECT(FaceForce, WagnerLag)
