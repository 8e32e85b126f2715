// A field in the layout of the SIMD kernels. It is self-contained: it needs nothing of the asset.
#pragma once

#include "kernels/cpu/kernel_options.hpp"
#include "kernels/packed/feature_grid.hpp"
#include "kernels/packed/traversal_grid.hpp"
#include "kernels/reference/network/samples.hpp"

namespace nif::kernels::cpu {

/// The base class points to a copy of its network, and to nothing else unless it reads the asset's field.
struct PackedField : SegmentField {
  /// The field must outlive this if reads_field.
  PackedField(const SegmentField& field, const KernelOptions& options);

  FeatureGrid corners_by_brick;
  TraversalGrid grid;
  bool reads_field;  ///< if corners_by_brick is not complete

  BuiltBytes built_bytes() const {
    return {.traversal_words = grid.resident_bytes(), .corner_bricks = corners_by_brick.resident_bytes()};
  }
};

/// Both features of a corner; 0 if it has none.
uint16_t corner_pair(const PackedField& field, uint32_t x, uint32_t y, uint32_t z);

// How the reference reads a packed field; if that reads the asset's field, so do these.
uint32_t voxel_word(const PackedField& field, const int32_t voxel[3]);
void interpolate_features(const PackedField& field, const SamplePoint& point, uint8_t* inputs);

}  // namespace nif::kernels::cpu
