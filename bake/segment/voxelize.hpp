// Conservative isotropic voxelisation: which voxels of an object's grid a triangle touches.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/base/vector.hpp"
#include "formats/mesh/box.hpp"

namespace nif::bake {

/// Isotropic voxels around a box: voxel (i,j,k) covers origin + [i, i+1] / voxels_per_unit, and so on.
struct Grid {
  std::array<float, 3> origin;
  float voxels_per_unit;
  std::array<uint32_t, 3> voxels;

  size_t count() const { return size_t(voxels[0]) * voxels[1] * voxels[2]; }
  size_t index(uint32_t x, uint32_t y, uint32_t z) const {
    return x + size_t(voxels[0]) * (y + size_t(voxels[1]) * z);
  }
  /// A point in units of voxels, exact but for one rounding in double precision.
  Double3 to_grid(const std::array<float, 3>& p) const;
};

/// A grid of `resolution` voxels (2..kernels::kMaxVoxels) along the longest side. Its border keeps clear of
/// the box by more than the surface padding, so that nothing outside the grid can be blocked.
Grid make_grid(const mesh::Box& box, uint32_t resolution);

/// One byte a voxel: 1 where a triangle comes within kernels::kSurfacePadding voxels of it, else 0.
/// Runs on all threads; the result does not depend on their number.
std::vector<uint8_t> voxelize(const Grid& grid, std::span<const mesh::Float3> positions,
                              std::span<const mesh::Triangle> triangles);

}  // namespace nif::bake
