// The cells of a grid while their words become known, one after the other. A coder asks here what is already
// known at a place (docs/format.md, "Cells": "To look").
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "kernels/reference/planes/cells.hpp"
#include "kernels/reference/planes/grid_traversal.hpp"

namespace nif::format {

/// A position, or a vector, in finest cells.
using CellVector = std::array<int32_t, 3>;

/// A voxel, or a child of one: a cube of finest cells.
struct CellCube {
  std::array<int16_t, 3> low;
  int16_t side;

  CellVector place() const { return {low[0], low[1], low[2]}; }
  /// Twice its middle, which may lie between finest cells.
  CellVector middle() const { return {2 * low[0] + side, 2 * low[1] + side, 2 * low[2] + side}; }
  CellCube child(uint32_t k) const;
};

/// A place times this, over 128, is a height above the middle of a cell.
constexpr int32_t offset_unit(int32_t side) { return kernels::kNormalHalf * side + 1; }

/// Stands for a word that is not known yet.
inline constexpr uint32_t kUnknownWord = kernels::make_empty(0) | 1u << 8;

/// What is found at a place. If it is neither unknown, nor cut, nor has planes, it is *nothing*.
struct FoundCell {
  uint32_t word = kernels::kEmptyChild;
  CellVector low{};  ///< only if it has planes
  int32_t side = 0;

  bool is_unknown() const { return word == kUnknownWord; }
  bool is_cut() const { return kernels::word_kind(word) == kernels::kLink; }
  bool has_planes() const { return kernels::word_kind(word) < kernels::kPlaneKinds; }
  bool is_bare() const { return (word & ~15u) == kernels::kBareCell; }
  int32_t lower() const { return int32_t(kernels::lower_offset(word)); }
  int32_t upper() const { return int32_t(kernels::upper_offset(word)); }
  CellVector normal() const;
};

class KnownCells {
 public:
  /// Uses only the occupancy, the levels and the numbers of voxels and children of `grid`, which must have
  /// been checked to fit together. `words` has room for the words of all voxels, then children; all become
  /// unknown.
  KnownCells(const kernels::PlanesField& grid, uint32_t* words);

  /// Of voxels and children, known or not.
  uint32_t count() const { return grid_.surface_voxels + grid_.child_count; }
  /// How many cells have a place: all voxels, and the children that links have named so far.
  uint32_t named() const { return uint32_t(cells_.size()); }
  const CellCube& operator[](uint32_t i) const { return cells_[i]; }
  /// 0 for a voxel, and one more for each cut.
  uint32_t level(const CellCube& cell) const;

  /// The smallest cell at a place that is not smaller than `side`. The place is a multiple of it.
  FoundCell look(const CellVector& at, int32_t side) const;

  void set_planes(uint32_t i, uint32_t word) { words_[i] = word; }
  /// Makes cell i a link to the next children. Returns false if there are none in the mask, or fewer left.
  bool cut(uint32_t i, uint32_t mask);

 private:
  kernels::PlanesField grid_;  ///< with the words that are known
  uint32_t* const words_;
  std::vector<CellCube> cells_;
};

}  // namespace nif::format
