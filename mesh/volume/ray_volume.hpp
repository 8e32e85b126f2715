// Volumes that answer visibility rays, as programs ask them that keep no triangles.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "formats/mesh/scene.hpp"
#include "kernels/reference/ray.hpp"

namespace nif::volume {

/// Immutable once made; any number of threads may ask it.
class RayVolume {
 public:
  virtual ~RayVolume() = default;
  /// Of the grid in memory, by OpenVDB's own count.
  virtual uint64_t bytes() const = 0;
  /// visible[i] = 1 or 0. A volume is thicker or thinner than the surface by up to a voxel, so rays count
  /// from `skip` voxels behind their tmin.
  virtual void ask(std::span<const kernels::Segment> rays, double skip, uint8_t* visible) const = 0;
};

/// The signed distance within three voxels of the surface, in single precision, asked by OpenVDB's tracer of
/// level sets. `voxel` is the side of a voxel in units of the mesh, above 0. Throws Error(all_degenerate)
/// where the mesh is mostly open: then there is hardly an inside.
std::unique_ptr<RayVolume> distance_volume(const mesh::Mesh& mesh, double voxel);

/// The voxels whose centre the surface comes as near as half a voxel, one bit each in OpenVDB's tree. No path
/// from voxel to voxel across common faces leads through the surface (6-separating, Huang et al. 1998).
std::unique_ptr<RayVolume> voxel_volume(const mesh::Mesh& mesh, double voxel);

}  // namespace nif::volume
