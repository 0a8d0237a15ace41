// What acts beside the base model: the loops around the functions of effects (effect.hpp), for one block.
//
// All of it is added to the forces of the base model in passes of its own, so that those are the same to the last bit
// whether effects act or not. sim/cloth/system.py is the definition (`System.extra_force`).

#pragma once

#include <vector>

#include "problem.hpp"

namespace {

template <typename T, int L>
class Acting {
  using V = typename Vector<T, L>::type;
  using V3 = Vector3<V>;

  const Problem<T>& p;
  const int64_t b;
  bool pressures_ = false, faces_ = false, flows_ = false, sheets_ = false, hinges_ = false;
  std::vector<T> air_, normals_, turning_, scratch_;

  static V3 load3(const T* q) { return {load<V>(q), load<V>(q + L), load<V>(q + 2 * L)}; }
  static void add3(T* q, V3 a) { Sheet<V>::add_at(q, 0, a); }
  const V* number(const Effect<T>& effect) const {
    return reinterpret_cast<const V*>(effect.number + b * effect.numbers * L);
  }
  // One of the two numbers of an element that an effect remembers; null where it remembers nothing.
  V* past(const Effect<T>& effect, int64_t elements, int which, int64_t e) const {
    return effect.memory ? reinterpret_cast<V*>(effect.memory + ((2 * b + which) * elements + e) * L) : nullptr;
  }
  template <typename Kind, typename F>
  void each(F call) const {
    for (int64_t i = 0; i < p.effects; ++i)
      if (p.effect[i].kind == Kind::kind)
        call(p.effect[i], reinterpret_cast<typename Kind::template Act<V>*>(p.effect[i].act));
  }
  template <typename Kind>
  bool has() const {
    bool found = false;
    each<Kind>([&](const auto&, auto) { found = true; });
    return found;
  }

  // Density and drag times what a relative wind gives, per area. Not inlined: twice the same gives the same bits.
  __attribute__((noinline)) void pushed(const Face<V>& seen, V factor, V3& push) const {
    const V normal = T(p.air_density) * factor * absolute(seen.across) * seen.across - T(p.air_drag) * seen.across;
    push = combine(seen.normal, normal, seen.relative, V{} + T(p.air_drag));
  }

  void face_forces(const T* x, const T* v, const T* level, T lag, V3 wind, T elapsed, T* f) const {
    const T third = T(1) / 3;
    for (int64_t e = 0; e < p.faces; ++e) {
      const int64_t at[3] = {3 * L * int64_t(p.face[3 * e]), 3 * L * int64_t(p.face[3 * e + 1]),
                             3 * L * int64_t(p.face[3 * e + 2])};
      const V3 v0 = load3(v + at[0]), v1 = load3(v + at[1]), v2 = load3(v + at[2]);
      V3 x0 = load3(x + at[0]), x1 = load3(x + at[1]), x2 = load3(x + at[2]);
      V3 local = wind;
      if (flows_) {
        const V3 u0 = load3(air_.data() + at[0]), u1 = load3(air_.data() + at[1]), u2 = load3(air_.data() + at[2]);
        // Differences to the undisturbed wind, so that none is exactly that.
        local = add(wind, scale(add(sub(u0, wind), add(sub(u1, wind), sub(u2, wind))), V{} + third));
      }
      V3 push = {V{}, V{}, V{}};
      const auto meets = [&](V3 normal, V3 air, V3 w0, V3 w1, V3 w2) -> Face<V> {
        const V3 relative = sub(air, scale(add(w0, add(w1, w2)), V{} + third));
        return {normal, relative, dot(relative, normal), {nullptr, nullptr}, elapsed};
      };
      const auto normal_of = [](V3 y0, V3 y1, V3 y2) {
        const V3 normal = cross(sub(y1, y0), sub(y2, y0));
        return scale(normal, 1 / maximum(norm(normal), V{} + T(1e-30)));
      };
      if (faces_) {
        Face<V> seen = meets(normal_of(x0, x1, x2), local, load3(level + at[0]), load3(level + at[1]), load3(level + at[2]));
        each<FaceForce>([&](const Effect<T>& effect, auto act) {
          for (int k = 0; k < 2; ++k) seen.past[k] = past(effect, p.faces, k, e);
          act(number(effect), seen, push);
        });
      }
      if (flows_ || pressures_) {
        if (lag != 0) {
          const V s = V{} - lag, one = V{} + 1;
          x0 = combine(x0, one, v0, s), x1 = combine(x1, one, v1, s), x2 = combine(x2, one, v2, s);
        }
        const V3 normal = normal_of(x0, x1, x2);
        const Face<V> seen = meets(normal, local, v0, v1, v2);
        V factor = V{} + 1;
        each<PressureFactor>([&](const Effect<T>& effect, auto act) {
          act(number(effect), T(p.air_density), seen.across, factor);
        });
        V3 with, without;
        pushed(seen, factor, with);
        pushed(flows_ ? meets(normal, wind, v0, v1, v2) : seen, V{} + 1, without);
        push = add(push, sub(with, without));
      }
      push = scale(push, V{} + p.areas[e] * third);
      for (int c = 0; c < 3; ++c) add3(f + at[c], push);
    }
  }

  void blow(const T* x, T lag, const T* v, V3 wind) {
    air_.resize(3 * L * p.vertices);
    for (int64_t i = 0; i < p.vertices; ++i) {
      V3 at = load3(x + 3 * L * i), local = wind;
      if (lag != 0) at = combine(at, V{} + 1, load3(v + 3 * L * i), V{} - lag);
      each<Flow>([&](const Effect<T>& effect, auto act) {
        // The first numbers of a flow are the place that it is about.
        const V* of_all = number(effect);
        act(of_all + 3, sub(at, V3{of_all[0], of_all[1], of_all[2]}), local);
      });
      std::memcpy(air_.data() + 3 * L * i, &local, sizeof local);
    }
  }

  // At the corners of the faces around each vertex, their areas along the normals over 6; and where `level` is given, the
  // time derivative.
  void turn(const T* x, const T* level) {
    normals_.assign(3 * L * p.vertices, T(0));
    if (level) turning_.assign(3 * L * p.vertices, T(0));
    for (int64_t e = 0; e < p.faces; ++e) {
      const int64_t at[3] = {3 * L * int64_t(p.face[3 * e]), 3 * L * int64_t(p.face[3 * e + 1]),
                             3 * L * int64_t(p.face[3 * e + 2])};
      const V3 x0 = load3(x + at[0]), a = sub(load3(x + at[1]), x0), c = sub(load3(x + at[2]), x0);
      const V3 sixth = scale(cross(a, c), V{} + T(1) / 6);
      for (int k = 0; k < 3; ++k) add3(normals_.data() + at[k], sixth);
      if (!level) continue;
      const V3 v0 = load3(level + at[0]);
      const V3 rate = add(cross(sub(load3(level + at[1]), v0), c), cross(a, sub(load3(level + at[2]), v0)));
      const V3 sixths = scale(rate, V{} + T(1) / 6);
      for (int k = 0; k < 3; ++k) add3(turning_.data() + at[k], sixths);
    }
  }

 public:
  Acting(const Problem<T>& problem, int64_t block) : p(problem), b(block) {
    pressures_ = has<PressureFactor>(), faces_ = has<FaceForce>(), flows_ = has<Flow>(), sheets_ = has<SheetForce>();
    hinges_ = has<HingeMoment>();
  }

  // Whether some of it depends on the velocity at the full step (see sim/integrate/symplectic.py).
  bool levelled() const { return faces_ || sheets_; }
  bool folds() const { return hinges_; }

  // Adds all but the moments at hinges, in a wind; flows and the factors on the pressure see velocities v and the shape
  // x - lag v, forces the velocities `level`. What forces remember is brought up to date where time has elapsed since.
  void add_forces(const T* x, const T* v, const T* level, T lag, V3 wind, T elapsed, T* f) {
    if (flows_) blow(x, lag, v, wind);
    if (flows_ || pressures_ || faces_) face_forces(x, v, level, lag, wind, elapsed, f);
    if (!sheets_) return;
    turn(x, level);
    scratch_.resize(7 * L * p.vertices);
    Sheet<V> sheet = {p.vertices, p.faces, p.face, p.gradients, p.areas, p.vertex_areas, &p.ends, x, level,
                            flows_ ? air_.data() : reinterpret_cast<const T*>(&wind), !flows_, normals_.data(),
                            turning_.data(), scratch_.data(), nullptr};
    each<SheetForce>([&](const Effect<T>& effect, auto act) {
      sheet.own = reinterpret_cast<const V*>(effect.of_element + b * p.vertices * effect.own * L);
      act(number(effect), sheet, f);
    });
  }

  // Adds the moments of effects at a hinge.
  void add_moments(int64_t e, V angle, V stiffness, T elapsed, V& moment) const {
    each<HingeMoment>([&](const Effect<T>& effect, auto act) {
      const V* own = reinterpret_cast<const V*>(effect.of_element + (b * p.hinges + e) * effect.own * L);
      V *first = past(effect, p.hinges, 0, e), *second = past(effect, p.hinges, 1, e);
      act(number(effect), Hinge<V>{angle, stiffness, own, first, second, elapsed}, moment);
    });
  }

  // Makes the mean normals those at x, unless `add_forces` has just done so.
  void orient(const T* x) {
    if (!sheets_) turn(x, nullptr);
  }

  // Of a force on cloth and air, what gives the cloth's own mass its acceleration (sim/cloth/inertia.py).
  void share_with_air(const T* x, T* f) {
    orient(x);
    const T *mass = p.mass + b * p.vertices * L, *added = p.added_mass + b * p.vertices * L;
    for (int64_t i = 0; i < p.vertices; ++i) {
      const V3 n = mean_normal(i);
      const V air = load<V>(added + i * L), part = air / (load<V>(mass + i * L) + air * dot(n, n));
      add3(f + 3 * L * i, scale(n, -part * dot(n, load3(f + 3 * L * i))));
    }
  }

  V3 mean_normal(int64_t i) const { return scale(load3(normals_.data() + 3 * L * i), V{} + 1 / p.vertex_areas[i]); }
};

}  // namespace
