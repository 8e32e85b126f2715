// What colour a surface has: materials with a factor and a texture, and colours of vertices. Colours are
// linear RGB with the primaries of sRGB, from 0 to 1.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace nif::mesh {

/// 8 bits for each of red, green and blue, as sRGB has them; rows from the top.
struct Texture {
  uint32_t width = 0, height = 0;  ///< at least 1
  std::vector<uint8_t> texels;     ///< [height][width][3]
};

/// What a value of sRGB, limited to 0 to 1, is in linear light. NaN is anything.
double linear_of(double srgb);

/// What is beyond 0 to 1 of texture coordinates.
enum class Wrap : uint8_t { repeat, mirror, clamp };

inline constexpr uint32_t kNoTexture = 0xffffffffu;

struct Material {
  std::array<float, 3> factor{1, 1, 1};  ///< times the texture, times the vertices' colour
  uint32_t texture = kNoTexture;         ///< index into Scene::textures
  std::array<Wrap, 2> wrap{};
  /// Row-major 2x3: takes texture coordinates to where the texture is looked up.
  std::array<float, 6> transform{1, 0, 0, 0, 1, 0};

  bool operator==(const Material&) const = default;
};

/// Of one mesh. All empty: nothing is known of its colour.
struct Appearance {
  std::vector<std::array<float, 3>> colors;       ///< [positions]; empty: all are white
  std::vector<std::array<float, 2>> coordinates;  ///< [positions], in textures; empty: all are 0
  std::vector<uint32_t> materials;  ///< [triangles], in Scene::materials; empty: all are the first

  /// Those before it that have none become white. What is no number from 0 up is 0, and at most 1.
  void set_color(size_t vertex, const std::array<float, 3>& color);
  /// Of a mesh with so many: fills up what is there.
  void complete(size_t vertices, size_t triangles);

  bool known() const { return !colors.empty() || !materials.empty(); }
  bool operator==(const Appearance&) const = default;
};

}  // namespace nif::mesh
