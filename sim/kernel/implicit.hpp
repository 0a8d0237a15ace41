// One linearised backward Euler step for one block, as sim/integrate/implicit.py defines it: the stiffness of every face
// and hinge is kept for the step, and conjugate gradients solve each lane until it has converged by itself. What acts
// beside the base model is explicit; air that moves with the cloth is mass, and ties are springs as handles are.

#pragma once

#include "block.hpp"

namespace {

template <typename T, int L>
class Implicit : Block<T, L> {
  using Base = Block<T, L>;
  using V = typename Base::V;
  using V3 = typename Base::V3;
  using Base::acting_, Base::add3, Base::b, Base::blocks, Base::damping, Base::load, Base::load3, Base::p, Base::splat, Base::store;

  struct Face {
    V3 xu, xv;
    V k0, k1, k2, k3, tu, tv;  // stiffness times rest area
  };
  struct Hinge {
    V3 gradient[4];
    V k;
  };
  std::vector<Face> faces_;
  std::vector<Hinge> hinges_;
  std::vector<V> diagonal_, right_, residual_, direction_, image_, solution_;
  std::vector<V> carried_;  // the root of the air's mass times the mean normal, at each vertex
  std::vector<V> tied_;     // stiffness of each tie

  static V3 derive(V3 a, V3 b, V3 c, const T* d) {
    return {a.x * d[0] + b.x * d[1] + c.x * d[2], a.y * d[0] + b.y * d[1] + c.y * d[2],
            a.z * d[0] + b.z * d[1] + c.z * d[2]};
  }
  static V3 get(const V* field, int64_t i) { return {field[3 * i], field[3 * i + 1], field[3 * i + 2]}; }
  static void add(V* field, int64_t i, V3 a) {
    field[3 * i] += a.x;
    field[3 * i + 1] += a.y;
    field[3 * i + 2] += a.z;
  }
  static V3 square(V3 a) { return {a.x * a.x, a.y * a.y, a.z * a.z}; }

  // Keeps the stiffness of all faces at x, adds their elastic force to f and their diagonal to d.
  void linearise_faces(const T* x, V* f, V* d) {
    faces_.resize(p.faces);
    for (int64_t e = 0; e < p.faces; ++e) {
      const int32_t* c = p.face + 3 * e;
      const T* g = p.gradients + 6 * e;
      const T area = p.areas[e];
      const V3 x0 = load3(x + 3 * L * c[0]), x1 = load3(x + 3 * L * c[1]), x2 = load3(x + 3 * L * c[2]);
      Face& s = faces_[e];
      s.xu = derive(x0, x1, x2, g);
      s.xv = derive(x0, x1, x2, g + 3);
      const V g00 = (dot(s.xu, s.xu) - 1) * T(0.5), g11 = (dot(s.xv, s.xv) - 1) * T(0.5), g01 = dot(s.xu, s.xv) * T(0.5);
      V k[4];
      this->stiffness(g00, g11, g01, k);
      s.k0 = k[0] * area, s.k1 = k[1] * area, s.k2 = k[2] * area, s.k3 = k[3] * area;
      const V p00 = maximum(g00, V{}), p11 = maximum(g11, V{});
      s.tu = s.k0 * p00 + s.k1 * p11;
      s.tv = s.k2 * p11 + s.k1 * p00;
      const V t00 = s.k0 * g00 + s.k1 * g11, t11 = s.k2 * g11 + s.k1 * g00, t01 = s.k3 * g01;
      const V3 pu = combine(s.xu, t00, s.xv, t01), pv = combine(s.xv, t11, s.xu, t01);
      for (int i = 0; i < 3; ++i) {
        add(f, c[i], combine(pu, splat(-g[i]), pv, splat(-g[3 + i])));
        const T gu = g[i], gv = g[3 + i];
        const V3 uu = square(s.xu), vv = square(s.xv), cross = {s.xu.x * s.xv.x, s.xu.y * s.xv.y, s.xu.z * s.xv.z};
        const V tension = gu * gu * s.tu + gv * gv * s.tv;
        const V a = gu * gu * s.k0 + T(0.5) * gv * gv * s.k3, b2 = gv * gv * s.k2 + T(0.5) * gu * gu * s.k3;
        const V m = gu * gv * (2 * s.k1 + s.k3);
        add(d, c[i], {uu.x * a + vv.x * b2 + cross.x * m + tension, uu.y * a + vv.y * b2 + cross.y * m + tension,
                      uu.z * a + vv.z * b2 + cross.z * m + tension});
      }
    }
  }

  void linearise_hinges(const T* x, V* f, V* d) {
    hinges_.resize(p.hinges);
    for (int64_t e = 0; e < p.hinges; ++e) {
      const int32_t* c = p.hinge + 4 * e;
      Hinge& s = hinges_[e];
      V angle;
      this->fold(x, e, s.gradient, angle);
      s.k = this->bending(e, angle);
      for (int i = 0; i < 4; ++i) {
        add(f, c[i], scale(s.gradient[i], -s.k * angle));
        add(d, c[i], scale(square(s.gradient[i]), s.k));
      }
    }
  }

  // Stiffness of faces, hinges and handle springs times a field, into `product`.
  void multiply(const V* field, V* product) const {
    for (int64_t i = 0; i < 3 * p.vertices; ++i) product[i] = V{};
    for (int64_t e = 0; e < p.faces; ++e) {
      const int32_t* c = p.face + 3 * e;
      const T* g = p.gradients + 6 * e;
      const Face& s = faces_[e];
      const V3 f0 = get(field, c[0]), f1 = get(field, c[1]), f2 = get(field, c[2]);
      const V3 fu = derive(f0, f1, f2, g), fv = derive(f0, f1, f2, g + 3);
      const V s00 = dot(s.xu, fu), s11 = dot(s.xv, fv), s01 = T(0.5) * (dot(s.xu, fv) + dot(s.xv, fu));
      const V t00 = s.k0 * s00 + s.k1 * s11, t11 = s.k2 * s11 + s.k1 * s00, t01 = s.k3 * s01;
      const V3 pu = combine(s.xu, t00, s.xv, t01), pv = combine(s.xv, t11, s.xu, t01);
      const V3 qu = combine(pu, splat(1), fu, s.tu), qv = combine(pv, splat(1), fv, s.tv);
      for (int i = 0; i < 3; ++i) add(product, c[i], combine(qu, splat(g[i]), qv, splat(g[3 + i])));
    }
    for (int64_t e = 0; e < p.hinges; ++e) {
      const int32_t* c = p.hinge + 4 * e;
      const Hinge& s = hinges_[e];
      V rate = V{};
      for (int i = 0; i < 4; ++i) rate += dot(s.gradient[i], get(field, c[i]));
      for (int i = 0; i < 4; ++i) add(product, c[i], scale(s.gradient[i], s.k * rate));
    }
    if (p.stiffness > 0)
      for (int64_t h = 0; h < p.held; ++h)
        add(product, p.held_vertex[h], scale(get(field, p.held_vertex[h]), splat(T(p.stiffness))));
    for (int64_t t = 0; t < p.ties; ++t) add(product, p.tie_vertex[t], scale(get(field, p.tie_vertex[t]), tied_[t]));
  }

  // Keeps the stiffness of ties at x, adds their force to f and their diagonal to d.
  void linearise_ties(const T* x, V* f, V* d) {
    tied_.resize(p.ties);
    for (int64_t t = 0; t < p.ties; ++t) {
      const int64_t i = p.tie_vertex[t], own = (b * p.ties + t) * L;
      const V3 stretch = sub(load3(x + 3 * L * i), load3(p.tie_targets + 3 * own));
      tied_[t] = this->pull(own, stretch);
      add(f, i, scale(stretch, -tied_[t]));
      add(d, i, {tied_[t], tied_[t], tied_[t]});
    }
  }

  // Keeps what air moves along with each vertex at x.
  void carry(const T* x) {
    carried_.assign(p.added_mass ? 3 * p.vertices : 0, V{});
    if (!p.added_mass) return;
    acting_.orient(x);
    for (int64_t i = 0; i < p.vertices; ++i)
      add(carried_.data(), i, scale(acting_.mean_normal(i), root(load(p.added_mass + (b * p.vertices + i) * L))));
  }

 public:
  using Base::Base;

  // x and v become those after a step of h, at whose start `wind` blows and at whose end the handles are at `targets`; the
  // air sees the shape x - lag v.
  void step(T* x, T* v, int32_t* failed, T h, T lag, double tolerance, int64_t iterations) {
    const int64_t n = 3 * p.vertices;
    const T* inverse = p.inverse_mass + b * p.vertices * L;
    for (int64_t s = 0; s < p.held; ++s)
      if (inverse[p.held_vertex[s] * L] == 0)  // held rigidly
        for (int c = 0; c < 3; ++c) {
          const int64_t i = 3 * int64_t(p.held_vertex[s]) + c;
          store(v + i * L, (load(p.targets + ((b * p.held + s) * 3 + c) * L) - load(x + i * L)) / h);
        }
    for (auto* field : {&diagonal_, &right_, &residual_, &direction_, &image_, &solution_}) field->assign(n, V{});
    // Gravity and air go into right_ first; contact and elastic forces of the explicit step are not wanted here.
    this->external(x, v, lag, reinterpret_cast<T*>(right_.data()));
    if (p.effects > 0) this->beside(x, v, v, lag, load3(p.wind + b * 3 * L), T(0), reinterpret_cast<T*>(right_.data()));
    carry(x);
    linearise_ties(x, right_.data(), diagonal_.data());
    linearise_faces(x, right_.data(), diagonal_.data());
    linearise_hinges(x, right_.data(), diagonal_.data());
    const T* mass = p.mass + b * p.vertices * L;
    if (p.stiffness > 0)
      for (int64_t s = 0; s < p.held; ++s)
        for (int c = 0; c < 3; ++c) {
          const int64_t i = 3 * int64_t(p.held_vertex[s]) + c;
          const V target = load(p.targets + ((b * p.held + s) * 3 + c) * L);
          right_[i] -= T(p.stiffness) * (load(x + i * L) - target);
          diagonal_[i] += T(p.stiffness);
        }
    const V factor = h * (h + damping);
    for (int64_t i = 0; i < n; ++i) direction_[i] = load(v + i * L);
    multiply(direction_.data(), image_.data());
    V product = V{};
    for (int64_t i = 0; i < p.vertices; ++i) {
      const V free = load(inverse + i * L) == 0 ? V{} : splat(1);
      const V m = load(mass + i * L);
      for (int64_t k = 3 * i; k < 3 * i + 3; ++k) {
        residual_[k] = free * (h * right_[k] - factor * image_[k]);
        const V moved = carried_.empty() ? m : m + carried_[k] * carried_[k];
        diagonal_[k] = 1 / (moved + factor * diagonal_[k]);
        direction_[k] = residual_[k] * diagonal_[k];
        product += residual_[k] * direction_[k];
      }
    }
    const V goal = T(tolerance) * T(tolerance) * product;
    V active = product > 0 ? splat(1) : V{};
    for (int64_t iteration = 0; iteration < iterations && any(active); ++iteration) {
      multiply(direction_.data(), image_.data());
      V curvature = V{};
      for (int64_t i = 0; i < p.vertices; ++i) {
        const V free = load(inverse + i * L) == 0 ? V{} : splat(1);
        const V m = load(mass + i * L);
        const V along = carried_.empty() ? V{} : dot(get(carried_.data(), i), get(direction_.data(), i));
        for (int64_t k = 3 * i; k < 3 * i + 3; ++k) {
          image_[k] = free * (m * direction_[k] + factor * image_[k]);
          if (!carried_.empty()) image_[k] += free * carried_[k] * along;
          curvature += direction_[k] * image_[k];
        }
      }
      const V length = active > 0 ? product / curvature : V{};
      V following = V{};
      for (int64_t k = 0; k < n; ++k) {
        solution_[k] += length * direction_[k];
        residual_[k] -= length * image_[k];
        following += residual_[k] * residual_[k] * diagonal_[k];
      }
      const V turn = following / product;
      for (int64_t k = 0; k < n; ++k) {
        const V next = residual_[k] * diagonal_[k] + turn * direction_[k];
        direction_[k] = active > 0 ? next : direction_[k];
      }
      product = active > 0 ? following : product;
      active = (product <= goal || !(product < std::numeric_limits<T>::infinity())) ? V{} : active;
    }
    for (int l = 0; l < L; ++l) failed[l] |= !(product[l] <= goal[l]);
    for (int64_t k = 0; k < n; ++k) {
      const V speed = load(v + k * L) + solution_[k];
      store(v + k * L, speed);
      store(x + k * L, load(x + k * L) + h * speed);
    }
  }

 private:
  static bool any(V active) {
    for (int l = 0; l < L; ++l)
      if (active[l] > 0) return true;
    return false;
  }
};

}  // namespace
