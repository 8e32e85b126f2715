// The `segment` encoding as the list of encodings has it: its field, its query(), and what a scene needs to
// know of an object besides its answers.
#pragma once

#include "kernels/reference/ray.hpp"
#include "kernels/reference/segment/field.hpp"
#include "kernels/reference/segment/query.hpp"

namespace nif::kernels {

inline constexpr double kBoxMargin = 1.0 / 8;  ///< around the grid, in voxels
inline ObjectBox object_box(const SegmentField& field) {
  ObjectBox box;
  const double voxel = 1 / double(field.voxels_per_unit);
  for (int a = 0; a < 3; ++a) {
    box.low[a] = double(field.origin[a]) - kBoxMargin * voxel;
    box.high[a] = double(field.origin[a]) + (double(field.voxels[a]) + kBoxMargin) * voxel;
  }
  return box;
}

/// kCertainReach is in finest cells.
inline float reach_scale(const SegmentField& field) { return field.cells_per_unit; }
inline Calibration calibration(const SegmentField& field) { return field.network.calibration; }

}  // namespace nif::kernels
