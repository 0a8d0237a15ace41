// One sample of every pixel, for CPUs. raster_torch.py, coverage.py, shadow.py and texture.py are the definition; this
// repeats them for speed and is tested against them.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

namespace {

constexpr int LANES = 8;
constexpr int64_t STEPS = 256, HALF = STEPS / 2;  // of a pixel, see coverage.py
constexpr double REACH = 1 << 22;
constexpr int64_t SMALL = 64 * STEPS;  // triangles that span less have edge functions below 2^31
constexpr int64_t CHUNK = 512;         // pixels shaded together
constexpr float NEAR = 0.02f;          // m, see geometry.py
constexpr float MARGIN = 2, AWAY = 1.5f, BIAS = 0.3f;  // texels, see shadow.py

typedef float floats __attribute__((vector_size(4 * LANES)));
typedef int32_t ints __attribute__((vector_size(4 * LANES)));
typedef int64_t longs __attribute__((vector_size(8 * LANES)));
typedef float four __attribute__((vector_size(16)));

// Field by field as in raster_kernel.py.
struct Sample {
  int64_t frames, width, height, vertices, pole_start, levels, suns, map;
  const int64_t* vertex_offset;  // (frames + 1) of the cloth's vertices
  const int64_t* face_offset;    // (frames + 1)
  const int64_t* cloth_faces;    // (frames) how many of a frame's faces are cloth; they come first
  const int64_t* corner;         // (faces, 3)
  const float* position;         // (vertices, 3) m
  const float* place;            // (vertices, 2) px, the sample's place in the pixel taken off
  const float* depth;            // (vertices) m
  const float* uv;               // (vertices, 2)
  const float* texels;           // (texels, 4)
  const int64_t* level_width;    // (levels)
  const int64_t* level_height;
  const int64_t* level_start;
  const float* basis;  // (suns, 3, 3) rows: across, across, towards the sun
  float* out;          // (frames, height, width, 4)
  float pole_albedo[4];
  float camera[4];
  float sun;           // irradiance of a point of the sun, over π
  float sky;
  float translucency;
  float samples;
};

struct Vec {
  float x, y, z;
};
Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Vec cross(Vec a, Vec b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
float dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

// A triangle in an image, of positive area, with the pixels its bounding box holds.
struct Triangle {
  int32_t a, b, c;  // places of its corners among the vertices of `Steps`
  int64_t area;     // twice, in steps²
  int32_t left, right, top, bottom;
};

// Corner places in steps.
struct Steps {
  std::vector<int32_t> x, y;
  void resize(size_t n) { x.resize(n), y.resize(n); }
  void set(size_t i, float px, float py) {
    x[i] = whole(px), y[i] = whole(py);
  }
  // 0 for the places of vertices in the camera's plane, which are no numbers: their triangles are not drawn.
  static int32_t whole(float place) {
    return std::isnan(place) ? 0 : int32_t(std::nearbyint(std::clamp(double(place) * STEPS, -REACH, REACH)));
  }
  // False where the triangle is flat or holds no sample.
  bool triangle(int32_t a, int32_t b, int32_t c, int64_t width, int64_t height, Triangle& t) const {
    int64_t area = int64_t(x[b] - x[a]) * (y[c] - y[a]) - int64_t(y[b] - y[a]) * (x[c] - x[a]);
    if (area == 0) return false;
    if (area < 0) std::swap(b, c), area = -area;
    auto [x0, x1] = std::minmax({x[a], x[b], x[c]});
    auto [y0, y1] = std::minmax({y[a], y[b], y[c]});
    t = {a, b, c, area, int32_t(std::max<int64_t>(0, (x0 + HALF - 1) >> 8)),
         int32_t(std::min<int64_t>(width - 1, (x1 - HALF) >> 8)), int32_t(std::max<int64_t>(0, (y0 + HALF - 1) >> 8)),
         int32_t(std::min<int64_t>(height - 1, (y1 - HALF) >> 8))};
    return t.left <= t.right && t.top <= t.bottom;
  }
};

// An edge function from its value at a triangle's first sample: less 1 where samples on the edge are the neighbour's.
template <typename I>
struct Edge {
  I start, across, down;
  Edge(const Steps& s, int32_t a, int32_t b, int64_t left, int64_t top) {
    const int64_t ux = s.x[b] - s.x[a], uy = s.y[b] - s.y[a];
    const bool own = uy > 0 || (uy == 0 && ux > 0);
    start = I(ux * (top * STEPS + HALF - s.y[a]) - uy * (left * STEPS + HALF - s.x[a]) - !own);
    across = I(-uy * STEPS), down = I(ux * STEPS);
  }
};

template <typename I>
struct Wide;
template <>
struct Wide<int32_t> {
  typedef ints type;
};
template <>
struct Wide<int64_t> {
  typedef longs type;
};

// The samples of a row, counted from a triangle's first, at which all edge functions clipped by are at least 0.
struct Row {
  int64_t first, last;
  void clip(int64_t start, int64_t across) {
    if (across > 0) {
      if (start < 0) first = std::max(first, (-start + across - 1) / across);
    } else if (start < 0) {
      last = -1;
    } else if (across < 0) {
      last = std::min(last, start / -across);
    }
  }
};

// Calls visit(first pixel of 8, mask, shares of b, shares of c) for all samples of a triangle, row by row.
template <typename I, typename Visit>
void scan(const Steps& s, const Triangle& t, int64_t stride, Visit&& visit) {
  typedef typename Wide<I>::type wide;
  const Edge<I> ab(s, t.a, t.b, t.left, t.top), bc(s, t.b, t.c, t.left, t.top), ca(s, t.c, t.a, t.left, t.top);
  wide lane;
  for (int i = 0; i < LANES; ++i) lane[i] = i;
  const float scale = 1.0f / float(t.area);
  wide e0 = ab.start + lane * ab.across, e1 = bc.start + lane * bc.across, e2 = ca.start + lane * ca.across;
  for (int64_t y = t.top; y <= t.bottom; ++y) {
    wide f0 = e0, f1 = e1, f2 = e2;
    int64_t x = t.left, right = t.right;
    if constexpr (sizeof(I) == 8) {  // a pole's triangles are long and thin: most of their bounding box is not theirs
      Row row{0, right - x};
      row.clip(e0[0], ab.across), row.clip(e1[0], bc.across), row.clip(e2[0], ca.across);
      const int64_t skipped = row.first;
      right = x + row.last, x += skipped;
      f0 += skipped * ab.across, f1 += skipped * bc.across, f2 += skipped * ca.across;
    }
    for (; x <= right; x += LANES) {
      const wide inside = (f0 | f1 | f2) >= 0;
      const ints mask = __builtin_convertvector(inside, ints) & (__builtin_convertvector(lane, ints) <= int32_t(right - x));
      visit(y * stride + x, mask, __builtin_convertvector(f2, floats) * scale, __builtin_convertvector(f0, floats) * scale);
      f0 += I(LANES) * ab.across, f1 += I(LANES) * bc.across, f2 += I(LANES) * ca.across;
    }
    e0 += ab.down, e1 += bc.down, e2 += ca.down;
  }
}

template <typename Visit>
void cover(const Steps& s, const Triangle& t, int64_t stride, Visit&& visit) {
  const int64_t span = std::max(std::max({s.x[t.a], s.x[t.b], s.x[t.c]}) - std::min({s.x[t.a], s.x[t.b], s.x[t.c]}),
                                std::max({s.y[t.a], s.y[t.b], s.y[t.c]}) - std::min({s.y[t.a], s.y[t.b], s.y[t.c]}));
  if (span < SMALL)
    scan<int32_t>(s, t, stride, visit);
  else
    scan<int64_t>(s, t, stride, visit);
}

template <typename T>
T load(const void* from) {
  T value;
  std::memcpy(&value, from, sizeof(T));
  return value;
}

// The vertices of one frame: its cloth, then the pole.
struct Vertices {
  const Sample& in;
  int64_t first, cloth, count;
  Vertices(const Sample& sample, int64_t frame)
      : in(sample), first(sample.vertex_offset[frame]), cloth(sample.vertex_offset[frame + 1] - first),
        count(cloth + sample.vertices - sample.pole_start) {}
  int64_t global(int64_t local) const { return local < cloth ? first + local : in.pole_start + local - cloth; }
  int32_t local(int64_t global) const { return int32_t(global < in.pole_start ? global - first : global - in.pole_start + cloth); }
  Vec at(int64_t local) const {
    const float* p = in.position + 3 * global(local);
    return {p[0], p[1], p[2]};
  }
};

struct Shadow {
  float middle[2], texel;
  std::vector<float> nearest;
};

class Frame {
 public:
  Frame(const Sample& sample) : in(sample), stride((sample.width + 2 * LANES) / LANES * LANES) {
    near.resize(stride * in.height), seen.resize(stride * in.height), shadows.resize(in.suns);
  }

  void add(int64_t frame) {
    const Vertices v(in, frame);
    faces = in.face_offset[frame + 1] - in.face_offset[frame], cloth_faces = in.cloth_faces[frame];
    corner.resize(3 * faces);
    const int64_t* given = in.corner + 3 * in.face_offset[frame];
    for (int64_t i = 0; i < 3 * faces; ++i) corner[i] = v.local(given[i]);
    prepare(v);
    for (int64_t k = 0; k < in.suns; ++k) shade(v, in.basis + 9 * k, shadows[k]);
    draw(v);
    paint(in.out + frame * in.width * in.height * 4);
  }

 private:
  // What a triangle's samples have in common, worked out when its first sample is seen.
  struct Surface {
    float scale, near[3], side, through;
    int32_t level;  // of the texture; −1 for the pole
    bool known;
  };

  const Sample& in;
  const int64_t stride;
  int64_t faces = 0, cloth_faces = 0;
  std::vector<int32_t> corner, seen;
  std::vector<float> near, nearness;
  std::vector<floats> attributes;  // of a vertex: normal, u, v, position
  std::vector<Shadow> shadows;
  Steps steps;
  std::vector<Triangle> triangles;
  std::vector<Surface> surfaces;

  // Normals, the mean of the faces' around a vertex weighted by their areas, and what else is interpolated.
  void prepare(const Vertices& v) {
    attributes.assign(v.count, floats{});
    for (int64_t i = 0; i < v.count; ++i) {
      const Vec p = v.at(i);
      const float* uv = in.uv + 2 * v.global(i);
      attributes[i] = floats{0, 0, 0, uv[0], uv[1], p.x, p.y, p.z};
    }
    for (int64_t f = 0; f < faces; ++f) {
      const int32_t* c = &corner[3 * f];
      const Vec n = normal(c[0], c[1], c[2]);
      const floats add = {n.x, n.y, n.z, 0, 0, 0, 0, 0};
      for (int k = 0; k < 3; ++k) attributes[c[k]] += add;
    }
    for (int64_t i = 0; i < v.count; ++i) {
      floats& a = attributes[i];
      const float scale = 1.0f / std::max(std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]), 1e-30f);
      a *= floats{scale, scale, scale, 1, 1, 1, 1, 1};
    }
  }

  Vec point(int32_t vertex) const {
    const floats& a = attributes[vertex];
    return {a[5], a[6], a[7]};
  }
  Vec normal(int32_t a, int32_t b, int32_t c) const { return cross(point(b) - point(a), point(c) - point(a)); }

  // The shadow map for one point of the sun.
  void shade(const Vertices& v, const float* basis, Shadow& map) {
    const Vec r{basis[0], basis[1], basis[2]}, u{basis[3], basis[4], basis[5]}, d{basis[6], basis[7], basis[8]};
    float low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    std::vector<float>& height = scratch[2];
    for (auto& s : scratch) s.resize(v.count);
    for (int64_t i = 0; i < v.count; ++i) {
      const Vec p = point(int32_t(i));
      scratch[0][i] = dot(p, r), scratch[1][i] = dot(p, u), height[i] = dot(p, d);
    }
    for (int64_t i = 0; i < v.cloth; ++i)
      for (int k = 0; k < 2; ++k) low[k] = std::min(low[k], scratch[k][i]), high[k] = std::max(high[k], scratch[k][i]);
    const int64_t size = in.map;
    map.texel = std::max(std::max(high[0] - low[0], high[1] - low[1]), 1e-6f) / (size - 2 * MARGIN);
    for (int k = 0; k < 2; ++k) map.middle[k] = (low[k] + high[k]) / 2;
    steps.resize(v.count);
    for (int64_t i = 0; i < v.count; ++i)
      steps.set(i, (scratch[0][i] - map.middle[0]) / map.texel + size / 2.0f,
                (scratch[1][i] - map.middle[1]) / map.texel + size / 2.0f);
    map.nearest.assign(size * size + LANES, -INFINITY);
    Triangle t;
    for (int64_t f = 0; f < faces; ++f) {
      const int32_t* c = &corner[3 * f];
      if (!steps.triangle(c[0], c[1], c[2], size, size, t)) continue;
      const float h = height[t.a], hb = height[t.b] - h, hc = height[t.c] - h;
      cover(steps, t, size, [&](int64_t pixel, ints mask, floats b, floats c) {
        float* at = &map.nearest[pixel];
        const floats now = load<floats>(at), value = h + b * hb + c * hc;
        const floats next = (mask & (value > now)) ? value : now;
        std::memcpy(at, &next, sizeof next);
      });
    }
  }

  // Which triangle each sample sees.
  void draw(const Vertices& v) {
    std::fill(near.begin(), near.end(), 0.0f);
    std::fill(seen.begin(), seen.end(), -1);
    steps.resize(v.count), nearness.resize(v.count);
    for (int64_t i = 0; i < v.count; ++i) {
      const int64_t g = v.global(i);
      steps.set(i, in.place[2 * g], in.place[2 * g + 1]);
      nearness[i] = in.depth[g] > NEAR ? 1.0f / in.depth[g] : 0.0f;
    }
    triangles.resize(faces);
    for (int64_t f = 0; f < faces; ++f) {
      const int32_t* c = &corner[3 * f];
      if (nearness[c[0]] == 0 || nearness[c[1]] == 0 || nearness[c[2]] == 0) continue;
      Triangle& t = triangles[f];
      if (!steps.triangle(c[0], c[1], c[2], in.width, in.height, t)) continue;
      const float n = nearness[t.a], nb = nearness[t.b] - n, nc = nearness[t.c] - n;
      cover(steps, t, stride, [&](int64_t pixel, ints mask, floats b, floats c) {
        float* z = &near[pixel];
        int32_t* id = &seen[pixel];
        const floats now = load<floats>(z), value = n + b * nb + c * nc;
        const ints won = mask & (value > now);
        const floats next = won ? value : now;
        const ints face = won ? ints{} + int32_t(f) : load<ints>(id);
        std::memcpy(z, &next, sizeof next);
        std::memcpy(id, &face, sizeof face);
      });
    }
  }

  void paint(float* out) {
    surfaces.assign(faces, Surface{});
    int64_t count = 0;
    for (int64_t y = 0; y < in.height; ++y) {
      const int32_t* row = &seen[y * stride];
      for (int64_t x = 0; x < in.width; ++x)
        if (row[x] >= 0) {
          pixel_x[count] = int32_t(x), pixel_y[count] = int32_t(y), face[count] = row[x];
          if (++count == CHUNK) paint(out, count), count = 0;
        }
    }
    paint(out, count);
  }

  // One chunk of samples: what they see, its light, its colour.
  void paint(float* out, int64_t count) {
    for (int64_t i = 0; i < count; ++i) {
      const Surface& on = surface(face[i]);
      const Triangle& t = triangles[face[i]];
      const Edge<int64_t> ab(steps, t.a, t.b, pixel_x[i], pixel_y[i]), ca(steps, t.c, t.a, pixel_x[i], pixel_y[i]);
      const float b = float(ca.start) * on.scale, c = float(ab.start) * on.scale;
      const float wa = (1 - (b + c)) * on.near[0], wb = b * on.near[1], wc = c * on.near[2];
      const float whole = 1.0f / (wa + wb + wc);
      const floats at = attributes[t.a] * (wa * whole) + attributes[t.b] * (wb * whole) + attributes[t.c] * (wc * whole);
      nx[i] = at[0], ny[i] = at[1], nz[i] = at[2], px[i] = at[5], py[i] = at[6], pz[i] = at[7];
      side[i] = on.side, through[i] = on.through;
      const four colour = on.level < 0 ? load<four>(in.pole_albedo) : texel(on.level, at[3], at[4]);
      std::memcpy(&albedo[4 * i], &colour, sizeof colour);
    }
    for (int64_t i = 0; i < count; ++i) {
      const float length = std::max(std::sqrt(nx[i] * nx[i] + ny[i] * ny[i] + nz[i] * nz[i]), 1e-12f);
      const float scale = side[i] / length;
      nx[i] *= scale, ny[i] *= scale, nz[i] *= scale, sum_light[i] = 0;
    }
    for (int64_t k = 0; k < in.suns; ++k) light(k, count);
    const float share = 1.0f / in.samples;
    for (int64_t i = 0; i < count; ++i) {
      float* to = out + 4 * (int64_t(pixel_y[i]) * in.width + pixel_x[i]);
      const float diffuse = (sum_light[i] * in.sun + in.sky) * share;
      four shown = load<four>(&albedo[4 * i]) * diffuse;
      shown[3] = share;
      shown += load<four>(to);
      std::memcpy(to, &shown, sizeof shown);
    }
  }

  const Surface& surface(int32_t f) {
    Surface& on = surfaces[f];
    if (on.known) return on;
    const Triangle& t = triangles[f];
    const int32_t* own = &corner[3 * f];
    const Vec from = point(own[0]) - Vec{in.camera[0], in.camera[1], in.camera[2]};
    const bool cloth = f < cloth_faces;
    on = {1.0f / float(t.area), {nearness[t.a], nearness[t.b], nearness[t.c]},
          dot(from, normal(own[0], own[1], own[2])) < 0 ? 1.0f : -1.0f, cloth ? in.translucency : 0.0f,
          cloth ? level(t) : -1, true};
    return on;
  }

  // The level of the texture whose texels are about as large as the distance of a pixel's samples.
  int32_t level(const Triangle& t) const {
    const floats &a = attributes[t.a], &b = attributes[t.b], &c = attributes[t.c];
    const float uv_area = std::fabs((b[3] - a[3]) * (c[4] - a[4]) - (b[4] - a[4]) * (c[3] - a[3])) / 2;
    const float texels = uv_area * float(in.level_width[0] * in.level_height[0]);
    const float image = float(t.area) * (0.5f / 65536);
    const float spacing = std::max(texels / std::max(image * in.samples, 1e-6f), 1e-12f);
    return int32_t(std::clamp(std::nearbyint(0.5f * std::log2(spacing) + 0.5f), 0.0f, float(in.levels - 1)));
  }

  // The texture at (u, v), bilinear.
  four texel(int32_t level, float u, float v) const {
    const int32_t width = int32_t(in.level_width[level]), height = int32_t(in.level_height[level]);
    const float x = std::max(u * width - 0.5f, 0.0f), y = std::max((1 - v) * height - 0.5f, 0.0f);
    const int32_t left = std::min(int32_t(x), width - 1), top = std::min(int32_t(y), height - 1);
    const int32_t right = std::min(left + 1, width - 1), down = std::min(top + 1, height - 1) - top;
    const float s = std::min(x - left, 1.0f), q = std::min(y - top, 1.0f);
    const float* base = in.texels + 4 * (in.level_start[level] + int64_t(top) * width);
    const float* under = base + 4 * int64_t(down) * width;
    const four upper = load<four>(base + 4 * left) * (1 - s) + load<four>(base + 4 * right) * s;
    const four lower = load<four>(under + 4 * left) * (1 - s) + load<four>(under + 4 * right) * s;
    return upper * (1 - q) + lower * q;
  }

  // Adds the light of one point of the sun, as far as its shadow map lets it through.
  void light(int64_t k, int64_t count) {
    const float* basis = in.basis + 9 * k;
    const Vec r{basis[0], basis[1], basis[2]}, u{basis[3], basis[4], basis[5]}, d{basis[6], basis[7], basis[8]};
    const Shadow& map = shadows[k];
    const float size = float(in.map), texel = map.texel, inverse = 1.0f / texel;
    const float shift_a = size / 2 - 0.5f - map.middle[0] * inverse, shift_b = size / 2 - 0.5f - map.middle[1] * inverse;
    const float* __restrict nearest = map.nearest.data();
    const int32_t row = int32_t(in.map);
#pragma GCC ivdep
    for (int64_t i = 0; i < count; ++i) {
      const float cosine = nx[i] * d.x + ny[i] * d.y + nz[i] * d.z;
      const float sine = std::sqrt(std::max(0.0f, 1 - cosine * cosine));
      const float away = (cosine < 0 ? -AWAY : AWAY) * sine * texel;
      const float x = px[i] + away * nx[i], y = py[i] + away * ny[i], z = pz[i] + away * nz[i];
      const float a = (x * r.x + y * r.y + z * r.z) * inverse + shift_a;
      const float b = (x * u.x + y * u.y + z * u.z) * inverse + shift_b;
      const float limit = x * d.x + y * d.y + z * d.z + BIAS * texel;
      const bool within = (a >= 0) & (a < size - 1) & (b >= 0) & (b < size - 1);
      const float ka = std::min(std::max(a, 0.0f), size - 2), kb = std::min(std::max(b, 0.0f), size - 2);
      const int32_t ia = int32_t(ka), ib = int32_t(kb);
      const float s = std::min(std::max(a - ia, 0.0f), 1.0f), t = std::min(std::max(b - ib, 0.0f), 1.0f);
      const int32_t index = ib * row + ia;
      const float f0 = nearest[index] <= limit ? 1.0f : 0.0f, f1 = nearest[index + 1] <= limit ? 1.0f : 0.0f;
      const float f2 = nearest[index + row] <= limit ? 1.0f : 0.0f, f3 = nearest[index + row + 1] <= limit ? 1.0f : 0.0f;
      const float upper = f0 + s * (f1 - f0), lower = f2 + s * (f3 - f2);
      const float free = within ? upper + t * (lower - upper) : 1.0f;
      sum_light[i] += free * (cosine > 0 ? (1 - through[i]) * cosine : -through[i] * cosine);
    }
  }

  std::vector<float> scratch[3];
  int32_t pixel_x[CHUNK], pixel_y[CHUNK], face[CHUNK];
  float side[CHUNK], nx[CHUNK], ny[CHUNK], nz[CHUNK], px[CHUNK], py[CHUNK], pz[CHUNK];
  float through[CHUNK], sum_light[CHUNK], albedo[4 * CHUNK];
};

// Linear values as sRGB bytes: a table finds the byte or a neighbour of it, the exact bounds between bytes decide.
class Encoding {
 public:
  Encoding() {
    for (int i = 0; i <= 256; ++i) {
      const double code = (i - 0.5) / 255;
      bound[i] = i == 0 ? -1.0f : i == 256 ? 2.0f : float(code <= 0.04045 ? code / 12.92 : std::pow((code + 0.055) / 1.055, 2.4));
    }
    for (int i = 0, code = 0; i <= FINE; ++i) {
      while (float(i) / FINE >= bound[code + 1]) ++code;
      guess[i] = uint8_t(code);
    }
  }
  uint8_t operator()(float linear) const {
    const float value = std::min(std::max(linear, 0.0f), 1.0f);
    const int code = guess[int(value * FINE)];
    return uint8_t(code + (value >= bound[code + 1]) - (value < bound[code]));
  }

 private:
  static constexpr int FINE = 4096;
  float bound[257];
  uint8_t guess[FINE + 1];
};

}  // namespace

// Field by field as in raster_kernel.py.
struct Film {
  int64_t frames, pixels;
  const float* scene;   // (frames, pixels, 4) radiance times coverage, and coverage
  const float* behind;  // (pixels, 3) linear
  uint8_t* out;         // (frames, pixels, 3)
  float gain;
};

extern "C" void add_sample(const Sample* sample) {
  Frame frame(*sample);
  for (int64_t i = 0; i < sample->frames; ++i) frame.add(i);
}

extern "C" void develop(const Film* film) {
  static const Encoding encode;
  std::vector<uint8_t> plain(3 * film->pixels);
  for (int64_t i = 0; i < 3 * film->pixels; ++i) plain[i] = encode(film->behind[i]);
  for (int64_t f = 0; f < film->frames; ++f) {
    uint8_t* out = film->out + 3 * f * film->pixels;
    const float* scene = film->scene + 4 * f * film->pixels;
    std::memcpy(out, plain.data(), plain.size());
    for (int64_t i = 0; i < film->pixels; ++i, scene += 4) {
      if (scene[3] == 0) continue;
      for (int k = 0; k < 3; ++k) out[3 * i + k] = encode(scene[k] * film->gain + (1 - scene[3]) * film->behind[3 * i + k]);
    }
  }
}
