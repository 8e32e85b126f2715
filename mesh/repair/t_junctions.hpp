// Closes seams at which one side has a vertex on an edge of the other. Internal to mesh/repair.
#pragma once

#include <cstdint>

#include "formats/mesh/mesh_scene.hpp"

namespace nif::repair {

/// A vertex rounded to floats is hardly ever exactly on a slanted edge: it counts as on it within this
/// fraction of the largest coordinate of the edge's ends. That is 16 times the rounding of a coordinate,
/// which covers a rotation in single precision.
inline constexpr double kOnEdge = 0x1p-20;

struct TJunctions {
  uint64_t edges = 0;     ///< edges that were split
  uint64_t vertices = 0;  ///< vertices at which they were split, counted once for each edge
  bool gave_up = false;   ///< too many vertices lie near too many edges; nothing was changed
};

/// Splits open edges, which have one triangle, at vertices of other open edges that run along them, so that
/// both become edges of two triangles. A vertex counts as on an edge within `distance` or kOnEdge, whichever
/// is larger. Only edges whose split closes a seam are split. No vertex moves, so the surface moves by at
/// most this distance. No triangle without area is made, none is flipped, and no edge gets three triangles.
/// An edge for which that is impossible stays as it is. The parts of a triangle take its place in the order.
///
/// The mesh must be welded. Takes O(n log n) time for n triangles, and a bounded number of steps for each
/// open edge.
TJunctions close_t_junctions(mesh::Mesh& mesh, double distance);

}  // namespace nif::repair
