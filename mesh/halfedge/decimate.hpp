// Reduces the number of triangles of a surface.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>

#include "formats/mesh/mesh_scene.hpp"

namespace nif::halfedge {

struct DecimateOptions {
  uint64_t triangles = 0;           ///< stop at this number
  std::optional<double> max_error;  ///< in units of the mesh; without it, only the number of triangles counts
  bool move_boundary = false;       ///< also collapse edges of the boundary
};

/// Decimates with OpenMesh: collapses edges in the order of their error quadrics, without flipping a
/// triangle. With `max_error`, skips collapses that would leave a vertex of the input farther than that from
/// the triangles that replace its own (OpenMesh's ModHausdorff). Vertices at the boundary stay unless
/// `move_boundary` is set. That includes those along which the surface had to be taken apart, so that no gap
/// opens there. Stops short of the target if no more collapses are allowed. `progress` gets the fraction
/// done. Throws Error(interrupted) once `cancel` is set, and Error(all_degenerate) if the mesh has no area.
mesh::Mesh decimate(const mesh::Mesh& mesh, const DecimateOptions& options,
                    const std::function<void(double)>& progress, const std::atomic<bool>& cancel);

/// The same with meshoptimizer, many times faster: it uses only error quadrics, so `max_error` is an
/// estimate, not a bound.
mesh::Mesh decimate_fast(const mesh::Mesh& mesh, const DecimateOptions& options);

}  // namespace nif::halfedge
