// Writes a scene as binary glTF, with every bit of positions, names and transforms.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "formats/mesh/mesh_scene.hpp"
#include "formats/mesh/paint.hpp"

namespace nif::mesh {

/// Passes the bytes of a .glb to `sink`, piece by piece. mesh::read() reads it as the same scene, except for
/// its hash and its notes: positions and transforms bit by bit, complete names, cameras and lights
/// (KHR_lights_punctual) in their order. Each mesh has one primitive, with only positions and indices.
///
/// With `draco_bits` the meshes are compressed (KHR_draco_mesh_compression), with positions rounded to this
/// many bits, as encode_draco() does.
///
/// With `paint`, not together with Draco, a mesh that has materials has a primitive for each, with texture
/// coordinates if it has some; vertices that two primitives use are read as two. Pictures are in the file.
///
/// Throws nif::Error before the first piece: no_triangles if a mesh has none, index_out_of_range,
/// non_finite_vertex, too_large beyond the 4 GiB of a .glb.
void write_glb(const Scene& scene, std::optional<uint32_t> draco_bits,
               const std::function<void(std::span<const std::byte>)>& sink, const Paint* paint = nullptr);

/// The same in memory, without compression.
std::vector<std::byte> encode_glb(const Scene& scene, const Paint* paint = nullptr);

}  // namespace nif::mesh
