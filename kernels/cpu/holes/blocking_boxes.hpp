// Boxes around what blocks light of triangles with holes. Leaves fill their cards badly: rays meet these boxes of a pine
// 0.6 times as often as boxes around its triangles (docs/results/cutouts.md).
#pragma once

#include <cstdint>
#include <memory_resource>
#include <vector>

#include "kernels/cpu/shared_copies.hpp"
#include "kernels/reference/holes/holes_field.hpp"

namespace nif::kernels::cpu {

/// Sides of the polygons by which boxes are found.
inline constexpr uint32_t kHullSides = 16;

class BlockingBoxes {
 public:
  /// `copies` receives what all objects of the asset share. Looks at some 10,000 texels, or tiles of them, for each patch.
  BlockingBoxes(const HolesField& holes, SharedCopies& copies, std::pmr::memory_resource* memory);

  bool has_holes(uint32_t triangle) const { return patch_of(holes_, triangle) != nullptr; }
  /// Shrinks the box of a triangle with these corners to one around what of the triangle blocks light: every point whose texel
  /// does, wherever rounding of that point and of its texel's place may put it.
  void shrink(uint32_t triangle, const float* const corners[3], float low[3], float high[3]) const;

 private:
  /// A polygon around what of a patch blocks light, as weights of the second and the third corner.
  struct Hull {
    double second[kHullSides], third[kHullSides];
    bool known;  ///< otherwise all of it may
  };

  Hull hull_of(const AlphaPatch& patch, SharedCopies& copies) const;

  const HolesField holes_;
  double most_cells_;             ///< along a side of a patch
  std::pmr::vector<Hull> hulls_;  ///< [patches]
};

}  // namespace nif::kernels::cpu
