#include "effect.hpp"

struct WagnerLag {
  template <typename V>
  static void act(const V* number, const Face<V>& seen, Vector3<V>& push) {
    const V share = number[0], half_chords_a_metre = number[1], density = number[2];
    const V load = density * absolute(seen.across) * seen.across;
    V &slow = *seen.past[0], &fast = *seen.past[1];
    if (seen.elapsed > 0) {
      const V half_chords = half_chords_a_metre * (seen.elapsed * norm(seen.relative));
      slow = load + (slow - load) * exponential(-Real<V>(0.0455) * half_chords);
      fast = load + (fast - load) * exponential(-Real<V>(0.3) * half_chords);
    }
    const V lacking = Real<V>(0.165) * (load - slow) + Real<V>(0.335) * (load - fast);  // Jones' fit, as in wagner_lag.py
    push = add(push, scale(seen.normal, -share * lacking));
  }
};
EFFECT(FaceForce, WagnerLag)
