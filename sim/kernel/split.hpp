// Steps of batches side by side as sim/integrate/split.py defines them: each batch's own impulses, one backward Euler step
// of the base model for the members of all, and what moves with each batch's cloth.

#pragma once

#include <deque>

#include "implicit.hpp"

namespace {

// A batch among the members of all. Field by field as in fused.py.
template <typename T>
struct Part {
  const Problem<T>* problem;  // with all that acts on it; its tie targets are (steps, blocks, ties, 3, L)
  int64_t blocks, first, count;  // its own blocks, and its members among all
};

// One block of a batch, through a step.
template <typename T, int L>
class Carried : Block<T, L> {
  using Base = Block<T, L>;
  using V = typename Base::V;
  using V3 = typename Base::V3;
  using Base::acting_, Base::b, Base::load, Base::load3, Base::p, Base::splat, Base::store;

  std::vector<T> x_, v_, f_, pushed_;

 public:
  Carried(const Problem<T>& problem, int64_t block, int64_t count) : Base(problem, block, count), f_(3 * L * problem.vertices) {
    x_ = v_ = pushed_ = f_;
  }

  bool pushes() const { return p.effects > 0 || p.ties > 0; }
  bool remembers() const {
    for (int64_t i = 0; i < p.effects; ++i)
      if (p.effect[i].memory) return true;
    return false;
  }
  T* x() { return x_.data(); }
  T* v() { return v_.data(); }
  const T* pushed() const { return pushed_.data(); }

  // Makes `pushed` the velocities that the base model's step begins with, in a wind.
  void push(V3 wind, T h) {
    std::fill(f_.begin(), f_.end(), T(0));
    if (p.effects > 0) this->beside(x(), v(), v(), T(0), wind, T(0), f_.data());
    const T* mass = p.mass + b * p.vertices * L;
    for (int64_t i = 0; i < p.vertices; ++i)
      for (int64_t k = 3 * L * i; k < 3 * L * (i + 1); k += L)
        store(pushed_.data() + k, load(v() + k) + h * load(f_.data() + k) / load(mass + i * L));
    for (int64_t t = 0; t < p.ties; ++t) {
      const int64_t i = p.tie_vertex[t], own = (b * p.ties + t) * L;
      const V3 stretch = sub(load3(x() + 3 * L * i), load3(p.tie_targets + 3 * own)), speed = load3(pushed_.data() + 3 * L * i);
      const V k = this->pull(own, stretch), m = load(mass + i * L), whole = m + h * h * k;
      const V3 after = combine(speed, m / whole, stretch, -h * k / whole);
      std::memcpy(pushed_.data() + 3 * L * i, &after, sizeof after);
    }
  }

  // Positions and velocities after the base model's step become those with air that moves along with the cloth.
  void carry(T* x, T* v, T h) {
    const T* mass = p.mass + b * p.vertices * L;
    for (int64_t i = 0; i < p.vertices; ++i)
      for (int64_t k = 3 * L * i; k < 3 * L * (i + 1); k += L)
        store(f_.data() + k, load(mass + i * L) * (load(v + k) - load(v_.data() + k)));
    acting_.share_with_air(x_.data(), f_.data());
    for (int64_t i = 0; i < p.vertices; ++i)
      for (int64_t k = 3 * L * i; k < 3 * L * (i + 1); k += L) {
        const V speed = load(v_.data() + k) + load(f_.data() + k) / load(mass + i * L);
        store(v + k, speed);
        store(x + k, load(x_.data() + k) + h * speed);
      }
  }

  // Brings what forces remember to positions and velocities after a step of h in a wind; the forces themselves are not
  // wanted.
  void remember(const T* x, const T* v, V3 wind, T h) { this->beside(x, v, v, T(0), wind, h, f_.data()); }
};

// A batch's blocks, and their members among all.
template <typename T, int L>
class Batch {
  Problem<T> now_;
  const Part<T>& part_;
  std::deque<Carried<T, L>> blocks_;
  std::vector<T> after_x_, after_v_;

  // A number of each member of a block, from the same place of all's blocks, which are `size` numbers apart.
  void gather(const T* from, int64_t size, int64_t block, int64_t numbers, T* to) const {
    for (int l = 0; l < L; ++l) {
      const int64_t own = block * L + l, member = part_.first + (own < part_.count ? own : part_.count - 1);
      const T* at = from + member / L * size + member % L;
      for (int64_t k = 0; k < numbers; ++k) to[k * L + l] = at[k * L];
    }
  }
  Vector3<typename Vector<T, L>::type> blown(const T* wind, int64_t block) const {
    typename Vector<T, L>::type own[3];
    gather(wind, 3 * L, block, 3, reinterpret_cast<T*>(own));
    return {own[0], own[1], own[2]};
  }
  void scatter(const T* from, int64_t block, int64_t numbers, T* to) const {
    for (int l = 0; l < L && block * L + l < part_.count; ++l) {
      const int64_t member = part_.first + block * L + l;
      T* at = to + member / L * numbers * L + member % L;
      for (int64_t k = 0; k < numbers; ++k) at[k * L] = from[k * L + l];
    }
  }

 public:
  explicit Batch(const Part<T>& part) : now_(*part.problem), part_(part) {
    for (int64_t b = 0; b < part.blocks; ++b) blocks_.emplace_back(now_, b, part.blocks);
    after_x_.resize(3 * L * now_.vertices), after_v_ = after_x_;
  }
  Batch(const Batch&) = delete;

  // In a wind (blocks of all, 3, L).
  void push(const T* x, T* v, const T* wind, T h) {
    const int64_t numbers = 3 * now_.vertices;
    for (int64_t b = 0; b < part_.blocks; ++b) {
      Carried<T, L>& own = blocks_[b];
      if (!own.pushes() && !now_.added_mass) continue;
      gather(x, numbers * L, b, numbers, own.x());
      gather(v, numbers * L, b, numbers, own.v());
      if (!own.pushes()) continue;
      own.push(blown(wind, b), h);
      scatter(own.pushed(), b, numbers, v);
    }
    now_.tie_targets += part_.blocks * now_.ties * 3 * L;
  }

  void carry(T* x, T* v, const T* wind, T h) {
    const int64_t numbers = 3 * now_.vertices;
    for (int64_t b = 0; b < part_.blocks; ++b) {
      Carried<T, L>& own = blocks_[b];
      const bool remembers = own.remembers();
      if (!now_.added_mass && !remembers) continue;
      gather(x, numbers * L, b, numbers, after_x_.data());
      gather(v, numbers * L, b, numbers, after_v_.data());
      if (now_.added_mass) {
        own.carry(after_x_.data(), after_v_.data(), h);
        scatter(after_x_.data(), b, numbers, x);
        scatter(after_v_.data(), b, numbers, v);
      }
      if (remembers) own.remember(after_x_.data(), after_v_.data(), blown(wind, b), h);
    }
  }
};

// Steps of all, for each of which there are a wind and targets of the handles: (steps, blocks, ...). Arguments as of
// `implicit`.
template <typename T, int L>
void split(const Problem<T>* p, int64_t blocks, T* x, T* v, int32_t* failed, double h, double tolerance, int64_t iterations,
           int64_t steps, const Part<T>* part, int64_t parts) {
  const int64_t size = p->vertices * 3 * L;
  Problem<T> now = *p;
  std::deque<Batch<T, L>> batches;
  for (int64_t i = 0; i < parts; ++i) batches.emplace_back(part[i]);
  for (int64_t s = 0; s < steps; ++s) {
    for (auto& batch : batches) batch.push(x, v, now.wind, T(h));
    for (int64_t b = 0; b < blocks; ++b)
      Implicit<T, L>(now, b, blocks).step(x + b * size, v + b * size, failed + b * L, T(h), T(0), tolerance, iterations);
    for (auto& batch : batches) batch.carry(x, v, now.wind, T(h));
    now.wind += blocks * 3 * L;
    now.targets += blocks * p->held * 3 * L;
    now.tie_targets += blocks * p->ties * 3 * L;
  }
}

}  // namespace
