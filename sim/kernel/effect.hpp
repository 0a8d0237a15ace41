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
  Vector3<V> along() const { return sub(relative, scale(normal, across)); }
};

// A fold about an edge.
template <typename V>
struct Hinge {
  V angle, stiffness;  // stiffness times angle is the elastic moment
  const V* own;        // the effect's numbers of this hinge
  V *past, *angle_before;  // what a friction remembers, and the angle that was at
  bool moved;          // since then: what is remembered is to be brought up to date
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
  const T *position, *velocity;
  const T* air;            // the wind at the vertices, or one of all vertices where `uniform`
  bool uniform;
  const T *normals, *turning;  // a third of the areas of the faces around a vertex along their normals; and its rate
  T* scratch;                  // (vertices, 7, lane) of the effect's own

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
