// Writes a scene as a mesh file of any supported format.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "formats/base/status.hpp"
#include "formats/mesh/scene.hpp"

namespace nif::mesh {

enum class FileKind : uint8_t { obj, ply, stl, off, glb, drc };

/// What a file shall be, by its name's ending in either case; nullopt where that is no kind that is written.
std::optional<FileKind> known_file_kind(const std::string& path);
/// The same; throws Error(usage) that names the file instead.
FileKind file_kind(const std::string& path);

struct WriteOptions {
  bool text = false;   ///< of STL: as text, which keeps the objects and their names
  bool draco = false;  ///< of GLB: compressed by KHR_draco_mesh_compression
  /// Of what Draco compresses: bits a coordinate, 0 for positions as they are. kDracoBits where it is not
  /// set.
  std::optional<uint32_t> draco_bits;
};

/// Throws Error(usage) where an option makes no sense for a kind.
void check_options(FileKind kind, const WriteOptions& options);

struct Written {
  uint64_t bytes = 0;
  std::vector<std::string> notes;  ///< one sentence each: what the format does not keep of this scene
};

/// Writes a scene, whole or not at all (formats/base/output_file.hpp), as the kind that the path says.
/// Formats without instances get each instance's triangles where they stand (FlatScene). Everything but Draco
/// with bits keeps positions to the bit and triangles in their order: texts have the shortest digits that
/// read back as the same float, or where floats are too coarse (far_from_origin.hpp), as the same place beside the offset
/// of the mesh; PLY then has doubles. Memory beyond the scene does not grow with it, but for Draco.
/// `progress` is given what fraction is done.
///
/// Throws nif::Error that names the path or the mesh: usage, as above; output_folder_missing,
/// output_not_writable; too_large beyond what a format can count; interrupted once `cancel` is set; of GLB
/// and Draco, what write_glb() and encode_draco() throw.
Written write(const std::string& path, const Scene& scene, const WriteOptions& options,
              const std::function<void(double)>& progress, const std::atomic<bool>& cancel);

}  // namespace nif::mesh
