// What fused.py hands over.

#pragma once

#include "contact.hpp"
#include "effect.hpp"

namespace {

// An effect as acting.hpp calls it. Field by field as in fused.py.
template <typename T>
struct Effect {
  int64_t kind;          // see effect.hpp
  const void* act;       // its function, of the kind's type
  int64_t numbers, own;  // how many of all and of each element
  const T* number;       // (blocks, numbers, L)
  const T* of_element;   // (blocks, elements, own, L); or null
  T* memory;             // (blocks, 2, elements, L); or null
};

// Field by field as in fused.py.
template <typename T>
struct Problem {
  int64_t vertices, faces, hinges, held, ties;
  int64_t counts[3];
  int64_t fold;  // 1: bending looks up |curvature|
  const int32_t* face;         // (faces, 3)
  const T* gradients;          // (faces, 2, 3)
  const T* areas;              // (faces)
  const int32_t* hinge;        // (hinges, 4)
  const T* hinge_shape;        // (hinges)
  const T* hinge_column;       // (hinges)
  const T* hinge_rows;         // (hinges, 3)
  const int32_t* held_vertex;  // (held)
  const int32_t* tie_vertex;   // (ties)
  const T* samples;            // (tables, n0, n1, n2, 4)
  double origin, spacing, air_density, air_drag, stiffness;
  int64_t batch;  // members; lanes beyond are spare
  contact::Settings<T> contact;
  double lowest, highest;  // strain limits
  int64_t sweeps;          // corrections a step; 0: no limits
  const T* sweep_weights;  // (sweeps) of Chebyshev's recurrence, 1 for a plain sweep
  const T* arms;           // (faces, 3, 2)
  const T* vertex_areas;   // (vertices)
  Ends<T> ends;
  // One block's share of each of the following is contiguous, lanes innermost.
  const T* mass;          // (blocks, vertices, L)
  const T* inverse_mass;  // (blocks, vertices, L): 0 where held rigidly
  const T* added_mass;    // (blocks, vertices, L) of air along the normals; or null
  const T* segments;      // (blocks, 3, 5, L)
  const T* stiffening;    // (blocks, hinges, L) bending stiffness on top, as a share; or null
  const T* damping;       // (blocks, L)
  const int32_t* table;   // (blocks, L)
  const T* gravity;       // (blocks, 3, L)
  const T* tie_share;     // (blocks, ties, L)
  const T* tie_stiffness; // (blocks, ties, L)
  const T* tie_slack;     // (blocks, ties, L)
  const T* wind;          // (2, blocks, 3, L)
  const T* targets;       // (2, blocks, held, 3, L)
  const T* rate;          // (blocks, held, 3, L)
  const T* tie_targets;   // (2, blocks, ties, 3, L)
  const T* tie_rate;      // (blocks, 3, L)
  int64_t effects;
  const Effect<T>* effect;
};

}  // namespace
