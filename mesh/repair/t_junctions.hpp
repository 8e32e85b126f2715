// Closes seams along which one side has a vertex where the other has none. Internal to mesh/repair.
#pragma once

#include <cstdint>

#include "formats/mesh/scene.hpp"

namespace nif::repair {

/// A vertex rounded to floats is hardly ever on a slanted edge exactly: it counts as on it within this part
/// of the largest coordinate of the edge's ends. That is 16 times what rounding moves a coordinate by, as
/// much as a rotation in single precision may.
inline constexpr double kOnEdge = 0x1p-20;

struct TJunctions {
  uint64_t edges = 0;     ///< that were split
  uint64_t vertices = 0;  ///< at which they were, with one that lies on several edges counted for each
  bool gave_up = false;   ///< too many vertices lie near too many edges; nothing was changed
};

/// Splits open edges, those with one triangle, at vertices of other open edges that run along them, so that
/// both become edges of two triangles: a vertex counts as on an edge within `distance` or within kOnEdge,
/// whichever is more. Only what closes a seam is split. No vertex moves, so the surface does by no more than
/// this distance; no triangle without an area is made, none that turns over, and no edge of three triangles.
/// An edge where that cannot be stays as it is. The parts of a triangle take its place in the order.
///
/// The mesh is welded. Takes time for n log n triangles, and a bounded number of steps for each open edge.
TJunctions close_t_junctions(mesh::Mesh& mesh, double distance);

}  // namespace nif::repair
