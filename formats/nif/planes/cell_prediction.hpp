// What the planes of neighbours let expect of a cell's own planes (docs/format.md, "Cells": "Prediction from
// neighbours", "Thickness", "Normal" and "Lower offset"). All in integers, so that every reader expects the
// same. docs/results/coding.md says what each of the constants is worth.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "formats/nif/planes/cell_neighbours.hpp"

namespace nif::format {

/// The planes of one neighbour, extended to the middle of the face that it shares with the cell.
struct CellHint {
  CellVector normal;
  std::array<int64_t, 3> surface;  ///< near the face's middle, between the planes; in 1/256 of a finest cell
  int32_t weight;
  int32_t
      thickness;  ///< distance of the planes, as units times offsets if the cell were as large as this one
};

/// What all hints together say. u and v are -31 to 31, as in docs/format.md.
struct CellPrediction {
  std::array<CellHint, 6> hints;
  size_t count = 0;    ///< of hints: neighbours with planes that are not bare
  int32_t weight = 0;  ///< of all hints
  int32_t u = 0, v = 0;
  uint32_t doubt = 0;  ///< 0: nothing is known; 1: one hint; 2 to 8: higher the less the normals agree
};
inline constexpr uint32_t kDoubts = 9;
CellPrediction predict_planes(const Neighbours& neighbours, const CellCube& cell);

/// Class of the expected distance of the planes: 0, and then two for each power of two.
uint32_t thickness_class(const CellPrediction& prediction, const CellCube& cell);
inline constexpr uint32_t kThicknessClasses = 16;

/// Where the lower plane is expected, given the normal and the thickness, which is the distance of the planes
/// in offsets.
struct OffsetPrediction {
  int32_t lower;
  uint32_t doubt;  ///< 0: nothing is known; 1: one hint; 2 to 7: higher the less the heights agree
};
inline constexpr uint32_t kOffsetDoubts = 8;
OffsetPrediction predict_lower(const CellPrediction& prediction, const CellCube& cell,
                               const CellVector& normal, int32_t thickness);

/// How many of the bounds, which ascend, are at most the value.
template <size_t kCount>
constexpr uint32_t rank(int64_t value, const int32_t (&bounds)[kCount]) {
  uint32_t rank = 0;
  while (rank < kCount && value >= bounds[rank]) ++rank;
  return rank;
}

}  // namespace nif::format
