// The base model on a CPU: membrane, bending, gravity, quadratic-normal air, handle springs, contact, limits, leapfrog.
//
// The torch source (sim/cloth: membrane.py, bending.py, air.py, system.py; sim/integrate/symplectic.py) is the definition; this file
// repeats it for speed and is tested against it. One block holds L members of the batch side by side, in vector
// registers; every lane does the same operations in the same order, so a member's result does not depend on the others.

#pragma once

#include <vector>

#include "acting.hpp"

namespace {

template <typename T, int L>
class Block {
 protected:
  using V = typename Vector<T, L>::type;
  using I = typename Vector<T, L>::index;
  using V3 = Vector3<V>;

  static V splat(T value) { return V{} + value; }
  static V load(const T* p) { return ::load<V>(p); }
  static void store(T* p, V v) { std::memcpy(p, &v, sizeof v); }
  static V3 load3(const T* p) { return {load(p), load(p + L), load(p + 2 * L)}; }
  static void add3(T* p, V3 a) {
    store(p, load(p) + a.x);
    store(p + L, load(p + L) + a.y);
    store(p + 2 * L, load(p + 2 * L) + a.z);
  }

  const Problem<T>& p;
  const int64_t b, blocks;
  const V damping;
  I base;
  contact::Lists<T, L>* const lists_;
  std::vector<contact::Point<T>> lane_, speed_;  // positions and velocities of one lane
  std::vector<T> near_;                          // and its near allowances
  T step_ = 0;            // of the time, where steps follow one another
  Acting<T, L> acting_;
  std::vector<T> level_;   // velocities at the full step, carried on by the last acceleration
  std::vector<T> before_;  // positions one sweep of the limits ago

 public:
  Block(const Problem<T>& problem, int64_t block, int64_t count, contact::Lists<T, L>* lists = nullptr)
      : p(problem), b(block), blocks(count), damping(load(problem.damping + block * L)), lists_(lists), acting_(problem, block) {
    for (int l = 0; l < L; ++l) base[l] = p.table[b * L + l] * int32_t(p.counts[0] * p.counts[1] * p.counts[2]);
  }

  // Cell and share of a coordinate of the stretching grid.
  static void locate(V place, int64_t count, I& cell, V& share) {
    place = minimum(maximum(place, splat(0)), splat(T(count - 1)));
    cell = __builtin_convertvector(place, I);
    I last = I{} + int32_t(count - 2);
    cell = cell < last ? cell : last;
    share = place - __builtin_convertvector(cell, V);
  }

  void stiffness(V g00, V g11, V g01, V k[4]) const {
    I c0, c1, c2;
    V w0, w1, w2;
    const T inverse = T(1 / p.spacing), origin = T(p.origin);
    locate((g00 - origin) * inverse, p.counts[0], c0, w0);
    locate((g11 - origin) * inverse, p.counts[1], c1, w1);
    locate(absolute(g01) * inverse, p.counts[2], c2, w2);
    const int64_t n2 = p.counts[2], n12 = p.counts[1] * n2;
    const I cell = base + (c0 * int32_t(p.counts[1]) + c1) * int32_t(n2) + c2;
    const std::make_integer_sequence<int, L> all;
    const V part[4] = {quarter<0>(cell, n2, n12, w0, w1, w2, all), quarter<1>(cell, n2, n12, w0, w1, w2, all),
                       quarter<2>(cell, n2, n12, w0, w1, w2, all), quarter<3>(cell, n2, n12, w0, w1, w2, all)};
    const V p01 = pairs<0>(part[0], part[1], all), q01 = pairs<2>(part[0], part[1], all);
    const V p23 = pairs<0>(part[2], part[3], all), q23 = pairs<2>(part[2], part[3], all);
    k[0] = halves<0>(p01, p23, all), k[1] = halves<1>(p01, p23, all);
    k[2] = halves<0>(q01, q23, all), k[3] = halves<1>(q01, q23, all);
  }

 private:
  // Of a quarter of the lanes, the four numbers of each side by side in one register.
  template <int which, int... n>
  V quarter(const I& cell, int64_t n2, int64_t n12, V w0, V w1, V w2, std::integer_sequence<int, n...> all) const {
    const V share = shuffled<(which * (L / 4) + n / 4)...>(w2, w2);
    if constexpr (L < 8) {
      const V low = between<which>(cell, 0, n2, n12, w0, w1, all);
      const V high = between<which>(cell, 1, n2, n12, w0, w1, all);
      return low + share * (high - low);
    } else {
      const V a = between<2 * which>(cell, 0, n2, n12, w0, w1, all);
      const V b = between<2 * which + 1>(cell, 0, n2, n12, w0, w1, all);
      const V low = shuffled<((n / 4) * 8 + n % 4)...>(a, b);
      const V high = shuffled<((n / 4) * 8 + 4 + n % 4)...>(a, b);
      return low + share * (high - low);
    }
  }
  // Between the lines of the table along the shear: as many of its numbers of each lane as fit, eight or four, from
  // `offset` nodes along the line on. Eight are those at both nodes about the shear.
  template <int which, int... n>
  V between(const I& cell, int64_t offset, int64_t n2, int64_t n12, V w0, V w1, std::integer_sequence<int, n...>) const {
    constexpr int width = L < 8 ? 4 : 8, count = L / width, first = which * count;
    const T* s[count];
    for (int j = 0; j < count; ++j) s[j] = p.samples + 4 * (cell[first + j] + offset);
    const auto at = [&](int64_t node) { return side_by_side<width, count>(s, 4 * node); };
    w0 = shuffled<(first + n / width)...>(w0, w0);
    w1 = shuffled<(first + n / width)...>(w1, w1);
    const auto line = [&](int64_t node) {
      const V low = at(node);
      return low + w1 * (at(node + n2) - low);
    };
    const V low = line(0);
    return low + w0 * (line(n12) - low);
  }
  template <int width, int count>
  static auto side_by_side(const T* const* s, int64_t offset) {
    if constexpr (count == 1) {
      typedef T Part __attribute__((vector_size(sizeof(T) * width)));
      Part v;
      std::memcpy(&v, *s + offset, sizeof v);
      return v;
    } else {
      const auto first = side_by_side<width, count / 2>(s, offset);
      const auto second = side_by_side<width, count / 2>(s + count / 2, offset);
      return joined(first, second, std::make_integer_sequence<int, width * count>());
    }
  }
  template <typename Half, int... n>
  static auto joined(Half a, Half b, std::integer_sequence<int, n...>) {
    return shuffled<n...>(a, b);
  }
  // The numbers at places of a and, counted on, of b. Compilers before GCC 12 have no word for it.
  template <int... n, typename Given>
  static auto shuffled(Given a, Given b) {
#if defined(__clang__) || __GNUC__ >= 12
    return __builtin_shufflevector(a, b, n...);
#else
    typedef T Result __attribute__((vector_size(sizeof(T) * sizeof...(n))));
    constexpr int place[] = {n...}, size = sizeof(Given) / sizeof(T);
    Result result;
    for (size_t i = 0; i < sizeof...(n); ++i) result[i] = place[i] < size ? a[place[i]] : b[place[i] - size];
    return result;
#endif
  }
  // Of four numbers of each lane, the two from `of` on: those of all lanes of a and b, then the next ones.
  template <int of, int... n>
  static V pairs(V a, V b, std::integer_sequence<int, n...>) {
    return shuffled<(4 * (n % (L / 2)) + of + n / (L / 2))...>(a, b);
  }
  // The first or second half of a, then that of b.
  template <int half, int... n>
  static V halves(V a, V b, std::integer_sequence<int, n...>) {
    return shuffled<(n % (L / 2) + half * (L / 2) + (n / (L / 2)) * L)...>(a, b);
  }

 public:
  // The air's force on each corner of a face.
  V3 pushed(V3 x0, V3 x1, V3 x2, V3 v0, V3 v1, V3 v2, V3 wind, T area) const {
    V3 normal = cross(sub(x1, x0), sub(x2, x0));
    const V length = root(dot(normal, normal));
    normal = scale(normal, 1 / maximum(length, splat(T(1e-30))));
    const T third = T(1) / 3;
    const V3 relative = {wind.x - (v0.x + v1.x + v2.x) * third, wind.y - (v0.y + v1.y + v2.y) * third,
                         wind.z - (v0.z + v1.z + v2.z) * third};
    const V across = dot(relative, normal);
    const T share = area * third, drag = T(p.air_drag) * share;
    return combine(normal, T(p.air_density) * share * absolute(across) * across - drag * across, relative, splat(drag));
  }

  // Gravity, and the air at the drive's start on the shape x - lag v.
  void external(const T* x, const T* v, T lag, T* f) const {
    weigh(f);
    if (p.air_density == 0 && p.air_drag == 0) return;
    const V3 wind = load3(p.wind + b * 3 * L);
    for (int64_t e = 0; e < p.faces; ++e) {
      const int32_t* c = p.face + 3 * e;
      V3 at[3], speed[3];
      for (int i = 0; i < 3; ++i) {
        speed[i] = load3(v + 3 * L * int64_t(c[i]));
        at[i] = combine(load3(x + 3 * L * int64_t(c[i])), splat(1), speed[i], splat(-lag));
      }
      const V3 push = pushed(at[0], at[1], at[2], speed[0], speed[1], speed[2], wind, p.areas[e]);
      for (int i = 0; i < 3; ++i) add3(f + 3 * L * int64_t(c[i]), push);
    }
  }

  void weigh(T* f) const {
    const V3 g = load3(p.gravity + b * 3 * L);
    const T* mass = p.mass + b * p.vertices * L;
    for (int64_t i = 0; i < p.vertices; ++i) {
      const V m = load(mass + i * L);
      store(f + 3 * L * i, m * g.x);
      store(f + 3 * L * i + L, m * g.y);
      store(f + 3 * L * i + 2 * L, m * g.z);
    }
  }

  void faces(const T* x, const T* v, V3 wind, T* f) const {
    const bool air = p.air_density != 0 || p.air_drag != 0;
    for (int64_t e = 0; e < p.faces; ++e) {
      const int64_t i0 = 3 * L * int64_t(p.face[3 * e]), i1 = 3 * L * int64_t(p.face[3 * e + 1]),
                    i2 = 3 * L * int64_t(p.face[3 * e + 2]);
      const T* g = p.gradients + 6 * e;
      const T area = p.areas[e];
      const V3 x0 = load3(x + i0), x1 = load3(x + i1), x2 = load3(x + i2);
      const V3 v0 = load3(v + i0), v1 = load3(v + i1), v2 = load3(v + i2);
      auto derive = [](V3 a, V3 b, V3 c, const T* d) -> V3 {
        return {a.x * d[0] + b.x * d[1] + c.x * d[2], a.y * d[0] + b.y * d[1] + c.y * d[2],
                a.z * d[0] + b.z * d[1] + c.z * d[2]};
      };
      const V3 xu = derive(x0, x1, x2, g), xv = derive(x0, x1, x2, g + 3);
      const V3 vu = derive(v0, v1, v2, g), vv = derive(v0, v1, v2, g + 3);
      const V g00 = (dot(xu, xu) - 1) * T(0.5), g11 = (dot(xv, xv) - 1) * T(0.5), g01 = dot(xu, xv) * T(0.5);
      V k[4];
      stiffness(g00, g11, g01, k);
      const V s00 = g00 + damping * dot(xu, vu), s11 = g11 + damping * dot(xv, vv);
      const V s01 = g01 + damping * T(0.5) * (dot(xu, vv) + dot(xv, vu));
      const V t00 = (k[0] * s00 + k[1] * s11) * area, t11 = (k[2] * s11 + k[1] * s00) * area, t01 = k[3] * s01 * area;
      const V3 pu = combine(xu, t00, xv, t01), pv = combine(xv, t11, xu, t01);
      const V3 push = air ? pushed(x0, x1, x2, v0, v1, v2, wind, area) : V3{V{}, V{}, V{}};
      const int64_t at[3] = {i0, i1, i2};
      for (int c = 0; c < 3; ++c) {
        const V3 inner = combine(pu, splat(g[c]), pv, splat(g[3 + c]));
        add3(f + at[c], sub(push, inner));
      }
    }
  }

  // Fold angle of a hinge and its gradients at the corners i, j, k, l.
  void fold(const T* x, int64_t e, V3 g[4], V& angle) const {
    const int32_t* c = p.hinge + 4 * e;
    const V3 xi = load3(x + 3 * L * int64_t(c[0]));
    fold(sub(load3(x + 3 * L * int64_t(c[1])), xi), sub(load3(x + 3 * L * int64_t(c[2])), xi),
         sub(load3(x + 3 * L * int64_t(c[3])), xi), g, angle);
  }

  // The same by the vectors from i to j, k and l.
  static void fold(V3 edge, V3 left, V3 right, V3 g[4], V& angle) {
    const V3 normal0 = cross(edge, left), normal1 = cross(right, edge);
    const V square = dot(edge, edge), length = root(square), inverse = 1 / length, tiny = splat(T(1e-30));
    const V inverse0 = 1 / maximum(norm(normal0), tiny), inverse1 = 1 / maximum(norm(normal1), tiny);
    const V3 n0 = scale(normal0, inverse0), n1 = scale(normal1, inverse1);
    // Divided by the altitudes, which are held at a thousandth of the edge.
    const V steepest = 1000 * inverse;
    g[2] = scale(n0, minimum(length * inverse0, steepest));
    g[3] = scale(n1, minimum(length * inverse1, steepest));
    const V w0 = dot(edge, left) * (inverse * inverse), w1 = dot(edge, right) * (inverse * inverse);
    const V sine = -dot(edge, cross(n0, n1)) * inverse, cosine = dot(n0, n1);
    angle = arctangent2(sine, cosine);
    g[0] = combine(g[2], w0 - 1, g[3], w1 - 1);
    g[1] = combine(g[2], -w0, g[3], -w1);
  }

  // k S / 2 of a hinge at a fold angle.
  V bending(int64_t e, V angle) const {
    const T* segments = p.segments + b * 15 * L;
    V column = angle * p.hinge_column[e];
    if (p.fold) column = absolute(column);
    column = minimum(column, splat(4));
    const V c1 = maximum(column - 1, V{}), c2 = maximum(column - 2, V{}), c3 = maximum(column - 3, V{});
    V k = V{};
    for (int r = 0; r < 3; ++r) {
      const T weight = p.hinge_rows[3 * e + r];
      if (weight == 0) continue;
      const T* s = segments + 5 * L * r;
      k += weight * (load(s) + load(s + L) * column + load(s + 2 * L) * c1 + load(s + 3 * L) * c2 + load(s + 4 * L) * c3);
    }
    k = maximum(k, V{}) * (p.hinge_shape[e] * T(0.5));
    return p.stiffening ? k * (1 + load(p.stiffening + (b * p.hinges + e) * L)) : k;
  }

  void hinges(const T* x, const T* v, T elapsed, T* f) const {
    const bool folds = acting_.folds();
    for (int64_t e = 0; e < p.hinges; ++e) {
      const int32_t* c = p.hinge + 4 * e;
      V3 g[4];
      V angle, rate = V{};
      fold(x, e, g, angle);
      for (int i = 0; i < 4; ++i) rate += dot(g[i], load3(v + 3 * L * int64_t(c[i])));
      const V k = bending(e, angle);
      V moment = -k * (angle + damping * rate);
      if (folds) acting_.add_moments(e, angle, k, elapsed, moment);
      for (int i = 0; i < 4; ++i) add3(f + 3 * L * int64_t(c[i]), scale(g[i], moment));
    }
  }

  // Every lane by itself: their candidates differ.
  void contacts(const T* x, const T* v, T* f) {
    const int64_t n = p.vertices;
    const int real = int(p.batch - b * L < L ? p.batch - b * L : L);
    auto& [search, seen, moved, allowed] = *lists_;
    auto beyond = V{} > V{};
    if (seen.empty()) {
      seen.resize(3 * L * n), moved.resize(L * n), allowed.resize(L * n);
      beyond = ~beyond;
    } else {
      for (int64_t i = 0; i < n; ++i) {
        const V3 move = sub(load3(x + 3 * L * i), load3(seen.data() + 3 * L * i));
        const V distance = root(dot(move, move));
        store(moved.data() + L * i, distance);
        beyond |= ~(distance <= load(allowed.data() + L * i));  // also what is no number
      }
    }
    const T* mass = p.mass + b * n * L;
    for (int l = 0; l < real; ++l) {
      if (beyond[l]) refresh(l, x, v);
      if (!search[l].near().empty())
        contact::apply<T, L>(p.contact, search[l], moved.data() + l, x + l, v + l, mass + l, T(damping[l]), f + l);
    }
  }

  // Another near list for a lane.
  void refresh(int l, const T* x, const T* v) {
    const int64_t n = p.vertices;
    lane_.resize(n), speed_.resize(n), near_.resize(n);
    for (int64_t i = 0; i < n; ++i) {
      const int64_t at = 3 * L * i + l;
      lane_[i] = {x[at], x[at + L], x[at + 2 * L]};
      speed_[i] = {v[at], v[at + L], v[at + 2 * L]};
    }
    auto& [search, seen, moved, allowed] = *lists_;
    search[l].refresh(p.contact, lane_.data(), speed_.data(), step_, near_.data());
    for (int64_t i = 0; i < n; ++i) {
      const int64_t at = 3 * L * i + l;
      seen[at] = lane_[i].x, seen[at + L] = lane_[i].y, seen[at + 2 * L] = lane_[i].z;
      moved[L * i + l] = 0;
      allowed[L * i + l] = near_[i];
    }
  }

  void springs(const T* x, const T* v, T share, T* f) const {
    const T stiffness = T(p.stiffness);
    for (int64_t h = 0; h < p.held; ++h) {
      const int64_t at = 3 * L * int64_t(p.held_vertex[h]);
      for (int c = 0; c < 3; ++c) {
        const V start = load(p.targets + ((b * p.held + h) * 3 + c) * L);
        const V end = load(p.targets + (((blocks + b) * p.held + h) * 3 + c) * L);
        const V rate = load(p.rate + ((b * p.held + h) * 3 + c) * L);
        const V stretch = load(x + at + c * L) - (start + share * (end - start)) +
                          damping * (load(v + at + c * L) - rate);
        store(f + at + c * L, load(f + at + c * L) - stiffness * stretch);
      }
    }
  }

  // Springs of any length between nothing and `slack`, beside the handles.
  void ties(const T* x, const T* v, T share, T* f) const {
    const V3 rate = load3(p.tie_rate + b * 3 * L);
    for (int64_t t = 0; t < p.ties; ++t) {
      const int64_t at = 3 * L * int64_t(p.tie_vertex[t]), own = (b * p.ties + t) * L;
      const V3 start = load3(p.tie_targets + 3 * own), end = load3(p.tie_targets + 3 * (blocks * p.ties * L + own));
      const V3 target = combine(start, splat(1 - share), end, splat(share));
      const V3 stretch = sub(load3(x + at), target);
      const V k = -pull(own, stretch);
      add3(f + at, combine(stretch, k, sub(load3(v + at), rate), k * damping));
    }
  }

  // Stiffness of a tie at a stretch.
  V pull(int64_t own, V3 stretch) const {
    const V distance = maximum(norm(stretch), splat(T(1e-6)));
    const V taut = load(p.tie_share + own) - minimum(load(p.tie_slack + own) / distance, splat(1));
    return load(p.tie_stiffness + own) * taut;
  }

  V3 wind_at(T share) const {
    const V3 start = load3(p.wind + b * 3 * L), end = load3(p.wind + (blocks + b) * 3 * L);
    return {start.x + share * (end.x - start.x), start.y + share * (end.y - start.y),
            start.z + share * (end.z - start.z)};
  }

  // Adds what acts beside the base model; arguments as in acting.hpp.
  void beside(const T* x, const T* v, const T* level, T lag, V3 wind, T elapsed, T* f) {
    acting_.add_forces(x, v, level, lag, wind, elapsed, f);
    if (!acting_.folds()) return;
    for (int64_t e = 0; e < p.hinges; ++e) {
      V3 g[4];
      V angle, moment = V{};
      fold(x, e, g, angle);
      acting_.add_moments(e, angle, bending(e, angle), elapsed, moment);
      for (int i = 0; i < 4; ++i) add3(f + 3 * L * int64_t(p.hinge[4 * e + i]), scale(g[i], moment));
    }
  }

  // What acts beside the base model alone, at `share` of the way between the drive's start and end.
  void extra(const T* x, const T* v, const T* level, T share, T* f) {
    std::memset(f, 0, sizeof(T) * p.vertices * 3 * L);
    beside(x, v, level, T(0), wind_at(share), T(0), f);
  }

  // All forces at `share` of the way between the drive's start and end; `elapsed` since those before, 0 for none.
  void forces(const T* x, const T* v, const T* level, T share, T elapsed, T* f) {
    weigh(f);
    const V3 wind = wind_at(share);
    faces(x, v, wind, f);
    hinges(x, v, elapsed, f);
    if (p.effects > 0) acting_.add_forces(x, v, level, T(0), wind, elapsed, f);
    if (p.stiffness > 0) springs(x, v, share, f);
    if (p.ties > 0) ties(x, v, share, f);
    if (p.contact.thickness > 0) contacts(x, v, f);
  }

  // One sweep of the strain limits, with Chebyshev's weight where that is above 1; `moves` is scratch, `before` the
  // positions one sweep ago where that is weighted.
  void limit(T* x, T* v, T step, T* moves, T weight, T* before) const {
    const V low = splat(T(p.lowest)), high = splat(T(p.highest)), tiny = splat(std::numeric_limits<T>::min());
    std::memset(moves, 0, sizeof(T) * p.vertices * 3 * L);
    for (int64_t e = 0; e < p.faces; ++e) {
      const int64_t at[3] = {3 * L * int64_t(p.face[3 * e]), 3 * L * int64_t(p.face[3 * e + 1]),
                             3 * L * int64_t(p.face[3 * e + 2])};
      const T* g = p.gradients + 6 * e;
      const V3 x0 = load3(x + at[0]), x1 = load3(x + at[1]), x2 = load3(x + at[2]);
      auto derive = [&](const T* d) -> V3 {
        return {x0.x * d[0] + x1.x * d[1] + x2.x * d[2], x0.y * d[0] + x1.y * d[1] + x2.y * d[2],
                x0.z * d[0] + x1.z * d[1] + x2.z * d[2]};
      };
      const V3 xu = derive(g), xv = derive(g + 3);
      const V a = dot(xu, xu), c = dot(xv, xv), d = dot(xu, xv);
      const V middle = (a + c) * T(0.5), half = root((a - c) * (a - c) * T(0.25) + d * d);
      const V large = middle + half, small = maximum(middle - half, tiny);
      const V s1 = root(large), s2 = root(small);
      const V f1 = minimum(maximum(s1, low), high) / s1, f2 = minimum(maximum(s2, low), high) / s2;
      const V gap = large - small;
      const V beta = gap > T(1e-9) ? (f1 - f2) / maximum(gap, splat(T(1e-9))) : V{};
      const V alpha = f1 - 1 - beta * large;
      const V3 du = combine(xu, alpha + beta * a, xv, beta * d), dv = combine(xu, beta * d, xv, alpha + beta * c);
      const T* arm = p.arms + 6 * e;
      const T share = p.areas[e] / 3;
      for (int k = 0; k < 3; ++k)
        add3(moves + at[k], combine(du, splat(share * arm[2 * k]), dv, splat(share * arm[2 * k + 1])));
    }
    for (int64_t h = 0; h < p.held; ++h) std::memset(moves + 3 * L * int64_t(p.held_vertex[h]), 0, sizeof(T) * 3 * L);
    for (int64_t i = 0; i < p.vertices; ++i) {
      const T inverse_area = 1 / p.vertex_areas[i];
      for (int64_t k = 3 * L * i; k < 3 * L * (i + 1); k += L) {
        V move = load(moves + k) * inverse_area;
        if (before) {
          const V at = load(x + k), last = load(before + k);
          if (weight > 1) move = last + weight * (at + move - last) - at;
          store(before + k, at);
        }
        store(x + k, load(x + k) + move);
        store(v + k, load(v + k) + move / step);
      }
    }
  }

  // All sweeps of a step.
  void limit(T* x, T* v, T step, T* moves) {
    const bool accelerated = p.sweeps > 0 && p.sweep_weights[p.sweeps - 1] > 1;
    if (accelerated) before_.resize(size_t(p.vertices * 3 * L));
    for (int64_t sweep = 0; sweep < p.sweeps; ++sweep)
      limit(x, v, step, moves, p.sweep_weights[sweep], accelerated ? before_.data() : nullptr);
  }

  // Leapfrog: half a kick, drift and kick in turn, half a kick.
  void advance(T* x, T* v, T* f, double h, int64_t steps) {
    const T* inverse = p.inverse_mass + b * p.vertices * L;
    const bool levelled = acting_.levelled();
    step_ = T(h);
    if (levelled) level_.assign(v, v + 3 * L * p.vertices);
    for (int64_t s = 0; s <= steps; ++s) {
      forces(x, v, levelled ? level_.data() : v, T(double(s) / double(steps)), s > 0 ? T(h) : T(0), f);
      if (p.added_mass) acting_.share_with_air(x, f);
      if (levelled) hasten(f, T(h / 2));
      const T kick = T(s == 0 || s == steps ? h / 2 : h), drift = s < steps ? T(h) : T(0);
      for (int64_t i = 0; i < p.vertices; ++i) {
        const V w = kick * load(inverse + i * L);
        for (int64_t c = 3 * L * i; c < 3 * L * (i + 1); c += L) {
          const V speed = load(v + c) + w * load(f + c);
          store(v + c, speed);
          store(x + c, load(x + c) + drift * speed);
        }
      }
      if (s < steps) limit(x, v, T(h), f);
      if (levelled)
        for (int64_t c = 0; c < 3 * L * p.vertices; c += L) store(level_.data() + c, load(v + c) + load(level_.data() + c));
    }
  }

 private:
  // Into `level_`, what a force changes the velocity by in a time.
  void hasten(const T* f, T time) {
    const T* inverse = p.inverse_mass + b * p.vertices * L;
    for (int64_t i = 0; i < p.vertices; ++i)
      for (int64_t c = 3 * L * i; c < 3 * L * (i + 1); c += L)
        store(level_.data() + c, time * load(inverse + i * L) * load(f + c));
  }
};

}  // namespace
