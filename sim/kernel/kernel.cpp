// What fused.py calls: one block after the other, in float32 and float64.

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

extern "C" {
int64_t lanes_f32() { return 16; }
int64_t lanes_f64() { return 8; }
void* lists_f32(int64_t blocks) { return new contact::Lists<float, 16>[blocks]; }
void* lists_f64(int64_t blocks) { return new contact::Lists<double, 8>[blocks]; }
void drop_f32(void* lists) { delete[] static_cast<contact::Lists<float, 16>*>(lists); }
void drop_f64(void* lists) { delete[] static_cast<contact::Lists<double, 8>*>(lists); }
void advance_f32(const Problem<float>* p, int64_t blocks, void* lists, float* x, float* v, float* f, double h,
                 int64_t steps) {
  advance<float, 16>(p, blocks, lists, x, v, f, h, steps);
}
void advance_f64(const Problem<double>* p, int64_t blocks, void* lists, double* x, double* v, double* f, double h,
                 int64_t steps) {
  advance<double, 8>(p, blocks, lists, x, v, f, h, steps);
}
void forces_f32(const Problem<float>* p, int64_t blocks, void* lists, const float* x, const float* v, float* f,
                double share) {
  forces<float, 16>(p, blocks, lists, x, v, f, share);
}
void forces_f64(const Problem<double>* p, int64_t blocks, void* lists, const double* x, const double* v, double* f,
                double share) {
  forces<double, 8>(p, blocks, lists, x, v, f, share);
}
void implicit_f32(const Problem<float>* p, int64_t blocks, float* x, float* v, int32_t* failed, double h, double lag,
                  double tolerance, int64_t iterations) {
  implicit<float, 16>(p, blocks, x, v, failed, h, lag, tolerance, iterations);
}
void implicit_f64(const Problem<double>* p, int64_t blocks, double* x, double* v, int32_t* failed, double h, double lag,
                  double tolerance, int64_t iterations) {
  implicit<double, 8>(p, blocks, x, v, failed, h, lag, tolerance, iterations);
}
}
