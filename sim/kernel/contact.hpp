// Self-contact for one block: what sim/cloth/contact.py defines, with a search that looks only at what is near.
//
// Every lane has its own candidates, in two nested lists (Verlet's). The far list holds all pairs of a vertex and a
// face that touch before any vertex has gone further than its far allowance from where it was; it is made by a search
// over the cloth and serves some tens of steps. The near list holds those of them that touch before any vertex has gone
// further than its near allowance, and serves a few steps. Allowances are what each vertex goes at its own speed and a
// share of the lane's, so that a few fast vertices do not widen the lists of all. Whatever the lists, the pairs that
// touch, and so the forces, are the same.

#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>
#include <vector>
#if defined(__AVX512DQ__)
#include <immintrin.h>
#endif

#include "vector.hpp"

namespace contact {

template <typename T>
struct Settings {
  int64_t vertices, faces, groups, blocks;
  const int32_t* face;        // (faces, 3)
  const T* vertex_area;       // (vertices)
  const T* centre;            // (faces, 2) at rest
  const T* apart;             // (faces) squared rest distance from the centre beyond which a vertex is another layer's
  const int32_t* group;       // (groups, width) vertices that are close at rest; -1 where there is none
  const T* group_rest;        // (groups, 2, width) their rest positions; NaN where there is none
  const int32_t* block;       // (blocks, width) faces that are close at rest; -1 where there is none
  double thickness, stiffness, friction;  // thickness 0: no contact
};

template <typename T>
struct Point {
  T x, y, z;
};
template <typename T>
inline Point<T> operator-(Point<T> a, Point<T> b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
template <typename T>
inline Point<T> operator+(Point<T> a, Point<T> b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
template <typename T>
inline Point<T> operator*(T s, Point<T> a) { return {s * a.x, s * a.y, s * a.z}; }
template <typename T>
inline T dot(Point<T> a, Point<T> b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

// Barycentric coordinates of the point of a triangle closest to p, and the squared distance.
template <typename T>
inline T closest(Point<T> p, Point<T> a, Point<T> b, Point<T> c, T w[3]) {
  const Point<T> e = b - a, f = c - a, r = p - a;
  const T ee = dot(e, e), ef = dot(e, f), ff = dot(f, f), re = dot(r, e), rf = dot(r, f);
  const T denominator = std::max(ee * ff - ef * ef, std::numeric_limits<T>::min());
  const T u = (ff * re - ef * rf) / denominator, v = (ee * rf - ef * re) / denominator;
  if (1 - u - v >= 0 && u >= 0 && v >= 0) {
    w[0] = 1 - u - v, w[1] = u, w[2] = v;
    const Point<T> d = r - (u * e + v * f);
    return dot(d, d);
  }
  T least = std::numeric_limits<T>::infinity();
  const Point<T> corners[3] = {a, b, c};
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    const Point<T> edge = corners[j] - corners[i], q = p - corners[i];
    const T share = std::clamp(dot(q, edge) / std::max(dot(edge, edge), std::numeric_limits<T>::min()), T(0), T(1));
    const Point<T> d = q - share * edge;
    const T square = dot(d, d);
    if (square < least) {
      least = square;
      w[0] = w[1] = w[2] = 0;
      w[i] = 1 - share, w[j] = share;
    }
  }
  return least;
}

// The candidates of one lane.
template <typename T>
class Search {
  static constexpr int W = REGISTER / sizeof(T);
  typedef T Wide __attribute__((vector_size(REGISTER)));
  using Mask = decltype(Wide{} < Wide{});
  using Flag = std::conditional_t<sizeof(T) == 4, int32_t, int64_t>;

  struct Pair {
    T distance;  // at most that when its list was made
    int32_t vertex, face;
  };
  std::vector<Pair> far_, near_;
  std::vector<Point<T>> built_;      // positions when the far list was made
  std::vector<T> allowed_, moved_;   // far allowances, and what is used up of them
  std::vector<T> peak_;              // greatest speeds, fading
  std::vector<T> points_;            // (groups, 4, W) positions and allowances in the order of the groups
  std::vector<T> boxes_;             // (6, groups up to a multiple of W) least and greatest x, y, z, with allowances

  // Steps that the lists are meant to serve, and the fewest that are worth a near list; what is left of a vertex's peak
  // speed at the next near list; the share of the lane's mean speed in a vertex's own; the least allowance for a step
  // [thicknesses]; the greatest peak speed, lest a member that diverged leaves one that never fades [m/s].
  static constexpr double kFarSteps = 14, kNearSteps = 6, kFewest = 2, kFading = 0.95, kShare = 0.3, kLeast = 0.002,
                          kFastest = 1e3;

 public:
  const std::vector<Pair>& near() const { return near_; }

  // Makes the near list for positions x and velocities v, with steps of `step`. `near_allowed` gets its allowances.
  void refresh(const Settings<T>& s, const Point<T>* x, const Point<T>* v, T step, T* near_allowed) {
    near_.clear();
    const size_t n = size_t(s.vertices);
    T mean = 0;
    peak_.resize(n);
    // Vertices in a fold swing to and fro: one that is slow now is soon as fast again as it was.
    for (size_t i = 0; i < n; ++i) {
      const T speed = std::sqrt(dot(v[i], v[i]));
      peak_[i] = std::min(speed > T(kFading) * peak_[i] ? speed : T(kFading) * peak_[i], T(kFastest));
      mean += peak_[i];
    }
    const T h = T(s.thickness), lane = T(kShare) * mean / T(n), least = T(kLeast) * h;
    // What a vertex goes in a step, at least.
    for (size_t i = 0; i < n; ++i) near_allowed[i] = step * (peak_[i] + lane) + least;
    moved_.resize(n);
    bool holds = built_.size() == n;
    if (holds)
      for (size_t i = 0; i < n; ++i) {
        const Point<T> move = x[i] - built_[i];
        moved_[i] = std::sqrt(dot(move, move));
        holds = holds && moved_[i] + T(kFewest) * near_allowed[i] <= allowed_[i];
      }
    if (!holds) {
      allowed_.resize(n);
      for (size_t i = 0; i < n; ++i) allowed_[i] = T(kFarSteps) * near_allowed[i];
      build(s, x);
    }
    for (size_t i = 0; i < n; ++i) near_allowed[i] = std::min(T(kNearSteps) * near_allowed[i], allowed_[i] - moved_[i]);
    for (const Pair& pair : far_) {
      const int32_t *c = s.face + 3 * int64_t(pair.face), i = pair.vertex;
      const T face = std::max({near_allowed[c[0]], near_allowed[c[1]], near_allowed[c[2]]});
      const T reach = T(1.001) * (h + near_allowed[i] + face);
      if (pair.distance > reach + moved_[i] + std::max({moved_[c[0]], moved_[c[1]], moved_[c[2]]})) continue;
      T w[3];
      const T square = closest(x[i], x[c[0]], x[c[1]], x[c[2]], w);
      if (square < reach * reach) near_.push_back({std::sqrt(square), i, pair.face});
    }
  }

 private:
  static Wide load(const T* p) {
    Wide wide;
    std::memcpy(&wide, p, sizeof wide);
    return wide;
  }

  // The lanes of a mask that are set, one bit each.
  static uint32_t bits(const Mask& mask) {
#if defined(__AVX512DQ__)
    if constexpr (sizeof(T) == 4) return _mm512_movepi32_mask((__m512i)mask);
    else return _mm512_movepi64_mask((__m512i)mask);
#else
    Flag flags[W];
    std::memcpy(flags, &mask, sizeof flags);
    uint32_t set = 0;
    for (int k = 0; k < W; ++k) set |= uint32_t(flags[k] & 1) << k;
    return set;
#endif
  }

  static Wide above(const Wide& a, const Wide& b) { return a > b ? a : b; }

  // A face as the search sees it: its distance from points is at least that from the plane and from the three strips
  // beside its edges, for which a vector of points takes few operations.
  struct Sight {
    Point<T> corner[3], across, out[3];

    Sight() = default;
    Sight(Point<T> a, Point<T> b, Point<T> c) : corner{a, b, c} {
      const Point<T> normal = cross(b - a, c - a);
      across = unit(normal);
      for (int i = 0; i < 3; ++i) out[i] = unit(cross(corner[(i + 1) % 3] - corner[i], normal));
    }

    static Point<T> cross(Point<T> a, Point<T> b) {
      return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
    }
    static Point<T> unit(Point<T> a) {
      return (1 / std::sqrt(std::max(dot(a, a), std::numeric_limits<T>::min()))) * a;
    }
    static Wide along(const Wide& x, const Wide& y, const Wide& z, Point<T> d, Point<T> from) {
      return x * d.x + y * d.y + z * d.z - dot(d, from);
    }

    Wide square(const Wide& x, const Wide& y, const Wide& z) const {
      const Wide height = along(x, y, z, across, corner[0]);
      Wide beside = Wide{};
      for (int i = 0; i < 3; ++i) beside = above(beside, along(x, y, z, out[i], corner[i]));
      return height * height + beside * beside;
    }
  };

  // Makes the far list.
  void build(const Settings<T>& s, const Point<T>* x) {
    far_.clear();
    built_.assign(x, x + s.vertices);
    moved_.assign(s.vertices, T(0));
    for (int64_t i = 0; i < s.vertices; ++i)
      if (!(std::abs(x[i].x) < T(1e4) && std::abs(x[i].y) < T(1e4) && std::abs(x[i].z) < T(1e4))) return;  // diverged
    const int64_t padded = (s.groups + W - 1) / W * W;
    constexpr T inf = std::numeric_limits<T>::infinity(), nan = std::numeric_limits<T>::quiet_NaN();
    points_.resize(4 * s.groups * W);
    boxes_.assign(6 * padded, nan);  // beyond the last: meets nothing
    for (int64_t g = 0; g < s.groups; ++g) {
      T low[3] = {inf, inf, inf}, high[3] = {-inf, -inf, -inf}, most = 0;
      T* points = points_.data() + 4 * g * W;
      for (int64_t i = 0; i < W; ++i) {
        const int32_t j = s.group[g * W + i];
        const T values[4] = {j < 0 ? nan : x[j].x, j < 0 ? nan : x[j].y, j < 0 ? nan : x[j].z, j < 0 ? 0 : allowed_[j]};
        for (int k = 0; k < 4; ++k) points[k * W + i] = values[k];
        if (j < 0) continue;
        for (int k = 0; k < 3; ++k) low[k] = std::min(low[k], values[k]), high[k] = std::max(high[k], values[k]);
        most = std::max(most, values[3]);
      }
      for (int k = 0; k < 3; ++k) {
        boxes_[2 * k * padded + g] = low[k] - most;
        boxes_[(2 * k + 1) * padded + g] = high[k] + most;
      }
    }
    for (int64_t b = 0; b < s.blocks; ++b) look(s, x, s.block + b * W, padded);
  }

  // Adds the pairs of a block of faces: every group near the block against one face after the other.
  void look(const Settings<T>& s, const Point<T>* x, const int32_t* faces, int64_t padded) {
    constexpr T inf = std::numeric_limits<T>::infinity();
    Point<T> low = {inf, inf, inf}, high = {-inf, -inf, -inf}, middle[W];
    T radius[W], reach[W], u[W], v[W], apart[W], most = 0;
    Sight sight[W];
    int count = 0;
    for (; count < W && faces[count] >= 0; ++count) {
      const int32_t *corner = s.face + 3 * int64_t(faces[count]), f = faces[count];
      const Point<T> a = x[corner[0]], b = x[corner[1]], c = x[corner[2]], m = (T(1) / 3) * (a + b + c);
      for (const Point<T>& p : {a, b, c}) {
        low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
        high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
      }
      middle[count] = m;
      radius[count] = std::max({dot(a - m, a - m), dot(b - m, b - m), dot(c - m, c - m)});
      reach[count] = T(1.001) * (T(s.thickness) + std::max({allowed_[corner[0]], allowed_[corner[1]], allowed_[corner[2]]}));
      u[count] = s.centre[2 * f], v[count] = s.centre[2 * f + 1], apart[count] = s.apart[f];
      most = std::max(most, reach[count]);
    }
    for (int k = 0; k < count; ++k) radius[k] = T(1.001) * std::sqrt(radius[k]) + reach[k];
    low = low - Point<T>{most, most, most}, high = high + Point<T>{most, most, most};
    uint32_t ready = 0;
    for (int64_t first = 0; first < padded; first += W) {
      const T* box = boxes_.data() + first;
      uint32_t meets = bits((load(box) <= high.x) & (load(box + padded) >= low.x) & (load(box + 2 * padded) <= high.y) &
                            (load(box + 3 * padded) >= low.y) & (load(box + 4 * padded) <= high.z) &
                            (load(box + 5 * padded) >= low.z));
      for (; meets; meets &= meets - 1) {
        const int64_t g = first + __builtin_ctz(meets);
        const T *at = points_.data() + 4 * W * g, *rest = s.group_rest + 2 * W * g;
        const Wide px = load(at), py = load(at + W), pz = load(at + 2 * W), pa = load(at + 3 * W);
        const Wide pu = load(rest), pv = load(rest + W);
        uint32_t near[W];
        int some[W], few = 0;  // faces that have any vertex of the group near
        for (int k = 0; k < count; ++k) {
          const Wide ex = px - middle[k].x, ey = py - middle[k].y, ez = pz - middle[k].z, bound = radius[k] + pa;
          const Wide eu = pu - u[k], ev = pv - v[k];
          near[k] = bits((ex * ex + ey * ey + ez * ez < bound * bound) & (eu * eu + ev * ev >= apart[k]));
          some[few] = k;
          few += near[k] != 0;
        }
        for (int n = 0; n < few; ++n) {
          const int k = some[n];
          const int32_t f = faces[k], *corner = s.face + 3 * int64_t(f);
          if (!(ready >> k & 1)) sight[k] = Sight(x[corner[0]], x[corner[1]], x[corner[2]]), ready |= 1u << k;
          const Wide least = sight[k].square(px, py, pz), within = reach[k] + pa;
          for (uint32_t hit = near[k] & bits(least < within * within); hit; hit &= hit - 1) {
            const int j = __builtin_ctz(hit);
            far_.push_back({std::sqrt(least[j]), s.group[g * W + j], f});
          }
        }
      }
    }
  }
};

// The candidates of a block, kept from call to call.
template <typename T, int lanes>
struct Lists {
  std::array<Search<T>, lanes> search;
  std::vector<T> seen;     // (vertices, 3, lanes) positions when each lane's near list was made
  std::vector<T> moved;    // (vertices, lanes) how far each vertex is from there
  std::vector<T> allowed;  // and how far it may be
};

// Adds repulsion and friction to the forces of one lane. Arrays are (vertices, 3, lanes), offset to the lane. `moved`
// (vertices, lanes) is how far each vertex has moved since the near list was made.
template <typename T, int lanes>
void apply(const Settings<T>& s, const Search<T>& search, const T* moved, const T* x, const T* v, const T* mass,
           T damping, T* f) {
  struct Hit {
    int32_t vertex, face;
    T distance, w[3];
    Point<T> normal;
  };
  const T h = T(s.thickness), k = T(s.stiffness), friction = T(s.friction);
  auto at = [](const T* field, int64_t i) {
    return Point<T>{field[3 * lanes * i], field[3 * lanes * i + lanes], field[3 * lanes * i + 2 * lanes]};
  };
  auto add = [f](int64_t i, T scale, Point<T> p) {
    f[3 * lanes * i] += scale * p.x;
    f[3 * lanes * i + lanes] += scale * p.y;
    f[3 * lanes * i + 2 * lanes] += scale * p.z;
  };
  static thread_local std::vector<Hit> hits;
  hits.clear();
  // A little more than needed, against rounding.
  const T margin = T(1.001) * h;
  for (const auto& pair : search.near()) {
    const int32_t* c = s.face + 3 * int64_t(pair.face);
    const T face = std::max({moved[lanes * c[0]], moved[lanes * c[1]], moved[lanes * c[2]]});
    if (pair.distance > margin + moved[lanes * pair.vertex] + face) continue;
    const Point<T> p = at(x, pair.vertex), p0 = at(x, c[0]), p1 = at(x, c[1]), p2 = at(x, c[2]);
    Hit hit;
    const T square = closest(p, p0, p1, p2, hit.w);
    if (!(square < h * h) || square == 0) continue;
    hit.vertex = pair.vertex;
    hit.face = pair.face;
    hit.distance = std::sqrt(square);
    hit.normal = (1 / hit.distance) * (p - (hit.w[0] * p0 + hit.w[1] * p1 + hit.w[2] * p2));
    hits.push_back(hit);
  }
  std::sort(hits.begin(), hits.end(), [](const Hit& a, const Hit& b) {
    if (a.vertex != b.vertex) return a.vertex < b.vertex;
    if (a.distance != b.distance) return a.distance < b.distance;
    return a.face < b.face;
  });
  auto press = [&](const Hit& hit) {
    const int32_t* c = s.face + 3 * int64_t(hit.face);
    const Point<T> relative =
        at(v, hit.vertex) - (hit.w[0] * at(v, c[0]) + hit.w[1] * at(v, c[1]) + hit.w[2] * at(v, c[2]));
    const T approach = -dot(relative, hit.normal), depth = h - hit.distance, area = s.vertex_area[hit.vertex];
    const T push = std::max(k * area * (depth * depth / (2 * h) + damping * depth * approach / h), T(0));
    const Point<T> slide = relative + approach * hit.normal;
    const T speed = std::sqrt(dot(slide, slide));
    const T rub = std::min(friction * push / std::max(speed, T(0.02)), std::sqrt(k * area * mass[lanes * hit.vertex]) / 2);
    const Point<T> total = push * hit.normal - rub * slide;
    add(hit.vertex, 1, total);
    for (int corner = 0; corner < 3; ++corner) add(c[corner], -hit.w[corner], total);
  };
  for (size_t i = 0; i < hits.size();) {
    press(hits[i]);
    size_t j = i + 1;
    bool opposed = false;
    for (; j < hits.size() && hits[j].vertex == hits[i].vertex; ++j)
      if (!opposed && dot(hits[j].normal, hits[i].normal) < 0) {
        press(hits[j]);
        opposed = true;
      }
    i = j;
  }
}

}  // namespace contact
