// Draws silhouettes of triangles in whole numbers, so that every machine draws the same.
//
// A pixel counts where its middle third, a square, touches a triangle: by the separating axes of both, the sides of the
// square and the edges of the triangle (Akenine-Möller, Haines and Hoffman, Real-Time Rendering, 2018, section 22.10).

#include <algorithm>
#include <cstdint>
#include <cstring>

namespace {

constexpr int64_t kSteps = 192;           // of a pixel
constexpr int64_t kReach = kSteps / 6;    // from a pixel's middle to the sides of its middle third

int64_t floor_of(int64_t value, int64_t by) {  // by > 0
  const int64_t quotient = value / by;
  return quotient * by > value ? quotient - 1 : quotient;
}

int64_t ceiling_of(int64_t value, int64_t by) { return -floor_of(-value, by); }

// Pixels whose middles lie from `low` to `high`, in steps.
int64_t first_pixel(int64_t low) { return ceiling_of(low - kSteps / 2, kSteps); }
int64_t last_pixel(int64_t high) { return floor_of(high - kSteps / 2, kSteps); }

struct Edge {
  int64_t a, b, c;  // a x + b y + c >= 0 on the triangle's side, widened by the square
};

void draw(const int64_t (*corner)[2], int64_t width, int64_t height, uint8_t* out) {
  const int64_t area = (corner[1][0] - corner[0][0]) * (corner[2][1] - corner[0][1]) -
                       (corner[1][1] - corner[0][1]) * (corner[2][0] - corner[0][0]);
  const int64_t sign = area < 0 ? -1 : 1;
  Edge edges[3];
  int64_t low[2] = {corner[0][0], corner[0][1]}, high[2] = {corner[0][0], corner[0][1]};
  for (int k = 0; k < 3; ++k) {
    const int64_t* from = corner[k];
    const int64_t* to = corner[(k + 1) % 3];
    const int64_t a = -sign * (to[1] - from[1]), b = sign * (to[0] - from[0]);
    edges[k] = {a, b, -a * from[0] - b * from[1] + kReach * (std::abs(a) + std::abs(b))};
    for (int axis = 0; axis < 2; ++axis) {
      low[axis] = std::min(low[axis], from[axis]);
      high[axis] = std::max(high[axis], from[axis]);
    }
  }
  const int64_t left = std::max<int64_t>(0, first_pixel(low[0] - kReach));
  const int64_t right = std::min(width - 1, last_pixel(high[0] + kReach));
  const int64_t top = std::max<int64_t>(0, first_pixel(low[1] - kReach));
  const int64_t bottom = std::min(height - 1, last_pixel(high[1] + kReach));
  for (int64_t row = top; row <= bottom; ++row) {
    const int64_t y = row * kSteps + kSteps / 2;
    int64_t first = left, last = right;
    for (const Edge& edge : edges) {
      const int64_t rest = edge.b * y + edge.c;
      if (edge.a > 0) first = std::max(first, first_pixel(ceiling_of(-rest, edge.a)));
      else if (edge.a < 0) last = std::min(last, last_pixel(floor_of(rest, -edge.a)));
      else if (rest < 0) last = first - 1;
    }
    if (first <= last) std::memset(out + row * width + first, 1, last - first + 1);
  }
}

}  // namespace

// Field by field as in drawing.py.
struct Drawing {
  int64_t frames, vertices, faces, width, height;
  const int64_t* places;  // (frames, vertices, 2) in steps
  const int64_t* face;    // (faces, 3)
  uint8_t* out;           // (frames, height, width), zeros
};

extern "C" void draw_silhouettes(const Drawing* drawing) {
  for (int64_t frame = 0; frame < drawing->frames; ++frame) {
    const int64_t* places = drawing->places + 2 * drawing->vertices * frame;
    uint8_t* out = drawing->out + drawing->width * drawing->height * frame;
    for (int64_t face = 0; face < drawing->faces; ++face) {
      int64_t corner[3][2];
      for (int k = 0; k < 3; ++k) {
        const int64_t* place = places + 2 * drawing->face[3 * face + k];
        corner[k][0] = place[0];
        corner[k][1] = place[1];
      }
      draw(corner, drawing->width, drawing->height, out);
    }
  }
}
