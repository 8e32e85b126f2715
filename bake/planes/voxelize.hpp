// Conservative isotropic voxelisation: finds the voxels of an object's grid that triangles touch.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/base/vector.hpp"
#include "formats/mesh/box.hpp"
#include "formats/mesh/clean.hpp"
#include "kernels/reference/planes/cells.hpp"

namespace nif::bake {

/// Isotropic voxels around a box: voxel (i,j,k) covers origin + [i, i+1] / voxels_per_unit, and so on.
struct Grid {
  std::array<float, 3> origin;
  float voxels_per_unit;
  uint32_t levels = 0;  ///< how often a voxel can be cut in two along each axis
  std::array<uint32_t, 3> voxels;

  size_t count() const { return size_t(voxels[0]) * voxels[1] * voxels[2]; }
  size_t index(uint32_t x, uint32_t y, uint32_t z) const {
    return x + size_t(voxels[0]) * (y + size_t(voxels[1]) * z);
  }
  /// Finest cells along an edge of a voxel.
  uint32_t cells() const { return 1u << levels; }
  /// A point in units of voxels, exact except for two roundings in double precision.
  Double3 to_grid(const std::array<float, 3>& p) const;
  /// The same in finest cells.
  Double3 to_cells(const std::array<float, 3>& p) const { return to_grid(p) * double(cells()); }
};

/// A grid of `resolution` voxels (2..kernels::kMaxVoxels) along the longest side, which may be cut `levels`
/// times (resolution << levels is at most kernels::kMaxCells). Its border keeps clear of the box by more than
/// the surface padding, so that nothing outside the grid can be blocked.
Grid make_grid(const mesh::Box& box, uint32_t resolution, uint32_t levels = 0);

/// Boxes grow by this much more than the padding, in finest cells, so that rounding in double precision loses
/// no triangle.
inline constexpr double kRoundingRoom = 2e-9;

/// Separating-axis test of a triangle against a box (Akenine-Moeller 2001), all 13 axes. Touching counts.
bool overlaps(const Double3 (&triangle)[3], const Double3& centre, const Double3& half);

/// The voxels that triangles touch, and the triangles that touch them.
struct SurfaceVoxels {
  std::vector<uint8_t> marks;    ///< one byte per voxel: 1 if a triangle touches it, else 0
  std::vector<uint32_t> voxels;  ///< the marked ones as Grid::index, in ascending order
  std::vector<uint64_t> first;   ///< [voxels + 1]: where the triangles of each start
  /// The triangles of each voxel, in ascending order; slivers are numbered after the triangles.
  std::vector<uint32_t> touching;

  std::span<const uint32_t> touching_voxel(size_t i) const {
    return std::span(touching).subspan(first[i], first[i + 1] - first[i]);
  }
};

/// A triangle touches a voxel if it comes within `padding` finest cells of it. Slivers make no surface. Runs
/// on all threads; the result does not depend on their number.
SurfaceVoxels voxelize(const Grid& grid, const mesh::CleanMesh& mesh,
                       double padding = kernels::kSurfacePadding);

}  // namespace nif::bake
