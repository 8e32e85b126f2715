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
  /// Leave seams open along which one side has vertices where the other has none.
  bool keep_t_junctions = false;
  /// Leave solids within the bounds of another solid as they face.
  bool keep_nested = false;
};

/// What was changed, in the order in which it was done. All are zero for a mesh without fault.
struct Report {
  uint64_t welded = 0;             ///< vertices that became one with another
  uint64_t degenerate = 0;         ///< triangles without area, left out
  uint64_t duplicate = 0;          ///< triangles that another one covers, facing the same way, left out
  uint64_t opposite = 0;           ///< likewise, facing the other way
  uint64_t split_edges = 0;        ///< open edges that were split at vertices on them
  uint64_t t_junctions = 0;        ///< these vertices, those on several edges for each
  uint64_t unsearched_meshes = 0;  ///< where these would have been too many to look at
  uint64_t turned = 0;             ///< triangles, to face like their neighbours
  uint64_t split_vertices = 0;     ///< copies made, so that each edge has two triangles at most
  uint64_t stitched_edges = 0;     ///< edges that were taken apart for that and then joined
  cgal::Holes holes;
  uint64_t turned_solids = 0;   ///< solids that faced the wrong way for what they are within
  uint64_t unclear_solids = 0;  ///< that seem to, and cross or touch others or are within such: left

  Report& operator+=(const Report& other);
};

/// Repairs a mesh that has passed the checks of mesh::read(). Triangles keep their order, colours are left
/// out. Throws Error(all_degenerate) where nothing is left, Error(usage) where holes are to be filled and the
/// build lacks CGAL, Error(interrupted) once `cancel` is set. The result does not depend on the number of
/// threads.
Report repair(mesh::Mesh& mesh, const Options& options, const std::atomic<bool>& cancel);

}  // namespace nif::repair
