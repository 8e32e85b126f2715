// Real meshes that are not part of the repository: the folder named by the environment variable
// NIF_TEST_MESHES.
#pragma once

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <vector>

namespace nif::test {

inline std::optional<std::filesystem::path> real_mesh_folder() {
  const char* folder = std::getenv("NIF_TEST_MESHES");
  if (folder == nullptr || *folder == 0) return std::nullopt;
  return std::filesystem::path(folder);
}

/// Every file there that is a mesh by its name, in order.
inline std::vector<std::filesystem::path> real_meshes() {
  std::vector<std::filesystem::path> meshes;
  if (const auto folder = real_mesh_folder()) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(*folder)) {
      std::filesystem::path name = entry.path();
      if (name.extension() == ".gz" || name.extension() == ".zst") name = name.stem();
      for (const char* known : {".obj", ".ply", ".stl", ".off", ".gltf", ".glb", ".drc"}) {
        if (name.extension() == known) meshes.push_back(entry.path());
      }
    }
  }
  std::sort(meshes.begin(), meshes.end());
  return meshes;
}

}  // namespace nif::test
