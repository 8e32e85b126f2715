// Decides which triangles of a glTF let light through.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "formats/mesh/alpha_picture.hpp"
#include "formats/mesh/gltf/pictures.hpp"

namespace nif::mesh::detail {

/// What decides for the triangles of one primitive.
struct GltfDrawn {
  int material = -1;
  int colors = -1;       ///< accessor of vertex colours with alpha; -1: none
  int coordinates = -1;  ///< accessor of the texture coordinates of the material's picture; -1: none
  /// Its colours and texture coordinates are in Draco data, which are not decoded.
  bool hidden = false;
};

/// Alpha is that of the base colour: the material's factor, times the mean of the triangle's vertex colours, times
/// the texel that a point is in. Not thread-safe.
class GltfAlpha {
 public:
  GltfAlpha(const Input& input, const GltfSource& source, const GltfData& data, Scene& scene)
      : input_(input), source_(source), data_(data), pictures_(input, source.look, data, scene) {}

  /// Decides for triangles whose first vertex is `base`, of `vertices`. The result has one for each, or none if all
  /// are solid.
  std::vector<TriangleAlpha> decide(const GltfDrawn& drawn, std::span<const Triangle> triangles,
                                    uint32_t base, uint32_t vertices);

  /// Describes the materials that may let light through, and pictures that could not be read.
  void report(Scene& scene) const;

 private:
  /// What a material says.
  struct Rule {
    MaterialAlpha::Rule rule;
    std::optional<TriangleAlpha> always;  ///< whatever the alpha
    double cutoff = 0;
  };
  std::optional<Rule> rule_of(size_t material) const;
  /// The picture of a material; null: it has none with alpha.
  const AlphaPicture* picture_of(size_t material);

  const Input& input_;
  const GltfSource& source_;
  const GltfData& data_;
  GltfPictures pictures_;
  struct Known {
    std::optional<AlphaPicture> picture;
    std::string why;  ///< it cannot be read
  };
  std::map<int, Known> known_;                 ///< by image
  std::map<size_t, MaterialAlpha> materials_;  ///< of triangles so far
  std::map<size_t, std::string> unread_;       ///< why a material's picture cannot be read
};

}  // namespace nif::mesh::detail
