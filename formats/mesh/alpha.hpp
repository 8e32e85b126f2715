// Describes what lets light through: which materials, how their alpha is read, and what that makes of triangles.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "formats/mesh/appearance.hpp"

namespace nif::mesh {

/// What a triangle lets through.
enum class TriangleAlpha : uint8_t {
  solid,  ///< nothing
  cut,    ///< it has holes, or may have some
  clear,  ///< everything: it blocks no ray
};

/// A picture's alpha, reduced to one bit for each texel. Meshes share it.
struct AlphaMap {
  static constexpr uint32_t kMostSide = 16384;
  static constexpr uint32_t kTile = 8;  ///< texels of a tile, along a side

  uint32_t width = 0, height = 0;  ///< in texels, 1 to kMostSide
  std::array<Wrap, 2> wrap{};      ///< beyond the borders, along x and y
  /// [rows of tiles][tiles of a row]: texel (x, y), from the upper left corner, is bit x % 8 + 8 * (y % 8) of tile
  /// (x / 8, y / 8). 1: it blocks. Texels of tiles beyond the picture are 0.
  std::vector<uint64_t> tiles;

  uint32_t tiles_of_row() const { return (width + kTile - 1) / kTile; }
  bool operator==(const AlphaMap&) const = default;
};
using AlphaMaps = std::vector<std::shared_ptr<const AlphaMap>>;

/// Where a triangle has holes: the part of an alpha map that it shows. The places of its corners are counted from the
/// map's upper left corner to the right and down, in 2^(shift - kFraction) texels.
struct TriangleHoles {
  static constexpr uint32_t kNoMap = 0xffffffffu;
  static constexpr uint32_t kFraction = 16;

  uint32_t map =
      kNoMap;          ///< index into Mesh::alpha_maps; kNoMap: the triangle has no holes, and the rest is 0
  uint32_t shift = 0;  ///< 0 to kFraction, the least with which all places fit
  std::array<std::array<int32_t, 2>, 3> places{};  ///< by corner

  bool any() const { return map != kNoMap; }
  bool operator==(const TriangleHoles&) const = default;
};

/// How alpha becomes holes: light passes where alpha is below a cutoff, and nothing is half blocked.
struct AlphaOptions {
  /// Of materials that blend with what is behind them.
  enum class Blend : uint8_t {
    cutoff,  ///< as those with a cutoff
    opaque,  ///< they are solid
    ignore,  ///< rays ignore them: they block nothing
  };

  bool read = false;    ///< otherwise everything is solid
  double cutoff = 0.5;  ///< of materials that blend; others have their own
  Blend blend = Blend::cutoff;
  bool opaque_glass = false;  ///< otherwise materials that transmit light block nothing
  /// The most texels along a side of a map, to which larger ones are halved: a texel blocks if at least half of those
  /// that it stands for do. 0: as the pictures are. Whether a triangle is cut is decided by the whole picture.
  uint32_t resolution = 0;

  bool operator==(const AlphaOptions&) const = default;
};

/// A material that may let light through, and what became of its triangles.
struct MaterialAlpha {
  /// What decided.
  enum class Rule : uint8_t { mask, blend, glass };

  std::string name;  ///< UTF-8; "material 3" if it has none
  Rule rule = Rule::mask;
  double cutoff = 0;  ///< alpha below it lets light through; 0 also if no alpha was compared
  /// Triangles, of all meshes of the file; `cut` are those with holes.
  uint64_t solid = 0, cut = 0, clear = 0;
  uint64_t filled = 0;  ///< that are cut, too, but without holes: they block as if solid
};

}  // namespace nif::mesh
