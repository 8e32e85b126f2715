// Makes a welded mesh manifold and consistently oriented. Internal to mesh/repair.
#pragma once

#include <cstdint>
#include <vector>

#include "formats/mesh/mesh_scene.hpp"

namespace nif::repair {

struct Orienting {
  uint64_t turned = 0;          ///< triangles that were turned
  uint64_t split_vertices = 0;  ///< number of copies
  uint64_t stitched_edges = 0;  ///< edges that were taken apart and joined again
  /// For each vertex, the original one: itself, or the vertex of which it is a copy.
  std::vector<uint32_t> origin;
};

/// Turns triangles to face like their neighbours, in the direction of the majority of their component (if
/// there is none, in that of its first triangle). Then takes apart each edge with more than two triangles,
/// each edge at which two triangles face opposite ways, as somewhere on a Moebius strip, and fans of
/// triangles that share only a vertex. Sides that belong together are joined again: two triangles at an edge
/// that are connected around one of its ends by others, and two that are the only ones left, if they face the
/// same way. Afterwards, each edge has at most two triangles, which face the same way, and each vertex has
/// one fan. Triangles keep their order; copies of vertices follow.
Orienting orient(mesh::Mesh& mesh);

}  // namespace nif::repair
