// What the C++ of an effect is written with. It stands in NAME.hpp beside the torch definition in NAME.py, under the name
// of its class:
//
//   struct Lift {
//     template <typename V>
//     static void act(const V* number, const Face<V>& seen, Vector3<V>& push) { ... }
//   };
//   EFFECT(FaceForce, Lift)
//
// V holds one number of several members, and `number` the effect's parameters in the order of the class. At the null
// value `act` must leave the last argument as it is, to the last bit. A file is compiled into a library of its own.

#pragma once

#include "vector.hpp"

namespace {

// The air as a face meets it.
template <typename V>
struct Face {
  Vector3<V> normal, relative;  // of length 1; the wind less the face's velocity
  V across;                     // its part along the normal
  V* past[2];                   // the two numbers of this face that a force that remembers has; or null
  Real<V> elapsed;              // since they were brought up to date [s]; 0 where they are
  Vector3<V> along() const { return sub(relative, scale(normal, across)); }
};

// A fold about an edge.
template <typename V>
struct Hinge {
  V angle, stiffness;  // stiffness times angle is the elastic moment
  const V* own;        // the effect's numbers of this hinge
  V *past, *angle_before;  // what a friction remembers, and the angle that was at
  Real<V> elapsed;     // since then [s]: what is remembered is to be brought up to date where this is not 0
};

// Vertices at the hoist and the fly, and what fields are continued to them from (sim/cloth/cloth_ends.py). Field by field as in fused.py.
template <typename T>
struct Ends {
  int64_t count, width;
  const int32_t *vertex, *within;  // (count), (count, width)
  const T* weight;                 // (count, width)

  // In place, for fields of so many numbers a vertex, lanes innermost.
  template <typename V>
  void continued(T* field, int64_t numbers) const {
    const int64_t stride = numbers * int64_t(sizeof(V) / sizeof(T)), lanes = sizeof(V) / sizeof(T);
    for (int64_t e = 0; e < count; ++e)
      for (int64_t k = 0; k < numbers; ++k) {
        V sum = V{};
        for (int64_t d = 0; d < width; ++d)
          sum += weight[e * width + d] * load<V>(field + stride * within[e * width + d] + lanes * k);
        std::memcpy(field + stride * vertex[e] + lanes * k, &sum, sizeof sum);
      }
  }
};

// The cloth's vertices and faces. Fields are (vertex, 3, lane), and (vertex, lane) where they are scalar.
template <typename V>
struct Sheet {
  using T = Real<V>;
  static constexpr int64_t L = sizeof(V) / sizeof(T);
  int64_t vertices, faces;
  const int32_t* face;     // (faces, 3)
  const T* gradients;      // (faces, 2, 3)
  const T* areas;          // (faces)
  const T* vertex_areas;   // (vertices)
  const Ends<T>* ends;
  const T *position, *velocity;
  const T* air;            // the wind at the vertices, or one of all vertices where `uniform`
  bool uniform;
  const T *normals, *turning;  // a third of the areas of the faces around a vertex along their normals; and its rate
  T* scratch;                  // (vertices, 7, lane) of the effect's own
  const V* own;                // (vertices, number) the effect's numbers of each vertex; or null

  Vector3<V> at(const T* field, int64_t i) const {
    const T* p = field + 3 * L * i;
    return {load<V>(p), load<V>(p + L), load<V>(p + 2 * L)};
  }
  Vector3<V> wind(int64_t i) const { return at(air, uniform ? 0 : i); }
  static void add_at(T* field, int64_t i, Vector3<V> a) {
    T* p = field + 3 * L * i;
    for (const V& part : {a.x, a.y, a.z}) {
      const V sum = load<V>(p) + part;
      std::memcpy(p, &sum, sizeof sum);
      p += L;
    }
  }
  // A force [N] along a vertex's mean normal.
  void push_along_normal(T* force, int64_t i, V size) const {
    add_at(force, i, scale(at(normals, i), size / vertex_areas[i]));
  }
  // At the vertices, (vertices, lane) in the scratch: rest area times the rate of the velocity across the cloth, followed
  // along it by the air, without the term of the acceleration (sim/effects/reactive_loading.py); what is swept
  // is continued from within to the ends that are given.
  T* momentum_rates(const Ends<T>* continued) const {
    // The cloth's velocity across itself and the air's slip along it at the vertices, four numbers each; then what is
    // swept along the faces.
    T *const over = scratch, *const swept = over + 4 * L * vertices;
    const auto put = [](T* to, V value) { std::memcpy(to, &value, sizeof value); };
    for (int64_t i = 0; i < vertices; ++i) {
      const Vector3<V> normal = scale(at(normals, i), V{} + 1 / vertex_areas[i]);
      const Vector3<V> relative = sub(at(velocity, i), wind(i));
      const V across = dot(relative, normal);
      const Vector3<V> slip = sub(scale(normal, across), relative);
      T* to = over + 4 * L * i;
      put(to, across), put(to + L, slip.x), put(to + 2 * L, slip.y), put(to + 3 * L, slip.z);
      put(swept + L * i, V{});
    }
    if (continued) continued->template continued<V>(over, 4);
    for (int64_t e = 0; e < faces; ++e) {
      const int32_t* c = face + 3 * e;
      const T* d = gradients + 6 * e;
      const Vector3<V> x0 = at(position, c[0]), a = sub(at(position, c[1]), x0),
                       b = sub(at(position, c[2]), x0);
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
      const V given = (following + sum * spreading * T(0.5)) * (areas[e] * (T(1) / 9));
      for (int k = 0; k < 3; ++k) put(swept + L * c[k], load<V>(swept + L * c[k]) + given);
    }
    for (int64_t i = 0; i < vertices; ++i) {
      const Vector3<V> relative = sub(at(velocity, i), wind(i));
      put(swept + L * i, dot(at(turning, i), relative) + load<V>(swept + L * i));
    }
    return swept;
  }
};

// Where an effect enters the equations. `Act<V>` is the type of its function.
struct PressureFactor {  // on the base model's normal force, for its density and the relative wind across the face
  static constexpr int64_t kind = 0;
  template <typename V>
  using Act = void(const V* number, Real<V> density, const V& across, V& factor);
};
struct FaceForce {  // per rest area; a third acts on each corner
  static constexpr int64_t kind = 1;
  template <typename V>
  using Act = void(const V* number, const Face<V>& seen, Vector3<V>& push);
};
struct Flow {  // of the air at a vertex, whose offset is that from the middle of the attachments
  static constexpr int64_t kind = 2;
  template <typename V>
  using Act = void(const V* number, const Vector3<V>& offset, Vector3<V>& wind);
};
struct SheetForce {  // at the vertices, by all of the cloth: adds to (vertex, 3, lane)
  static constexpr int64_t kind = 3;
  template <typename V>
  using Act = void(const V* number, const Sheet<V>& sheet, Real<V>* force);
};
struct HingeMoment {  // times the fold's gradient it is a force on the four corners
  static constexpr int64_t kind = 4;
  template <typename V>
  using Act = void(const V* number, const Hinge<V>& hinge, V& moment);
};

template <typename Kind, typename Name, typename T, int L>
const void* act_of() {
  typename Kind::template Act<typename Vector<T, L>::type>* act = &Name::act;
  return reinterpret_cast<const void*>(act);
}

}  // namespace

#define EFFECT(Kind, Name)                                                            \
  extern "C" {                                                                        \
  int64_t Name##_kind() { return Kind::kind; }                                        \
  const void* Name##_f32() { return act_of<Kind, Name, float, SINGLES>(); }           \
  const void* Name##_f32_few() { return act_of<Kind, Name, float, 8>(); }             \
  const void* Name##_f64() { return act_of<Kind, Name, double, DOUBLES>(); }          \
  }
