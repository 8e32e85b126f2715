// The `proof` encoding: a grid with planes and nothing behind it. It answers what it can prove and leaves the
// rest open, for a BVH of the caller's (docs/encodings/proof.md).
#pragma once

#include "kernels/reference/encoding.hpp"
#include "kernels/reference/planes/open.hpp"
#include "kernels/reference/planes/planes_hit.hpp"
#include "kernels/reference/ray.hpp"

namespace nif::kernels {

inline Answer query(const PlanesField& field, const Segment& segment) {
  OpenInterval open;
  return prove(field, segment, open);
}

// These also apply to every encoding whose field derives from this one.

inline constexpr double kBoxMargin = 1.0 / 8;  ///< around the grid, in voxels
inline ObjectBox object_box(const PlanesField& field) {
  ObjectBox box;
  const double voxel = 1 / double(field.voxels_per_unit);
  for (int a = 0; a < 3; ++a) {
    box.low[a] = double(field.origin[a]) - kBoxMargin * voxel;
    box.high[a] = double(field.origin[a]) + (double(field.voxels[a]) + kBoxMargin) * voxel;
  }
  return box;
}

/// kCertainReach counts finest cells.
inline float reach_scale(const PlanesField& field) { return field.cells_per_unit; }
/// A ray that is left open gets the probability 1/2.
inline Calibration calibration(const PlanesField&) { return {0, 0}; }

template <>
struct EncodingOf<PlanesField> : MadeOf<PlanesField> {
  static constexpr EncodingName kName{5, "proof"};
};

}  // namespace nif::kernels
