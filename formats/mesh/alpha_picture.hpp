// Tells what triangles show of a picture's alpha. Blocks of texels know their least and greatest alpha, so that
// a triangle looks at few texels, however large it is.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "formats/mesh/alpha.hpp"
#include "formats/mesh/appearance.hpp"
#include "formats/mesh/image.hpp"

namespace nif::mesh::detail {

/// A place in a picture, in texels from its upper left corner.
using TexelPoint = std::array<double, 2>;

class AlphaPicture {
 public:
  explicit AlphaPicture(AlphaTexels texels);

  uint32_t width() const { return levels_[0].width; }
  uint32_t height() const { return levels_[0].height; }
  /// Of a texel, counted from the upper left corner; 65535: opaque.
  uint16_t alpha(uint32_t x, uint32_t y) const { return levels_[0].ranges[size_t{y} * width() + x].least; }

  /// What a triangle is whose corners are at these places, if texels of at least `least` block (65536: none does).
  /// A texel counts if the triangle comes within a 64th of a texel of its square; without area, if their boxes do.
  /// `cut` is also the answer if the picture has both kinds of texels, and the triangle spans more than kMostTiles
  /// repetitions, is too far away, or takes too many steps.
  /// `steps`: those that may still be taken, for all triangles of a file.
  TriangleAlpha show(const std::array<TexelPoint, 3>& corners, const std::array<Wrap, 2>& wrap,
                     uint32_t least, uint64_t& steps) const;

  static constexpr uint64_t kMostSteps = uint64_t{1} << 30;  ///< for a file: some ten seconds

 private:
  static constexpr uint32_t kBlockBits = 2;
  static constexpr uint32_t kBlock = 1 << kBlockBits;  ///< blocks of a level in one of the next, along a side
  static constexpr double kMostTiles = 16;
  static constexpr uint32_t kMostStepsOfOne = 20'000;

  struct Range {
    uint16_t least, most;
  };
  /// The squares of one size.
  struct Level {
    uint32_t width, height;
    std::vector<Range> ranges;  ///< [height][width]
  };
  class Search;

  std::vector<Level> levels_;  ///< texels first; the last has one square
};

}  // namespace nif::mesh::detail
