// Compresses a mesh with Draco.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "formats/mesh/mesh_scene.hpp"

namespace nif::mesh {

/// Default number of bits per coordinate: a step is then a 16,383rd of the longest side of the bounds.
inline constexpr uint32_t kDracoBits = 14;
inline constexpr uint32_t kMostDracoBits = 30;

struct DracoMesh {
  std::vector<std::byte> bytes;  ///< the content of a .drc file
  uint64_t points, faces;        ///< what a decoder will find; Draco may drop degenerate triangles
};

/// Rounds positions to this many bits along the longest side of the bounds (1..kMostDracoBits) and reorders
/// vertices and triangles for best compression. With 0 bits, everything is kept as it is, in its order, and
/// takes considerably more space. `name` goes into the metadata, unless it is empty. Throws nif::Error:
/// no_triangles, non_finite_vertex, too_large beyond 2^31 - 1 vertices or triangles, all_degenerate if
/// nothing is left for Draco.
DracoMesh encode_draco(const Mesh& mesh, uint32_t bits, const std::string& name);

/// Throws Error(no_triangles, non_finite_vertex or index_out_of_range), naming the mesh, if readers would not
/// accept the file.
void check_writable(const Mesh& mesh);

}  // namespace nif::mesh
