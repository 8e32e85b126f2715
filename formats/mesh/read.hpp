// Reads a mesh file of any supported format into a Scene.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "formats/base/status.hpp"
#include "formats/mesh/choice.hpp"
#include "formats/mesh/scene.hpp"

namespace nif::mesh {

/// What a .vdb begins with.
inline constexpr std::string_view kVdbMagic{" BDV\0\0\0\0", 8};

/// The formats that read() reads, for ReadLimits::format.
inline constexpr std::array kFormats{"obj", "ply", "stl", "off", "gltf", "glb", "drc"};

/// For read(): the mesh that is piped into the process.
inline constexpr std::string_view kStandardInput = "-";

/// Limits that keep a hostile or mistaken file from exhausting the machine, and what to read beyond geometry.
struct ReadLimits {
  uint64_t max_decompressed_bytes = uint64_t{8} << 30;  ///< of the input, unpacked, and of each buffer file
  uint64_t max_triangles = 500'000'000;
  /// Also what colour surfaces have: Mesh::look. Of PLY and OBJ colours of vertices, of glTF also materials
  /// and their pictures (PNG and JPEG); other formats have none. Pictures have no part in Scene::source_hash.
  bool colors = false;
  /// Leave out triangles that use a vertex that is not finite, with a note that counts them, where the file
  /// would be refused else. A file of nothing but such is refused. Vertices stay, unused.
  bool drop_non_finite = false;
  /// What the file is, whatever its name and content say: one of kFormats. Empty: told by content, else name.
  std::string format{};
  Choice choice{};  ///< what of the file is read, by name
};

/// Reads OBJ, PLY, STL, OFF, glTF, GLB (tinygltf; docs/meshes.md has its extensions) or DRC (Draco), each
/// also as `.gz` or `.zst`. The format is told by content where it has a signature, else by extension.
/// kStandardInput reads standard input, whose format content or ReadLimits::format has to tell; its name is
/// 'stdin' where it has none, and it is not among Scene::files.
/// Polygons are triangulated; several meshes in one file become several meshes with instances.
///
/// The result is checked: every index in range, every position that a triangle uses finite, at least one
/// triangle in all. Meshes without triangles are left out. (A scene may have meshes and no instance: it
/// places nothing.) Degenerate and duplicate triangles are kept (clean() removes them, with a count).
///
/// Thread-safe; safe on untrusted input. Throws nif::Error with a sentence that names the file and the place;
/// Error(usage) where a pattern of ReadLimits::choice fits no name of the file.
Scene read(const std::filesystem::path& file, const ReadLimits& limits = {});

/// The same for a file whose bytes are in memory, and not compressed.
Scene read(const std::filesystem::path& file, std::string_view bytes, const ReadLimits& limits = {});

/// Leaves out meshes without triangles, and their instances; returns their names.
std::vector<std::string> drop_empty_meshes(Scene& scene);

/// The checks of read(), for a scene that was read from a file in another way. Throws as read().
void check(const std::filesystem::path& file, Scene& scene, const ReadLimits& limits = {});

}  // namespace nif::mesh
