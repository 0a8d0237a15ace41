// One block after the other, in float32 and float64, with blocks of as many members as fit a vector register, or half.

#include "block.hpp"
#include "implicit.hpp"

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
    Block<T, L>(*p, b, blocks, of_block + b).forces(x + b * size, v + b * size, T(share), f + b * size);
}

// One backward Euler step; `failed` (blocks, L) tells which members' solves did not converge.
template <typename T, int L>
void implicit(const Problem<T>* p, int64_t blocks, T* x, T* v, int32_t* failed, double h, double lag, double tolerance,
              int64_t iterations) {
  const int64_t size = p->vertices * 3 * L;
  for (int64_t b = 0; b < blocks; ++b)
    Implicit<T, L>(*p, b, blocks).step(x + b * size, v + b * size, failed + b * L, T(h), T(lag), tolerance, iterations);
}

}  // namespace

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
  void implicit_##name(const Problem<T>* p, int64_t blocks, T* x, T* v, int32_t* failed, double h, double lag,       \
                       double tolerance, int64_t iterations) {                                                       \
    implicit<T, L>(p, blocks, x, v, failed, h, lag, tolerance, iterations);                                          \
  }

extern "C" {
FOR(float, 16, f32)
FOR(float, 8, f32_few)
FOR(double, 8, f64)
}
