// Reduces the number of triangles of a surface.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>

#include "formats/mesh/scene.hpp"

namespace nif::halfedge {

struct DecimateOptions {
  uint64_t triangles = 0;           ///< stop at so many
  std::optional<double> max_error;  ///< in units of the mesh; without it only the number counts
  bool move_boundary = false;       ///< collapse edges of the boundary, too
};

/// By OpenMesh: edges are collapsed in the order of their error quadrics, without turning a triangle over.
/// With `max_error`, none whose collapse would leave a vertex of the input farther than that from the
/// triangles that took the place of its own (OpenMesh's ModHausdorff). Vertices at the boundary stay unless
/// asked otherwise, those along which the surface had to be taken apart among them, so that no gap opens
/// there. Stops short of the target where no collapse is allowed any more. `progress` is given what fraction
/// is done. Throws Error(interrupted) once `cancel` is set, Error(all_degenerate) where the mesh has no area.
mesh::Mesh decimate(const mesh::Mesh& mesh, const DecimateOptions& options,
                    const std::function<void(double)>& progress, const std::atomic<bool>& cancel);

/// The same by meshoptimizer, many times faster: error quadrics alone, so that `max_error` is an estimate and
/// no bound.
mesh::Mesh decimate_fast(const mesh::Mesh& mesh, const DecimateOptions& options);

}  // namespace nif::halfedge
