// Reads a scene file (docs/rendering.md).
#pragma once

#include <filesystem>

#include "tools/render/scene.hpp"

namespace nif::render {

inline constexpr uint32_t kMaxPictureSide = 16384;
inline constexpr uint32_t kMaxPictureSamples = 65536;
inline constexpr uint32_t kMaxBounces = 32;

/// Whether a file is named .gltf or .glb, also with .gz or .zst.
bool is_gltf(const std::filesystem::path& file);

/// Reads a scene in TOML. Paths in it are relative to its folder. Files that it names are not opened, and may
/// bring lights and cameras yet (read_meshes() of scene_meshes.hpp). A glTF by its name (is_gltf())
/// is not opened either: it is the only object of a scene with defaults for all else.
/// Throws Error(malformed_scene) with a sentence that names the file, the line and the field; file_not_found
/// and the like where it cannot be read.
SceneDescription read_scene(const std::filesystem::path& file);

}  // namespace nif::render
