#include "effect.hpp"

struct AddedMass {
  template <typename V>
  static void act(const V* number, const Sheet<V>& sheet, Real<V>* force) {
    for (int64_t i = 0; i < sheet.vertices; ++i) {
      // Areas times mean normals in both, so that one of them is to be divided by the area.
      const V rate = dot(sheet.at(sheet.turning, i), sheet.at(sheet.velocity, i)) / sheet.vertex_areas[i];
      sheet.add_at(force, i, scale(sheet.at(sheet.normals, i), -number[0] * rate));
    }
  }
};
EFFECT(SheetForce, AddedMass)
