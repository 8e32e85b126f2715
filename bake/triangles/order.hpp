// In which order the children of a `bvh` node are visited.
#pragma once

#include <span>

#include "formats/mesh/scene.hpp"
#include "formats/nif/triangles/pack.hpp"

namespace nif::bake {

/// Sorts the children of each node: leaves first, in the order that they have, then the inner ones that are
/// likely to block a ray, for the nodes and leaves that a ray looks at in them. The first triangle that a ray
/// meets ends its query, and kernels visit the slots of a node in their order.
void order_children(format::BvhBranch& root, std::span<const mesh::Float3> positions,
                    std::span<const mesh::Triangle> triangles);

}  // namespace nif::bake
