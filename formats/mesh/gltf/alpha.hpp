// Decides which triangles of a glTF let light through.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "formats/mesh/gltf/pictures.hpp"
#include "formats/mesh/material_alpha.hpp"

namespace nif::mesh::detail {

/// What decides for the triangles of one primitive.
struct GltfDrawn {
  int material = -1;
  int colors = -1;       ///< accessor of vertex colours, which may have alpha; -1: none
  int coordinates = -1;  ///< accessor of the texture coordinates of the material's picture; -1: none
  /// Its colours and texture coordinates are in Draco data, which are not decoded.
  bool hidden = false;
};

/// Alpha is that of the base colour: the material's factor, times that of vertex colours, times the texel that a point
/// is in. Not thread-safe.
class GltfAlpha {
 public:
  GltfAlpha(const Input& input, const GltfSource& source, const GltfData& data, Scene& scene)
      : input_(input),
        source_(source),
        data_(data),
        pictures_(input, source.look, data, scene),
        holes_(input.limits.alpha.resolution) {}

  /// Whether anything with this material may let light through.
  bool may_matter(int material) const;

  /// Triangles of a mesh, from `first` on. Their first vertex is `base`, of `vertices`.
  struct Part {
    std::span<const Triangle> triangles;
    size_t first;
    uint32_t base, vertices;
  };
  /// Decides for a part, and collects its holes. The result has one for each triangle, or none if all are solid.
  std::vector<TriangleAlpha> decide(const GltfDrawn& drawn, const Part& part, HoleCollector& holes);

  const AlphaReport& report() const { return report_; }

 private:
  /// What a material says.
  struct Rule {
    MaterialAlpha::Rule rule;
    std::optional<TriangleAlpha> always;  ///< whatever the alpha
    double cutoff = 0;
  };
  std::optional<Rule> rule_of(size_t material) const;
  std::vector<TriangleAlpha> decide_each(const GltfDrawn& drawn, AlphaTest test, const Part& part,
                                         HoleCollector& holes);
  /// The picture of a material; null: it has none with alpha.
  const AlphaPicture* picture_of(size_t material);

  const Input& input_;
  const GltfSource& source_;
  const GltfData& data_;
  GltfPictures pictures_;
  /// Values of the vertices of the accessor that was read last.
  template <class Value>
  struct OfVertices {
    int accessor = -1;
    std::vector<Value> values{};
  };

  /// Reads them, unless they are there. Throws an Error if there are fewer than `count`.
  template <class Value, class Read>
  const std::vector<Value>& of_vertices(OfVertices<Value>& kept, int accessor, uint32_t count,
                                        const Read& read);

  std::map<int, ReadPicture> known_;  ///< by image
  OfVertices<std::array<float, 2>> coordinates_;
  OfVertices<float> colors_;
  uint64_t read_ = 0;  ///< values of vertices
  uint64_t steps_ = AlphaPicture::kMostSteps;
  HoleMaker holes_;
  AlphaReport report_;
};

}  // namespace nif::mesh::detail
