// Writes a mesh as a binary, little-endian PLY in chunks, so memory does not grow with the mesh.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>

#include "formats/mesh/mesh_source.hpp"

namespace nif::mesh {

/// Facts about the written file.
struct PlyFile {
  uint64_t bytes = 0;
  Float3 low{}, high{};  ///< bounds of all vertices; zero if there are none
};

/// Writes `source` to `path`, whole or not at all (formats/base/output_file.hpp): vertices as three floats
/// (doubles if the source needs them), faces as lists of three ints. `comment` is one line of ASCII for the
/// header, or empty. Chunks are computed on TBB's threads and written in order, so that the bytes do not
/// depend on the number of threads. `progress` gets the fraction done, from one thread at a time.
///
/// Throws nif::Error: output_folder_missing or output_not_writable; too_large beyond 2^31 - 1 vertices or
/// triangles, the limit of the format's ints; interrupted once `cancel` is set.
PlyFile write_ply(const std::string& path, const MeshSource& source, const std::string& comment,
                  const std::function<void(double)>& progress, const std::atomic<bool>& cancel);

}  // namespace nif::mesh
