// Writes a scene as binary glTF.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "formats/mesh/scene.hpp"

namespace nif::mesh {

/// Hands the bytes of a .glb to `sink`, piece by piece, that mesh::read() reads as the same scene, but for
/// its hash and its notes: positions and transforms bit by bit, names whole, cameras and lights
/// (KHR_lights_punctual) in their order. Each mesh has one primitive, with positions and indices alone.
///
/// With `draco_bits` the meshes are compressed (KHR_draco_mesh_compression), their positions rounded to so
/// many bits, as encode_draco() has it.
///
/// Throws nif::Error, before the first piece: no_triangles where a mesh has none, index_out_of_range,
/// non_finite_vertex, too_large beyond the 4 GiB of a .glb.
void write_glb(const Scene& scene, std::optional<uint32_t> draco_bits,
               const std::function<void(std::span<const std::byte>)>& sink);

/// The same in memory, not compressed.
std::vector<std::byte> encode_glb(const Scene& scene);

}  // namespace nif::mesh
