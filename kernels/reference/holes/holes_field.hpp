// The memory of the holes of an object: which of its triangles show which texels of alpha maps, and the test that
// decides whether a triangle blocks where a ray meets it (docs/encodings/cutout.md).
#pragma once

#include <cstdint>

#include "kernels/reference/triangles/source_triangles.hpp"
#include "kernels/reference/triangles/triangles_query.hpp"

namespace nif::kernels {

/// What is shown beyond the borders of an alpha map.
enum AlphaWrap : uint32_t { kAlphaRepeat = 0, kAlphaMirror = 1, kAlphaClamp = 2, kAlphaWraps = 3 };

inline constexpr uint32_t kMaxAlphaSide = 16384;  ///< in texels
inline constexpr uint32_t kAlphaTile = 8;         ///< texels of a tile, along a side

/// One bit for each texel of a picture. 1: it blocks light.
struct AlphaMap {
  /// [rows of tiles][tiles of a row]: texel (x, y) is bit x % 8 + 8 * (y % 8) of tile (x / 8, y / 8). Texels of tiles
  /// beyond the picture are 0.
  const uint64_t* tiles = nullptr;
  uint32_t width = 0, height = 0;  ///< in texels, 1 to kMaxAlphaSide
  uint32_t wrap[2] = {};           ///< AlphaWrap, along x and y
};

NIF_HOST_DEVICE constexpr uint32_t alpha_tiles(uint32_t texels) {
  return (texels + kAlphaTile - 1) / kAlphaTile;
}
/// Tiles of a whole map.
NIF_HOST_DEVICE constexpr uint64_t alpha_tiles(uint32_t width, uint32_t height) {
  return uint64_t{alpha_tiles(width)} * alpha_tiles(height);
}

/// Coordinates of a patch are in 2^(shift - kAlphaFraction) texels.
inline constexpr uint32_t kAlphaFraction = 16;

/// The part of an alpha map that a triangle shows.
struct AlphaPatch {      // 32 bytes
  uint32_t map;          ///< index into HolesField::maps
  uint32_t shift;        ///< 0 to kAlphaFraction
  int32_t places[3][2];  ///< by corner: from the map's upper left corner to the right and down
};
static_assert(sizeof(AlphaPatch) == 32);

struct HolesField {
  const AlphaMap* maps = nullptr;       ///< of the asset
  const AlphaPatch* patches = nullptr;  ///< [patch_count]
  /// Of each triangle of the object, as packed numbers: 0 if it has no holes, else its patch plus 1.
  SourceTriangles numbers;
  uint32_t map_count = 0, patch_count = 0;
};

/// The patch of a triangle; null if it has no holes.
NIF_HOST_DEVICE inline const AlphaPatch* patch_of(const HolesField& holes, uint32_t triangle) {
  const uint32_t number = source_triangle(holes.numbers, triangle);
  return number == 0 ? nullptr : holes.patches + (number - 1);
}

/// A texel of a row or a column of `size` texels.
NIF_HOST_DEVICE inline uint32_t wrapped_texel(int64_t texel, uint32_t size, uint32_t wrap) {
  const auto last = int64_t{size} - 1;
  if (texel >= 0 && texel <= last) return uint32_t(texel);
  if (wrap == kAlphaClamp) return texel < 0 ? 0 : uint32_t(last);
  const int64_t period = wrap == kAlphaMirror ? 2 * int64_t{size} : int64_t{size};
  int64_t rest = texel % period;
  if (rest < 0) rest += period;
  return uint32_t(rest <= last ? rest : 2 * last + 1 - rest);
}

/// Does the texel of a map block light?
NIF_HOST_DEVICE inline bool blocks_light(const AlphaMap& map, int64_t x, int64_t y) {
  const uint32_t column = wrapped_texel(x, map.width, map.wrap[0]),
                 row = wrapped_texel(y, map.height, map.wrap[1]);
  const uint64_t tile = map.tiles[size_t{row / kAlphaTile} * alpha_tiles(map.width) + column / kAlphaTile];
  return (tile >> (column % kAlphaTile + kAlphaTile * (row % kAlphaTile)) & 1) != 0;
}

/// floor(x), for |x| below 2^62.
NIF_HOST_DEVICE inline int64_t floor_of(double x) {
  const auto toward_zero = static_cast<int64_t>(x);
  return toward_zero - (static_cast<double>(toward_zero) > x);
}

/// Does a triangle with this patch block a ray that meets it there? The weights of a crossing are not negative and at
/// most their sum, so a place is at most 2^34 in size.
NIF_HOST_DEVICE NIF_PART_OF_KERNEL bool blocks_light(const HolesField& holes, const AlphaPatch& patch,
                                                     const TriangleCrossing<double>& crossing) {
  const double second = crossing.weight[1] / crossing.sum, third = crossing.weight[2] / crossing.sum;
  const double unit = 1.0 / static_cast<double>(1u << (kAlphaFraction - patch.shift));
  int64_t texel[2];
  NIF_UNROLL
  for (int a = 0; a < 2; ++a) {
    const auto first = static_cast<double>(patch.places[0][a]);
    const double at = (first + second * (static_cast<double>(patch.places[1][a]) - first)) +
                      third * (static_cast<double>(patch.places[2][a]) - first);
    texel[a] = floor_of(at * unit);
  }
  return blocks_light(holes.maps[patch.map], texel[0], texel[1]);
}

/// Which of the triangles that a ray meets block it (triangles_query.hpp): all but where they have holes.
struct BlockingTriangles {
  const HolesField& holes;

  NIF_HOST_DEVICE bool operator()(uint32_t triangle, const TriangleCrossing<double>& crossing) const {
    const AlphaPatch* const patch = patch_of(holes, triangle);
    return patch == nullptr || blocks_light(holes, *patch, crossing);
  }
};

}  // namespace nif::kernels
