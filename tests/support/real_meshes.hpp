// Finds real meshes that are not part of the repository, in the folder named by the environment variable
// NIF_TEST_MESHES.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <optional>
#include <vector>

namespace nif::test {

inline std::optional<std::filesystem::path> real_mesh_folder() {
  const char* folder = std::getenv("NIF_TEST_MESHES");
  if (folder == nullptr || *folder == 0) return std::nullopt;
  return std::filesystem::path(folder);
}

/// Every file there that is a mesh by its name, in order. Those of more bytes, which take minutes, only
/// where NIF_TEST_LARGEST is set, as tests/run.sh --nightly does.
inline std::vector<std::filesystem::path> real_meshes(uintmax_t most_bytes = 16'000'000) {
  if (std::getenv("NIF_TEST_LARGEST")) most_bytes = std::numeric_limits<uintmax_t>::max();
  std::vector<std::filesystem::path> meshes;
  if (const auto folder = real_mesh_folder()) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(*folder)) {
      if (!entry.is_regular_file() || entry.file_size() > most_bytes) continue;
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

/// How many rays a test uses per mesh: NIF_TEST_SEGMENTS if that is set, as tests/run.sh --nightly does.
inline uint64_t segments_wanted(uint64_t otherwise) {
  const char* const wanted = std::getenv("NIF_TEST_SEGMENTS");
  return wanted ? std::strtoull(wanted, nullptr, 10) : otherwise;
}

}  // namespace nif::test
