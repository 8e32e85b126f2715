// Decides in which order the children of a `bvh` node are visited.
#pragma once

#include <span>

#include "formats/mesh/mesh_scene.hpp"
#include "formats/nif/triangles/pack.hpp"

namespace nif::bake {

/// Sorts the children of each node: leaves first, in their existing order, then the inner ones by how likely
/// they block a ray, relative to the nodes and leaves that a ray visits in them. The first triangle that a
/// ray meets ends its query, and kernels visit the slots of a node in order.
void order_children(format::BvhBranch& root, std::span<const mesh::Float3> positions,
                    std::span<const mesh::Triangle> triangles);

}  // namespace nif::bake
