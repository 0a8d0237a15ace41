#include "effect.hpp"

struct ReactiveLoading {
  template <typename V>
  static void act(const V* number, const Sheet<V>& sheet, Real<V>* force) {
    using T = Real<V>;
    constexpr int64_t L = Sheet<V>::L;
    // The cloth's velocity across itself and the air's slip along it at the vertices, four numbers each; then what is
    // swept along the faces.
    T *const over = sheet.scratch, *const swept = over + 4 * L * sheet.vertices;
    const auto put = [](T* to, V value) { std::memcpy(to, &value, sizeof value); };
    for (int64_t i = 0; i < sheet.vertices; ++i) {
      const Vector3<V> normal = scale(sheet.at(sheet.normals, i), V{} + 1 / sheet.vertex_areas[i]);
      const Vector3<V> relative = sub(sheet.at(sheet.velocity, i), sheet.wind(i));
      const V across = dot(relative, normal);
      const Vector3<V> slip = sub(scale(normal, across), relative);
      T* to = over + 4 * L * i;
      put(to, across), put(to + L, slip.x), put(to + 2 * L, slip.y), put(to + 3 * L, slip.z);
      put(swept + L * i, V{});
    }
    for (int64_t e = 0; e < sheet.faces; ++e) {
      const int32_t* c = sheet.face + 3 * e;
      const T* d = sheet.gradients + 6 * e;
      const Vector3<V> x0 = sheet.at(sheet.position, c[0]), a = sub(sheet.at(sheet.position, c[1]), x0),
                       b = sub(sheet.at(sheet.position, c[2]), x0);
      V across[3];
      Vector3<V> slip[3];
      for (int k = 0; k < 3; ++k) {
        const T* from = over + 4 * L * c[k];
        across[k] = load<V>(from), slip[k] = {load<V>(from + L), load<V>(from + 2 * L), load<V>(from + 3 * L)};
      }
      // Along the tangents, of which there are as many as directions of the flat cloth: the gradients of the shapes add
      // up to nothing.
      const V splat1 = V{} + d[1], splat2 = V{} + d[2], splat4 = V{} + d[4], splat5 = V{} + d[5];
      const Vector3<V> tangent[2] = {combine(a, splat1, b, splat2), combine(a, splat4, b, splat5)};
      const Vector3<V> s1 = sub(slip[1], slip[0]), s2 = sub(slip[2], slip[0]);
      const Vector3<V> total = add(slip[0], add(slip[1], slip[2]));
      const V v1 = across[1] - across[0], v2 = across[2] - across[0];
      V following = V{}, spreading = V{};
      for (int k = 0; k < 2; ++k) {
        const T *g = d + 3 * k;
        following += dot(total, tangent[k]) * (g[1] * v1 + g[2] * v2);
        spreading += g[1] * dot(tangent[k], s1) + g[2] * dot(tangent[k], s2);
      }
      const V sum = across[0] + across[1] + across[2];
      const V given = (following + sum * spreading * T(0.5)) * (sheet.areas[e] * (T(1) / 9));
      for (int k = 0; k < 3; ++k) put(swept + L * c[k], load<V>(swept + L * c[k]) + given);
    }
    for (int64_t i = 0; i < sheet.vertices; ++i) {
      const Vector3<V> relative = sub(sheet.at(sheet.velocity, i), sheet.wind(i));
      const V rate = dot(sheet.at(sheet.turning, i), relative) + load<V>(swept + L * i);
      sheet.add_at(force, i, scale(sheet.at(sheet.normals, i), -number[0] * rate / sheet.vertex_areas[i]));
    }
  }
};
EFFECT(SheetForce, ReactiveLoading)
