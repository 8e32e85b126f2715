// Compresses a mesh with Draco.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "formats/mesh/scene.hpp"

namespace nif::mesh {

/// Bits a coordinate that positions are rounded to where nobody asks for another number: a step is then a
/// 16,383rd of the longest side of the bounds.
inline constexpr uint32_t kDracoBits = 14;
inline constexpr uint32_t kMostDracoBits = 30;

struct DracoMesh {
  std::vector<std::byte> bytes;  ///< as a .drc file has them
  uint64_t points, faces;        ///< that a decoder will find; Draco may drop degenerate triangles
};

/// Rounds positions to so many bits along the longest side of the bounds (1..kMostDracoBits) and sorts
/// vertices and triangles as compresses best; with 0 bits everything is kept as it is, in its order, and
/// takes a good deal more. `name` goes into the metadata, where it is not empty. Throws nif::Error:
/// no_triangles, non_finite_vertex, too_large beyond 2^31 - 1 vertices or triangles, all_degenerate where
/// Draco is left with nothing.
DracoMesh encode_draco(const Mesh& mesh, uint32_t bits, const std::string& name);

/// Throws Error(no_triangles, non_finite_vertex or index_out_of_range), naming the mesh, where readers would
/// not take it back.
void check_writable(const Mesh& mesh);

}  // namespace nif::mesh
