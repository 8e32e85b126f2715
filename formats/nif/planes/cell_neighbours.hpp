// What is around a cell that is coded: the contexts of whether it is cut, into which children, and whether it
// separates (docs/format.md, "Cells": "Cut", "Mask" and "Kind").
#pragma once

#include <array>
#include <cstdint>

#include "formats/nif/planes/known_cells.hpp"

namespace nif::format {

/// The neighbours on the faces of a cell: what is found at the places of its own size beyond them.
struct Neighbours {
  std::array<FoundCell, 6> faces;  ///< below and above along x, then y, then z
  uint32_t cut = 0;                ///< how many are cut
  uint32_t separating = 0;         ///< how many have planes and separate
  uint32_t passable = 0;           ///< how many have planes and do not
  uint32_t thickest = 0;           ///< bits of the largest distance between planes, in units of height
};
Neighbours neighbours_of(const KnownCells& cells, const CellCube& cell);

/// How likely a surface meets the faces that a child of the cell shares with cells other than its siblings: 2
/// for each face that is met, 1 if nothing is known of it.
uint32_t surface_beyond(const KnownCells& cells, const CellCube& cell, uint32_t octant);

}  // namespace nif::format
