// Finds equal meshes in a file, so that they can share one object.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "formats/mesh/mesh_scene.hpp"

namespace nif::mesh {

/// For each mesh, the index of the first one with equal positions and triangles that bends alike, which may be its own. With
/// `looks`, their looks must be equal, too.
std::vector<uint32_t> first_alike(std::span<const Mesh> meshes, bool looks = false);

}  // namespace nif::mesh
