// Writes a scene as a mesh file of any supported format.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "formats/base/status.hpp"
#include "formats/mesh/mesh_scene.hpp"
#include "formats/mesh/paint.hpp"

namespace nif::mesh {

enum class FileKind : uint8_t { obj, ply, stl, off, glb, drc };

/// The kind of a file by its name's ending, in either case; nullopt if it is not one that can be written.
std::optional<FileKind> known_file_kind(const std::string& path);
/// The same, but throws Error(usage) that names the file instead.
FileKind file_kind(const std::string& path);

struct WriteOptions {
  bool text = false;   ///< for STL: as text, which keeps the objects and their names
  bool draco = false;  ///< for GLB: compressed with KHR_draco_mesh_compression
  /// For Draco: bits per coordinate; 0 keeps positions as they are. kDracoBits if it is not set.
  std::optional<uint32_t> draco_bits;
  const Paint* paint = nullptr;  ///< for GLB without Draco: materials of the meshes
};

/// Throws Error(usage) if an option does not apply to a kind.
void check_options(FileKind kind, const WriteOptions& options);

struct Written {
  uint64_t bytes = 0;
  std::vector<std::string> notes;  ///< one sentence each: what the format does not keep of this scene
};

/// Writes a scene, whole or not at all (formats/base/output_file.hpp), in the format that the path names.
/// Formats without instances get each instance's transformed triangles (FlatScene). Every format except Draco
/// with bits keeps positions to the bit and triangles in their order. Texts have the fewest digits that read
/// back as the same float, or, where floats are too coarse (far_from_origin.hpp), as the same position
/// relative to the offset of the mesh; PLY then has doubles. Apart from Draco, memory does not grow with the
/// scene. `progress` gets the fraction done.
///
/// Throws nif::Error that names the path or the mesh: usage, as above; output_folder_missing,
/// output_not_writable; too_large beyond what a format can count; interrupted once `cancel` is set; for GLB
/// and Draco, what write_glb() and encode_draco() throw.
Written write(const std::string& path, const Scene& scene, const WriteOptions& options,
              const std::function<void(double)>& progress, const std::atomic<bool>& cancel);

}  // namespace nif::mesh
