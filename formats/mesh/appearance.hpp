// Describes the colour of a surface: materials with a factor and a texture, and vertex colours. Colours are
// linear RGB with the primaries of sRGB, from 0 to 1.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace nif::mesh {

/// 8 bits each for red, green and blue, in sRGB; rows from the top.
struct Texture {
  uint32_t width = 0, height = 0;  ///< at least 1
  std::vector<uint8_t> texels;     ///< [height][width][3]
};

/// Converts a value of sRGB, clamped to 0..1, to linear light. NaN gives an arbitrary value.
double linear_of(double srgb);

/// How texture coordinates outside 0..1 are treated.
enum class Wrap : uint8_t { repeat, mirror, clamp };

inline constexpr uint32_t kNoTexture = 0xffffffffu;

struct Material {
  std::array<float, 3> factor{1, 1, 1};  ///< multiplied by the texture and the vertex colour
  uint32_t texture = kNoTexture;         ///< index into Scene::textures
  std::array<Wrap, 2> wrap{};
  /// Row-major 2x3: maps texture coordinates to where the texture is sampled.
  std::array<float, 6> transform{1, 0, 0, 0, 1, 0};

  bool operator==(const Material&) const = default;
};

/// Of one mesh. If everything is empty, its colour is unknown.
struct Appearance {
  std::vector<std::array<float, 3>> colors;       ///< [positions]; empty: all are white
  std::vector<std::array<float, 2>> coordinates;  ///< [positions], texture coordinates; empty: all are 0
  std::vector<uint32_t> materials;  ///< [triangles], index into Scene::materials; empty: all use the first

  /// Earlier vertices without a colour become white. Values that are not >= 0 become 0, and values above 1
  /// become 1.
  void set_color(size_t vertex, const std::array<float, 3>& color);
  /// Extends the arrays that exist to the size of the mesh.
  void complete(size_t vertices, size_t triangles);

  bool known() const { return !colors.empty() || !materials.empty(); }
  bool operator==(const Appearance&) const = default;
};

}  // namespace nif::mesh
