// Makes the holes of triangles that are cut, and the alpha maps that they show. Internal to formats/mesh.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <tuple>
#include <vector>

#include "formats/mesh/alpha.hpp"
#include "formats/mesh/alpha_picture.hpp"

namespace nif::mesh::detail {

/// Why a triangle that is cut has no holes: it blocks as if solid.
enum class Filled : uint8_t {
  draco,      ///< its texture coordinates or colours are not decoded
  ambiguous,  ///< a polygon has several texture coordinates at one vertex
  far,        ///< its places do not fit
  large,      ///< the picture is larger than a map may be
  many,       ///< the maps of the file together would be too large
};

struct NewHoles {
  std::shared_ptr<const AlphaMap> map;  ///< null: none
  TriangleHoles holes{};                ///< without the number of the map
  Filled why{};                         ///< there are none
};

/// Keeps the maps of one file: each picture at each cutoff, once. Not thread-safe.
class HoleMaker {
 public:
  /// Texels of all maps of a file, 128 MiB.
  static constexpr uint64_t kMostTexels = uint64_t{1} << 30;
  /// Small maps count as this many, because of what is kept beside them.
  static constexpr uint64_t kLeastTexels = 4096;

  /// `resolution`: AlphaOptions::resolution. `texels`: for tests, fewer than kMostTexels.
  explicit HoleMaker(uint32_t resolution, uint64_t texels = kMostTexels)
      : resolution_(resolution), texels_(texels) {}

  /// For a triangle whose corners are at these places of a picture, which lives as long as this. Texels of at least
  /// `least` block.
  NewHoles of_picture(const AlphaPicture& picture, const std::array<Wrap, 2>& wrap, uint32_t least,
                      std::array<TexelPoint, 3> corners);
  /// For a triangle without a picture: alpha, divided by the cutoff, is linear between its corners.
  NewHoles of_corners(const std::array<double, 3>& alphas);

 private:
  using Map = std::shared_ptr<const AlphaMap>;

  Map map_of(const AlphaPicture& picture, const std::array<Wrap, 2>& wrap, uint32_t least, Filled& why);
  bool take(const std::array<uint32_t, 2>& size);
  std::array<uint32_t, 2> size_of(const AlphaPicture& picture) const;
  /// Cutoffs with no texel between them make the same map: the number of values below.
  size_t values_below(const AlphaPicture& picture, uint32_t least);

  const uint32_t resolution_;
  uint64_t texels_;                                              ///< that maps may still have
  std::map<const AlphaPicture*, std::vector<uint16_t>> values_;  ///< that texels have, ascending
  std::map<std::tuple<const AlphaPicture*, size_t, std::array<Wrap, 2>>, Map> maps_;
  Map ramp_;  ///< for of_corners()
};

}  // namespace nif::mesh::detail
