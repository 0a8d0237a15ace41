// Fields on the faces and hinges of a mesh in one pass, as air.py, cloth_batch.py, inertia.py and bending.py
// of sim/cloth define them.
//
// Members are innermost: L of them are taken at a time, and those left over beside empty lanes. Every member has the same
// operations in the same order, so that what it gets does not depend on the others.

#pragma once

#include "block.hpp"

namespace on_mesh {

// Vectors at the vertices of all members. Field by field as in on_mesh.py.
template <typename T>
struct View {
  const T* data;
  int64_t vertex, component;  // strides; that of the vertex is 0 where all have one vector
};

template <typename T, int L>
class Fields : Block<T, L> {
  using Base = Block<T, L>;
  using V = typename Base::V;
  using V3 = typename Base::V3;
  using Base::splat;

  static V load(const T* p, size_t size) {
    V v{};
    if (size == sizeof v)
      std::memcpy(&v, p, sizeof v);
    else
      std::memcpy(&v, p, size);
    return v;
  }
  static void store(T* p, V v, size_t size) {
    if (size == sizeof v)
      std::memcpy(p, &v, sizeof v);
    else
      std::memcpy(p, &v, size);
  }
  // A vector at a vertex.
  static V3 get(const View<T>& field, int64_t i, size_t size) {
    const T* p = field.data + i * field.vertex;
    return {load(p, size), load(p + field.component, size), load(p + 2 * field.component, size)};
  }
  // Of a contiguous (row, 3, batch) field.
  static void put(T* field, int64_t i, int64_t batch, V3 a, size_t size) {
    T* p = field + 3 * batch * i;
    store(p, a.x, size);
    store(p + batch, a.y, size);
    store(p + 2 * batch, a.z, size);
  }
  static V3 over(V3 a, V b) { return {a.x / b, a.y / b, a.z / b}; }
  static View<T> shifted(View<T> field, int64_t members) { return {field.data + members, field.vertex, field.component}; }

  // Calls `each` with the first member of every L of them, and with the bytes of those that there are.
  template <typename F>
  static void by_lanes(int64_t batch, F each) {
    for (int64_t from = 0; from < batch; from += L) each(from, sizeof(T) * size_t(batch - from < L ? batch - from : L));
  }

 public:
  // Unit normals of faces, the wind relative to them, and its part along the normals.
  static void face_wind(const int64_t* face, int64_t faces, int64_t batch, View<T> position, View<T> velocity, View<T> wind,
                        T* normal, T* relative, T* across) {
    by_lanes(batch, [&](int64_t from, size_t size) {
      const View<T> x = shifted(position, from), v = shifted(velocity, from), u = shifted(wind, from);
      for (int64_t e = 0; e < faces; ++e) {
        const int64_t* c = face + 3 * e;
        const V3 x0 = get(x, c[0], size);
        const V3 area = cross(sub(get(x, c[1], size), x0), sub(get(x, c[2], size), x0));
        const V3 n = over(area, maximum(root(dot(area, area)), splat(std::numeric_limits<T>::min())));
        V3 w = sub(get(u, c[0], size), get(v, c[0], size));
        for (int k = 1; k < 3; ++k) w = combine(w, splat(1), sub(get(u, c[k], size), get(v, c[k], size)), splat(1));
        w = over(w, splat(3));
        put(normal + from, e, batch, n, size);
        put(relative + from, e, batch, w, size);
        store(across + batch * e + from, dot(w, n), size);
      }
    });
  }

  // (x1 - x0) × (x2 - x0) / 6 of every face.
  static void normals(const int64_t* face, int64_t faces, int64_t batch, View<T> position, T* sixth) {
    by_lanes(batch, [&](int64_t from, size_t size) {
      const View<T> x = shifted(position, from);
      for (int64_t e = 0; e < faces; ++e) {
        const int64_t* c = face + 3 * e;
        const V3 x0 = get(x, c[0], size);
        put(sixth + from, e, batch, over(cross(sub(get(x, c[1], size), x0), sub(get(x, c[2], size), x0)), splat(6)), size);
      }
    });
  }

  // Its time derivative.
  static void normal_rates(const int64_t* face, int64_t faces, int64_t batch, View<T> position, View<T> velocity, T* sixth) {
    by_lanes(batch, [&](int64_t from, size_t size) {
      const View<T> x = shifted(position, from), v = shifted(velocity, from);
      for (int64_t e = 0; e < faces; ++e) {
        const int64_t* c = face + 3 * e;
        const V3 x0 = get(x, c[0], size), v0 = get(v, c[0], size);
        const V3 a = sub(get(x, c[1], size), x0), b = sub(get(x, c[2], size), x0);
        const V3 turned = combine(cross(sub(get(v, c[1], size), v0), b), splat(1),
                                  cross(a, sub(get(v, c[2], size), v0)), splat(1));
        put(sixth + from, e, batch, over(turned, splat(6)), size);
      }
    });
  }

  // Sums at the vertices what the corners of elements get, `width` numbers each: `slots` (k, vertex) are rows of the
  // stacked corners, padded with their number.
  static void gather(const T* const* corner, int64_t corners, int64_t elements, const int64_t* slots, int64_t k,
                     int64_t vertices, int64_t width, T* total) {
    by_lanes(width, [&](int64_t from, size_t size) {
      for (int64_t i = 0; i < vertices; ++i) {
        V sum = {};
        for (int64_t s = 0; s < k; ++s) {
          const int64_t slot = slots[s * vertices + i];
          if (slot == corners * elements) break;
          sum += load(corner[slot / elements] + width * (slot % elements) + from, size);
        }
        store(total + width * i + from, sum, size);
      }
    });
  }

  // Fold angles of hinges; and their gradients at the corners i, j, k, l, where `gradient` is not null.
  static void fold(const int64_t* hinge, int64_t hinges, int64_t batch, View<T> position, T* angle, T* const* gradient) {
    by_lanes(batch, [&](int64_t from, size_t size) {
      const View<T> x = shifted(position, from);
      for (int64_t e = 0; e < hinges; ++e) {
        const int64_t* c = hinge + 4 * e;
        const V3 xi = get(x, c[0], size);
        V3 g[4];
        V bent;
        Base::fold(sub(get(x, c[1], size), xi), sub(get(x, c[2], size), xi), sub(get(x, c[3], size), xi), g, bent);
        store(angle + batch * e + from, bent, size);
        if (gradient)
          for (int i = 0; i < 4; ++i) put(gradient[i] + from, e, batch, g[i], size);
      }
    });
  }
};

}  // namespace on_mesh
