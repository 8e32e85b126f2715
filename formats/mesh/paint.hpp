// What a scene that is written looks like: materials with pictures, of which some cut holes. Readers keep what bakes need
// of it instead (appearance.hpp, alpha.hpp).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "formats/mesh/appearance.hpp"

namespace nif::mesh {

/// A glTF material of a written scene.
struct PaintedMaterial {
  std::string name;
  std::array<float, 3> factor{1, 1, 1};  ///< linear RGB, multiplied by the picture
  uint32_t picture = kNoTexture;         ///< index into Paint::pictures
  bool cut = false;  ///< light passes where the picture's alpha is below half; it is seen from both sides
};

/// Meshes of the scene that have Appearance::materials get these materials, by index. Triangles of a material follow each
/// other. Pictures need Appearance::coordinates, with (0, 0) at the upper left corner.
struct Paint {
  std::vector<PaintedMaterial> materials;
  std::vector<std::vector<std::byte>> pictures;  ///< complete PNG files
};

}  // namespace nif::mesh
