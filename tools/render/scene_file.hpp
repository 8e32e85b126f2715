// Reads a scene file (docs/rendering.md) into a SceneDescription.
#pragma once

#include <filesystem>

#include "tools/render/picture_scene.hpp"

namespace nif::render {

inline constexpr uint32_t kMaxPictureSide = 16384;
inline constexpr uint32_t kMaxPictureSamples = 65536;
inline constexpr uint32_t kMaxBounces = 32;

/// Whether the file's name ends in .gltf or .glb, possibly with .gz or .zst after it.
bool is_gltf(const std::filesystem::path& file);

/// Reads a scene in TOML. Paths in it are relative to its folder. The files that it names are not opened
/// here; they may add lights and cameras later (read_meshes() of scene_meshes.hpp). A glTF, detected by name
/// (is_gltf()), is not opened either: it becomes the only object of a scene with defaults for everything
/// else. Throws Error(malformed_scene) with a sentence that names the file, the line and the field;
/// file_not_found and the like if the file cannot be read.
SceneDescription read_scene(const std::filesystem::path& file);

}  // namespace nif::render
