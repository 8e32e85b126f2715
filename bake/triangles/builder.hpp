// Builds the compact BVH of a `bvh` object (kernels/reference/triangles/triangles_field.hpp).
#pragma once

#include <span>
#include <vector>

#include "formats/mesh/mesh_scene.hpp"
#include "formats/nif/asset.hpp"

namespace nif::bake {

/// False if coordinates are too large for the encoding to compute with.
bool fits_bvh(std::span<const mesh::Float3> positions);

/// Embree's builder makes a first tree, whose nodes are then put where rays meet fewer of them. The same mesh gives the same
/// bytes, whatever the number of threads. fits_bvh() must hold.
/// `order`, if not null, receives the index of each triangle of the object among `triangles`, and `sources` that of each
/// vertex among `positions`. Throws Error(out_of_memory) or Error(internal) with Embree's own message.
format::TrianglesData build_bvh(std::span<const mesh::Float3> positions,
                                std::span<const mesh::Triangle> triangles,
                                std::vector<uint32_t>* order = nullptr,
                                std::vector<uint32_t>* sources = nullptr);

}  // namespace nif::bake
