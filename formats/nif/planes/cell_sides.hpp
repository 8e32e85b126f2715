// Decides in integers which sides of planes are outside, and which inside. The baker stores what this finds,
// and the loader makes sure that a file claims nothing else.
#pragma once

#include <cstdint>
#include <vector>

#include "kernels/reference/planes/planes_field.hpp"

namespace nif::format {

/// The regions above and below planes, joined to each other and to empty voxels.
///
/// Two regions are joined if a point of a face that their cells share lies strictly beyond the planes of
/// both: no triangle separates them there. Empty voxels that are outside, and everything beyond the grid, are
/// outside; empty voxels that are inside are inside. What is joined to either is the same. Nothing else is
/// known.
class SideRegions {
 public:
  /// Links must be in order and no deeper than the field's levels (PlanesReader checks it); sides and walls
  /// of planes are not read. Takes time and memory in proportion to records and voxels.
  explicit SideRegions(const kernels::PlanesField& field);

  /// Something is joined to both outside and inside: the planes or the voxels are wrong.
  bool contradictory() const { return contradictory_; }
  /// SeenBits of the sides of a record with planes; records of voxels, then children, are numbered from 0.
  uint32_t above(uint32_t record) const { return sides_[record] & 3; }
  uint32_t below(uint32_t record) const { return sides_[record] >> 2; }

 private:
  std::vector<uint8_t> sides_;  ///< [record]: two bits above, two below
  bool contradictory_ = false;
};

}  // namespace nif::format
