// Repairs a mesh from an artist or a scanner: merged vertices, no useless triangles, manifold, facing one
// way.
#pragma once

#include <atomic>
#include <cstdint>

#include "formats/mesh/scene.hpp"
#include "mesh/cgal/cgal.hpp"

namespace nif::repair {

struct Options {
  /// Vertices so near to each other become one, in units of the mesh; 0: equal ones alone.
  double weld = 0;
  /// Boundary loops of at most so many edges are filled; 0: none is.
  uint64_t hole_edges = 0;
  /// Keep both of two triangles with the same corners that face opposite ways.
  bool keep_opposite = false;
};

/// What was changed, in the order in which it was done. All are zero for a mesh without fault.
struct Report {
  uint64_t welded = 0;      ///< vertices that became one with another
  uint64_t degenerate = 0;  ///< triangles without area, left out
  uint64_t duplicate = 0;   ///< triangles that another one covers, facing the same way, left out
  uint64_t opposite = 0;    ///< likewise, facing the other way
  cgal::Mending mending;
  uint64_t turned_solids = 0;  ///< solids that faced inwards, though none lies around them

  Report& operator+=(const Report& other);
};

/// Repairs a mesh that has passed the checks of mesh::read(). Triangles keep their order. A solid within the
/// bounds of another one may be the wall of a cavity, and faces as it did. Throws Error(all_degenerate) where
/// nothing is left, Error(usage) where the build lacks CGAL, Error(interrupted) once `cancel` is set. The
/// result does not depend on the number of threads.
Report repair(mesh::Mesh& mesh, const Options& options, const std::atomic<bool>& cancel);

}  // namespace nif::repair
