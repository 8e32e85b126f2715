// Writing of a scene as binary glTF.
#pragma once

#include <cstddef>
#include <vector>

#include "formats/mesh/scene.hpp"

namespace nif::mesh {

/// The bytes of a .glb that mesh::read() reads as the same scene, but for its hash and its warnings:
/// positions and transforms bit by bit, names whole, cameras and lights (KHR_lights_punctual) in their order.
/// Each mesh has one primitive, with positions and indices alone. Throws nif::Error: no_triangles where a
/// mesh has none, index_out_of_range, non_finite_vertex, too_large beyond the 4 GiB of a .glb.
std::vector<std::byte> encode_glb(const Scene& scene);

}  // namespace nif::mesh
