// Decodes the payloads of `segment` objects. What comes out is laid out as an uncoded payload, and is checked
// by the reader as that is.
//
// Each function takes time in proportion to what it decodes to, whatever the bytes are, and returns false
// where no encoder would have made them: there is one coded form of given contents. `to` is as large as the
// field's numbers say, and starts as zeros.
#pragma once

#include <cstddef>
#include <span>

#include "kernels/reference/segment/field.hpp"

namespace nif::format {

/// Of the field, voxels, bricks and mixed_bricks are asked.
bool decode_occupancy(std::span<const std::byte> coded, bool corners_stated,
                      const kernels::SegmentField& field, std::byte* to);
/// Of the field, the occupancy, levels, surface_voxels and part_count are asked; nothing is wrong with its
/// bricks. Where kinds are not stated, they only say which cells separate: see proven_kind().
bool decode_cells(std::span<const std::byte> coded, bool kinds_stated, const kernels::SegmentField& field,
                  std::byte* to);
/// Of the field, corners and features_per_corner are asked.
bool decode_features(std::span<const std::byte> coded, const kernels::SegmentField& field, std::byte* to);

}  // namespace nif::format
