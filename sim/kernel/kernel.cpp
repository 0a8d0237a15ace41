// One block after the other, in float32 and float64, with blocks of as many members as fit a vector register, or half.

#include "block.hpp"
#include "on_mesh.hpp"
#include "split.hpp"

namespace {

template <typename T, int L>
void advance(const Problem<T>* p, int64_t blocks, void* lists, T* x, T* v, T* f, double h, int64_t steps) {
  const int64_t size = p->vertices * 3 * L;
  auto* of_block = static_cast<contact::Lists<T, L>*>(lists);
  for (int64_t b = 0; b < blocks; ++b)
    Block<T, L>(*p, b, blocks, of_block + b).advance(x + b * size, v + b * size, f, h, steps);
}

template <typename T, int L>
void forces(const Problem<T>* p, int64_t blocks, void* lists, const T* x, const T* v, T* f, double share) {
  const int64_t size = p->vertices * 3 * L;
  auto* of_block = static_cast<contact::Lists<T, L>*>(lists);
  for (int64_t b = 0; b < blocks; ++b)
    Block<T, L>(*p, b, blocks, of_block + b).forces(x + b * size, v + b * size, v + b * size, T(share), T(0), f + b * size);
}

template <typename T, int L>
void extra(const Problem<T>* p, int64_t blocks, const T* x, const T* v, const T* level, T* f, double share) {
  const int64_t size = p->vertices * 3 * L;
  for (int64_t b = 0; b < blocks; ++b)
    Block<T, L>(*p, b, blocks).extra(x + b * size, v + b * size, level + b * size, T(share), f + b * size);
}

// Backward Euler steps, for each of which there are a wind and targets of the handles and ties: (steps, blocks, ...). `failed`
// (blocks, L) tells which members' solves did not converge.
template <typename T, int L>
void implicit(const Problem<T>* p, int64_t blocks, T* x, T* v, int32_t* failed, double h, double lag, double tolerance,
              int64_t iterations, int64_t steps) {
  const int64_t size = p->vertices * 3 * L;
  for (int64_t b = 0; b < blocks; ++b) {
    Problem<T> now = *p;
    Implicit<T, L> block(now, b, blocks);
    for (int64_t s = 0; s < steps; ++s) {
      block.step(x + b * size, v + b * size, failed + b * L, T(h), T(lag), tolerance, iterations);
      now.wind += blocks * 3 * L;
      now.targets += blocks * p->held * 3 * L;
      now.tie_targets += blocks * p->ties * 3 * L;
    }
  }
}

}  // namespace

// What on_mesh.py calls, for numbers of type T, taken L members at a time.
#define FIELDS(T, L, name)                                                                                           \
  void face_wind_##name(const int64_t* face, int64_t faces, int64_t batch, on_mesh::View<T> position,                 \
                        on_mesh::View<T> velocity, on_mesh::View<T> wind, T* normal, T* relative, T* across) {         \
    on_mesh::Fields<T, L>::face_wind(face, faces, batch, position, velocity, wind, normal, relative, across);         \
  }                                                                                                                  \
  void normals_##name(const int64_t* face, int64_t faces, int64_t batch, on_mesh::View<T> position, T* sixth) {       \
    on_mesh::Fields<T, L>::normals(face, faces, batch, position, sixth);                                              \
  }                                                                                                                  \
  void normal_rates_##name(const int64_t* face, int64_t faces, int64_t batch, on_mesh::View<T> position,              \
                           on_mesh::View<T> velocity, T* sixth) {                                                     \
    on_mesh::Fields<T, L>::normal_rates(face, faces, batch, position, velocity, sixth);                               \
  }                                                                                                                  \
  void gather_##name(const T* const* corner, int64_t corners, int64_t elements, const int64_t* slots, int64_t k,     \
                     int64_t vertices, int64_t width, T* total) {                                                    \
    on_mesh::Fields<T, L>::gather(corner, corners, elements, slots, k, vertices, width, total);                       \
  }                                                                                                                  \
  void fold_##name(const int64_t* hinge, int64_t hinges, int64_t batch, on_mesh::View<T> position, T* angle,          \
                   T* const* gradient) {                                                                             \
    on_mesh::Fields<T, L>::fold(hinge, hinges, batch, position, angle, gradient);                                     \
  }

// What fused.py calls, for numbers of type T, L members a block.
#define FOR(T, L, name)                                                                                              \
  int64_t lanes_##name() { return L; }                                                                               \
  void* lists_##name(int64_t blocks) { return new contact::Lists<T, L>[blocks]; }                                    \
  void drop_##name(void* lists) { delete[] static_cast<contact::Lists<T, L>*>(lists); }                              \
  void advance_##name(const Problem<T>* p, int64_t blocks, void* lists, T* x, T* v, T* f, double h, int64_t steps) { \
    advance<T, L>(p, blocks, lists, x, v, f, h, steps);                                                              \
  }                                                                                                                  \
  void forces_##name(const Problem<T>* p, int64_t blocks, void* lists, const T* x, const T* v, T* f, double share) { \
    forces<T, L>(p, blocks, lists, x, v, f, share);                                                                  \
  }                                                                                                                  \
  void extra_##name(const Problem<T>* p, int64_t blocks, const T* x, const T* v, const T* level, T* f, double share) { \
    extra<T, L>(p, blocks, x, v, level, f, share);                                                                   \
  }                                                                                                                  \
  void implicit_##name(const Problem<T>* p, int64_t blocks, T* x, T* v, int32_t* failed, double h, double lag,       \
                       double tolerance, int64_t iterations, int64_t steps) {                                        \
    implicit<T, L>(p, blocks, x, v, failed, h, lag, tolerance, iterations, steps);                                   \
  }                                                                                                                  \
  void split_##name(const Problem<T>* p, int64_t blocks, T* x, T* v, int32_t* failed, double h, double tolerance,    \
                    int64_t iterations, int64_t steps, const Part<T>* part, int64_t parts) {                         \
    split<T, L>(p, blocks, x, v, failed, h, tolerance, iterations, steps, part, parts);                              \
  }

extern "C" {
FOR(float, SINGLES, f32)
FOR(float, 8, f32_few)
FOR(double, DOUBLES, f64)
FIELDS(float, SINGLES, f32)
FIELDS(double, DOUBLES, f64)
}
