// Reads a mesh file of any supported format into a Scene.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/base/status.hpp"
#include "formats/mesh/clip.hpp"
#include "formats/mesh/mesh_choice.hpp"
#include "formats/mesh/mesh_scene.hpp"

namespace nif::mesh {

/// The first bytes of a .vdb.
inline constexpr std::string_view kVdbMagic{" BDV\0\0\0\0", 8};

/// The formats that read() supports, for ReadLimits::format.
inline constexpr std::array kFormats{"obj", "ply", "stl", "off", "gltf", "glb", "drc"};

/// For read(): the mesh is piped into the process.
inline constexpr std::string_view kStandardInput = "-";

/// Limits that keep a hostile or faulty file from exhausting the machine, and what to read besides geometry.
struct ReadLimits {
  uint64_t max_decompressed_bytes = uint64_t{8} << 30;  ///< of the input, unpacked, and of each buffer file
  uint64_t max_triangles = 500'000'000;
  /// Also read the colours of surfaces: Mesh::look. For PLY and OBJ vertex colours, for glTF also materials
  /// and their pictures (PNG, JPEG and WebP); other formats have none. Pictures do not affect Scene::source_hash.
  bool colors = false;
  /// Which triangles let light through: Mesh::alpha. Of glTF and OBJ, by their materials; other formats have only solid ones.
  AlphaOptions alpha{};
  /// Drop triangles that use a vertex that is not finite, with a note that counts them, instead of refusing
  /// the file. A file that contains nothing else is refused. The vertices stay, unused.
  bool drop_non_finite = false;
  /// The format, whatever the name and content are: one of kFormats. Empty: detected by content, or else by
  /// name.
  std::string format{};
  Choice choice{};  ///< which parts of the file are read, by name
  /// Of a glTF: when, in an animation. Its nodes, skins and morph targets are then as the animation has them, and what it
  /// does not move as the file has it. Without, all are as the file has them. Throws Error(usage) if there is no such clip.
  std::optional<Moment> moment{};
  bool clips = false;  ///< also list the animations: Scene::clips
  /// Of a glTF: keep how meshes bend (Mesh::skin) instead of bending them. Their positions are then those of the file, without
  /// morph targets and in the shape in which they are bound to joints, whatever the pose of the file. All instances of a skin
  /// have the same transform: the place of the shape if all joints agree, otherwise a translation near it.
  bool skins = false;
};

/// Reads OBJ, PLY, STL, OFF, glTF, GLB (tinygltf; docs/meshes.md lists the extensions) or DRC (Draco), also
/// as `.gz` or `.zst`. The format is detected by content if it has a signature, otherwise by extension.
/// kStandardInput reads standard input, whose format is determined by content or ReadLimits::format; a mesh
/// without a name is called 'stdin', and it is not among Scene::files. Polygons are triangulated; several
/// meshes in one file become several meshes with instances.
///
/// The result is checked: every index is in range, every position that a triangle uses is finite, and there
/// is at least one triangle. Meshes without triangles are left out. (A scene may have meshes and no instance:
/// it places nothing.) Degenerate and duplicate triangles are kept (clean() removes them and counts them).
///
/// Thread-safe; safe on untrusted input. Throws nif::Error with a sentence that names the file and the place;
/// Error(usage) if a pattern of ReadLimits::choice matches no name in the file.
Scene read(const std::filesystem::path& file, const ReadLimits& limits = {});

/// The same for a file whose uncompressed bytes are in memory.
Scene read(const std::filesystem::path& file, std::string_view bytes, const ReadLimits& limits = {});

/// Removes meshes without triangles, and their instances; returns their names.
std::vector<std::string> drop_empty_meshes(Scene& scene);

/// The checks of read(), for a scene that was read from a file in another way. Throws as read() does.
void check(const std::filesystem::path& file, Scene& scene, const ReadLimits& limits = {});

}  // namespace nif::mesh
