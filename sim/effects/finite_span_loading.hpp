#include "effect.hpp"

struct FiniteSpanLoading {
  static constexpr int ALONG = 10, ACROSS = 4;  // modes, as in finite_span_loading.py

  // What the modes of a vertex are: cosines by Chebyshev's recurrence.
  template <typename V, int N>
  static void cosines(V first, V* out) {
    out[0] = V{} + 1, out[1] = first;
    for (int j = 2; j < N; ++j) out[j] = 2 * first * out[j - 1] - out[j - 2];
  }

  template <typename V>
  static void act(const V* number, const Sheet<V>& sheet, Real<V>* force) {
    const Real<V>* rate = sheet.momentum_rates(sheet.ends);
    const V *mass = number, *gain = number + 1;
    V sum[ALONG * ACROSS], along[ALONG], across[ACROSS];
    for (V& one : sum) one = V{};
    for (int64_t i = 0; i < sheet.vertices; ++i) {
      const V* own = sheet.own + 3 * i;
      cosines<V, ALONG>(own[0], along), cosines<V, ACROSS>(own[1], across);
      const V weighted = own[2] * load<V>(rate + Sheet<V>::L * i);
      for (int b = 0; b < ACROSS; ++b) {
        const V part = weighted * across[b];
        for (int a = 0; a < ALONG; ++a) sum[b * ALONG + a] += part * along[a];
      }
    }
    for (int k = 0; k < ALONG * ACROSS; ++k) sum[k] *= gain[k];
    for (int64_t i = 0; i < sheet.vertices; ++i) {
      const V* own = sheet.own + 3 * i;
      cosines<V, ALONG>(own[0], along), cosines<V, ACROSS>(own[1], across);
      V smooth = V{};
      for (int b = 0; b < ACROSS; ++b) {
        V part = V{};
        for (int a = 0; a < ALONG; ++a) part += sum[b * ALONG + a] * along[a];
        smooth += part * across[b];
      }
      sheet.push_along_normal(force, i, -mass[0] * own[2] * sheet.vertex_areas[i] * smooth);
    }
  }
};
EFFECT(SheetForce, FiniteSpanLoading)
