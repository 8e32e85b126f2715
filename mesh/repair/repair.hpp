// Repairs a mesh from an artist or a scanner: merges vertices, drops useless triangles, and makes it manifold
// and consistently oriented.
#pragma once

#include <atomic>
#include <cstdint>

#include "formats/mesh/mesh_scene.hpp"
#include "mesh/cgal/cgal.hpp"

namespace nif::repair {

struct Options {
  /// Vertices within this distance of each other are merged, in units of the mesh; 0: only equal ones.
  double weld = 0;
  /// Boundary loops of at most this many edges are filled; 0: none.
  uint64_t hole_edges = 0;
  /// Keep both triangles if two have the same corners and face opposite ways.
  bool keep_opposite = false;
  /// Leave seams open if one side has vertices on an edge of the other.
  bool keep_t_junctions = false;
  /// Do not turn solids that are within the bounds of another solid.
  bool keep_nested = false;
};

/// What was changed, in the order of the steps. All counts are zero for a mesh without defects.
struct Report {
  uint64_t welded = 0;      ///< vertices that were merged into another one
  uint64_t degenerate = 0;  ///< triangles without area that were dropped
  /// Triangles that cover the same corners as another one and face the same way; dropped.
  uint64_t duplicate = 0;
  uint64_t opposite = 0;           ///< the same, but facing the other way
  uint64_t split_edges = 0;        ///< open edges that were split at vertices on them
  uint64_t t_junctions = 0;        ///< these vertices, counted once for each edge that they are on
  uint64_t unsearched_meshes = 0;  ///< meshes with too many T-junctions to search
  uint64_t turned = 0;             ///< triangles turned to face like their neighbours
  uint64_t split_vertices = 0;     ///< copies made so that each edge has at most two triangles
  uint64_t stitched_edges = 0;     ///< edges that were taken apart for that and joined again
  cgal::Holes holes;
  uint64_t turned_solids = 0;  ///< solids that faced the wrong way for what they are within
  /// Seem to, but were left because they, or solids around them, cross or touch others.
  uint64_t unclear_solids = 0;

  Report& operator+=(const Report& other);
};

/// Repairs a mesh that has passed the checks of mesh::read(). Triangles keep their order; colours are
/// dropped. Throws Error(all_degenerate) if nothing is left, Error(usage) if holes are to be filled and the
/// build lacks CGAL, and Error(interrupted) once `cancel` is set. The result does not depend on the number of
/// threads.
Report repair(mesh::Mesh& mesh, const Options& options, const std::atomic<bool>& cancel);

}  // namespace nif::repair
