// Self-contact for one block: what sim/contact.py defines, with a search that looks only at what is near.
//
// Every lane has its own candidates: pairs of a vertex and a face closer than the thickness plus a skin, ordered by
// distance. They hold until some vertex of the lane has moved half the skin, so that a step seldom searches; and while no
// vertex has moved further than m, only pairs closer than the thickness plus 2 m need looking at. The skin is what the
// lane's fastest vertex goes in some steps: a slow cloth, whose layers lie close, then has few candidates.

#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>
#include <vector>

namespace contact {

template <typename T>
struct Settings {
  int64_t vertices, faces;
  const int32_t* face;        // (faces, 3)
  const T* vertex_area;       // (vertices)
  const T* rest;              // (vertices, 2)
  const T* centre;            // (faces, 2) at rest
  const T* apart;             // (faces) squared rest distance from the centre beyond which a vertex is another layer's
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
  struct Pair {
    T distance;
    int32_t vertex, face;
  };
  std::vector<Pair> pairs_;
  T skin_ = -1;  // of the last search; negative before it
  std::vector<T> x_, y_, z_, u_, v_;  // vertices in the order of their bins
  std::vector<int32_t> order_, bin_;

  static constexpr int kBins = 128;
  static constexpr int kWidth = 64 / sizeof(T);
  typedef T Wide __attribute__((vector_size(64)));
  using Mask = decltype(Wide{} < Wide{});
  using Flag = std::conditional_t<sizeof(T) == 4, int32_t, int64_t>;

  // Steps that a search is meant to serve, and the range of skins [thicknesses].
  static constexpr int kSteps = 16;
  static constexpr double kThinnest = 0.25, kThickest = 4;

 public:
  const std::vector<Pair>& pairs() const { return pairs_; }

  // Whether the candidates still hold after moves of squared length up to `worst`.
  bool holds(T worst) const { return skin_ > 0 && worst < skin_ * skin_ / 4; }

  // `pace` is how far the fastest vertex goes in a step: a slow cloth gets a thin skin, and few candidates.
  void build(const Settings<T>& s, const Point<T>* x, T pace) {
    pairs_.clear();
    skin_ = std::clamp(2 * kSteps * pace, T(kThinnest * s.thickness), T(kThickest * s.thickness));
    const T reach = T(s.thickness) + skin_;
    Point<T> low = x[0], high = x[0];
    for (int64_t i = 0; i < s.vertices; ++i) {
      if (!(std::abs(x[i].x) < T(1e4) && std::abs(x[i].y) < T(1e4) && std::abs(x[i].z) < T(1e4))) return;  // diverged
      low = {std::min(low.x, x[i].x), std::min(low.y, x[i].y), std::min(low.z, x[i].z)};
      high = {std::max(high.x, x[i].x), std::max(high.y, x[i].y), std::max(high.z, x[i].z)};
    }
    // Slabs across the axis along which the cloth is longest.
    const Point<T> size = high - low;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    auto along = [axis](const Point<T>& p) { return axis == 0 ? p.x : axis == 1 ? p.y : p.z; };
    const T start = along(low), inverse = T(kBins) / std::max(along(size), T(1e-6));
    auto bin = [&](T value) { return std::clamp(int((value - start) * inverse), 0, kBins - 1); };
    const size_t n = size_t(s.vertices);
    bin_.assign(kBins + 1, 0);
    for (size_t i = 0; i < n; ++i) ++bin_[bin(along(x[i])) + 1];
    for (int i = 0; i < kBins; ++i) bin_[i + 1] += bin_[i];
    order_.resize(n);
    std::vector<int32_t> place(bin_.begin(), bin_.end() - 1);
    for (size_t i = 0; i < n; ++i) order_[place[bin(along(x[i]))]++] = int32_t(i);
    // Padded with what is near nothing, so that the search may read in whole vectors.
    for (auto* values : {&x_, &y_, &z_, &u_, &v_}) values->assign(n + kWidth, std::numeric_limits<T>::quiet_NaN());
    for (size_t i = 0; i < n; ++i) {
      const int32_t v = order_[i];
      x_[i] = x[v].x, y_[i] = x[v].y, z_[i] = x[v].z;
      u_[i] = s.rest[2 * v], v_[i] = s.rest[2 * v + 1];
    }
    for (int64_t f = 0; f < s.faces; ++f) look(s, x, f, reach, bin, along);
    std::sort(pairs_.begin(), pairs_.end(), [](const Pair& a, const Pair& b) { return a.distance < b.distance; });
  }

 private:
  // Squared distances of points from one triangle: `closest` for a whole vector of points, without the weights.
  struct Sight {
    struct Points {
      Wide x, y, z;
    };

    Point<T> e, f, g;
    T ee, ef, ff, inverse, ie, iff, ig;

    Sight(Point<T> a, Point<T> b, Point<T> c) : e(b - a), f(c - a), g(c - b) {
      const T tiny = std::numeric_limits<T>::min();
      ee = dot(e, e), ef = dot(e, f), ff = dot(f, f);
      inverse = 1 / std::max(ee * ff - ef * ef, tiny);
      ie = 1 / std::max(ee, tiny), iff = 1 / std::max(ff, tiny), ig = 1 / std::max(dot(g, g), tiny);
    }

    static Wide along(const Points& r, Point<T> d) { return r.x * d.x + r.y * d.y + r.z * d.z; }
    static Points less(const Points& r, const Wide& s, Point<T> d) {
      return {r.x - s * d.x, r.y - s * d.y, r.z - s * d.z};
    }
    static Wide length(const Points& r) { return r.x * r.x + r.y * r.y + r.z * r.z; }
    static Wide least(const Wide& a, const Wide& b) { return a < b ? a : b; }
    static Wide side(const Points& r, const Wide& share, Point<T> d) {
      const Wide zero = Wide{}, one = zero + 1, low = share > 0 ? share : zero;
      return length(less(r, low < 1 ? low : one, d));
    }

    // For points r from the first corner.
    Wide square(const Points& r) const {
      const Wide re = along(r, e), rf = along(r, f);
      const Wide u = (ff * re - ef * rf) * inverse, v = (ee * rf - ef * re) * inverse;
      const Points q = {r.x - e.x, r.y - e.y, r.z - e.z};
      const Wide rim = least(side(r, re * ie, e), least(side(r, rf * iff, f), side(q, along(q, g) * ig, g)));
      return ((u >= 0) & (v >= 0) & (u + v <= 1)) ? length(less(less(r, u, e), v, f)) : rim;
    }
  };

  template <typename Bin, typename Along>
  void look(const Settings<T>& s, const Point<T>* x, int64_t f, T reach, Bin bin, Along along);
};

template <typename T>
template <typename Bin, typename Along>
void Search<T>::look(const Settings<T>& s, const Point<T>* x, int64_t f, T reach, Bin bin, Along along) {
  const Point<T> a = x[s.face[3 * f]], b = x[s.face[3 * f + 1]], c = x[s.face[3 * f + 2]];
  const Point<T> middle = (T(1) / 3) * (a + b + c);
  const T square = std::max({dot(a - middle, a - middle), dot(b - middle, b - middle), dot(c - middle, c - middle)});
  const T radius = std::sqrt(square) + reach, bound = radius * radius;
  const int32_t first = bin_[bin(along(middle) - radius)], last = bin_[bin(along(middle) + radius) + 1];
  const T u = s.centre[2 * f], v = s.centre[2 * f + 1], apart = s.apart[f];
  auto load = [](const std::vector<T>& values, int32_t i) {
    Wide wide;
    std::memcpy(&wide, values.data() + i, sizeof wide);
    return wide;
  };
  // Any of `hit` set, which is copied to `flags`.
  auto any = [](const Mask& hit, Flag* flags) {
    std::memcpy(flags, &hit, sizeof hit);
    int64_t words[8], set = 0;
    std::memcpy(words, &hit, sizeof words);
    for (int64_t word : words) set |= word;
    return set != 0;
  };
  const Sight sight(a, b, c);
  for (int32_t i = first; i < last; i += kWidth) {
    const Wide px = load(x_, i), py = load(y_, i), pz = load(z_, i);
    const Wide dx = px - middle.x, dy = py - middle.y, dz = pz - middle.z, du = load(u_, i) - u, dv = load(v_, i) - v;
    const Mask near = (dx * dx + dy * dy + dz * dz < bound) & (du * du + dv * dv >= apart);
    Flag hit[kWidth];
    if (!any(near, hit)) continue;
    const Wide distance = sight.square({px - a.x, py - a.y, pz - a.z});
    if (!any(near & (distance < reach * reach), hit)) continue;
    for (int k = 0; k < kWidth; ++k)
      if (hit[k]) pairs_.push_back({std::sqrt(distance[k]), order_[i + k], int32_t(f)});
  }
}

// Adds repulsion and friction to the forces of one lane. Arrays are (vertices, 3, lanes), offset to the lane. `moved`
// (vertices, lanes) is how far each vertex has moved since the search, `furthest` the most of them.
template <typename T, int lanes>
void apply(const Settings<T>& s, const Search<T>& search, const T* moved, T furthest, const T* x, const T* v,
           const T* mass, T damping, T* f) {
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
  const T margin = T(1.001) * h, limit = margin + 2 * furthest;
  for (const auto& pair : search.pairs()) {
    if (pair.distance > limit) break;
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
