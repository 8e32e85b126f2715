// Volumes that answer visibility rays, to compare with programs that keep no triangles.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "formats/mesh/mesh_scene.hpp"
#include "kernels/reference/ray.hpp"

namespace nif::volume {

/// Immutable once made; any number of threads may query it.
class RayVolume {
 public:
  virtual ~RayVolume() = default;
  /// Bytes of the grid in memory, by OpenVDB's own count.
  virtual uint64_t bytes() const = 0;
  /// visible[i] = 1 or 0. A volume is thicker or thinner than the surface by up to a voxel, so the first
  /// `skip` voxels after tmin are ignored.
  virtual void ask(std::span<const kernels::Segment> rays, double skip, uint8_t* visible) const = 0;
};

/// Signed distance within three voxels of the surface, in single precision, queried by OpenVDB's level set
/// tracer. `voxel` is the side of a voxel in units of the mesh, above 0. Throws Error(all_degenerate) if the
/// mesh is mostly open, because then there is hardly an inside.
std::unique_ptr<RayVolume> distance_volume(const mesh::Mesh& mesh, double voxel);

/// The voxels whose centre is within half a voxel of the surface, with one bit each in OpenVDB's tree. No
/// path from voxel to voxel across common faces leads through the surface (6-separating, Huang et al. 1998).
std::unique_ptr<RayVolume> voxel_volume(const mesh::Mesh& mesh, double voxel);

}  // namespace nif::volume
