// Finds meshes of a file that are the same.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "formats/mesh/scene.hpp"

namespace nif::mesh {

/// Of each mesh, the index of the first with equal positions and triangles: its own where there is none
/// before. With `looks` these must be equal, too.
std::vector<uint32_t> first_alike(std::span<const Mesh> meshes, bool looks = false);

}  // namespace nif::mesh
