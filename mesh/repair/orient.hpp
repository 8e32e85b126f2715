// Makes a manifold of a welded mesh whose triangles all face like their neighbours. Internal to mesh/repair.
#pragma once

#include <cstdint>
#include <vector>

#include "formats/mesh/scene.hpp"

namespace nif::repair {

struct Orienting {
  uint64_t turned = 0;          ///< triangles
  uint64_t split_vertices = 0;  ///< copies made
  uint64_t stitched_edges = 0;  ///< of those taken apart, that were joined again
  /// Of each vertex, the one that it was before: itself, or that which it is a copy of.
  std::vector<uint32_t> origin;
};

/// Turns triangles to face like their neighbours, in the direction of the majority of their piece (if there
/// is none, in that of its first triangle). Then each edge with more than two triangles, and each at which
/// two face opposite ways, as somewhere on a Moebius strip, is taken apart, and so are the fans of triangles
/// that meet at a vertex alone. What is apart and belongs together is joined again: two triangles at an edge
/// that others connect around one of its ends, and two that are the only ones left, if they face the same
/// way. After it, each edge has two triangles at most, and these face the same way; each vertex has one fan.
/// Triangles keep their order; copies of vertices follow.
Orienting orient(mesh::Mesh& mesh);

}  // namespace nif::repair
