// Reading a scene file (docs/rendering.md).
#pragma once

#include <filesystem>

#include "tools/render/scene.hpp"

namespace nif::render {

inline constexpr uint32_t kMaxPictureSide = 16384;
inline constexpr uint32_t kMaxPictureSamples = 65536;
inline constexpr uint32_t kMaxBounces = 32;

/// Reads a scene in TOML. Paths in it are relative to its folder. Files that it names are not opened. Throws
/// Error(malformed_scene) with a sentence that names the file, the line and the field; file_not_found and the
/// like where it cannot be read.
SceneDescription read_scene(const std::filesystem::path& file);

}  // namespace nif::render
