// Applies the alpha of a material to its triangles, and describes what became of them. Internal to formats/mesh.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "formats/mesh/alpha_picture.hpp"
#include "formats/mesh/hole_collector.hpp"
#include "formats/mesh/hole_maker.hpp"
#include "formats/mesh/input.hpp"

namespace nif::mesh::detail {

/// Of a material: alpha is the factor, times that of a vertex, times that of a texel. It is multiplied in doubles, and
/// compared in floats, as files have them.
struct AlphaTest {
  double factor = 1;  ///< 0 to 1
  double cutoff = 0;
  const AlphaPicture* picture = nullptr;  ///< null: all texels are opaque
  std::array<Wrap, 2> wrap{};

  /// Of a triangle.
  struct Corners {
    std::array<TexelPoint, 3> places{};    ///< in the picture
    std::array<float, 3> alphas{1, 1, 1};  ///< of the vertices
  };

  /// What the triangle is. With a picture, the mean alpha of its vertices counts everywhere, because a map has one
  /// cutoff; without one, it is linear between them. `steps`: as AlphaPicture::show().
  TriangleAlpha show(const Corners& corners, uint64_t& steps) const;
  /// For one that is cut.
  NewHoles holes(const Corners& corners, HoleMaker& maker) const;

 private:
  uint32_t least_texel_for(const Corners& corners) const;
};

/// A picture that was read for its alpha.
struct ReadPicture {
  std::optional<AlphaPicture> picture;  ///< none: it is opaque
  std::string why;                      ///< it cannot be read, and counts as opaque

  void keep(std::optional<AlphaTexels> texels) {
    if (texels && !texels->alpha.empty()) picture.emplace(*std::move(texels));
  }
  const AlphaPicture* get() const { return picture ? &*picture : nullptr; }
};

/// What became of the triangles of a file, by the number of their material.
class AlphaReport {
 public:
  /// The entry of a material, which is new the first time.
  MaterialAlpha& of(size_t material) { return materials_[material]; }
  /// Counts a triangle that is solid or clear.
  void count(size_t material, TriangleAlpha alpha);
  /// Counts one that is cut, but has no holes.
  void count_filled(size_t material, Filled why);
  /// Counts one that is cut, and collects its holes.
  void keep(size_t material, const NewHoles& made, size_t triangle, HoleCollector& holes);
  /// Its picture counts as opaque. `why` goes on from the name: "cannot be decoded".
  void cannot_read(size_t material, const std::string& why) {
    unread_.try_emplace(material, why + "; it counts as opaque");
  }
  /// The same where triangles have no texture coordinates.
  void cannot_place(size_t material) {
    unread_.try_emplace(material, "has no texture coordinates on some triangles; there it counts as opaque");
  }

  /// Sets Scene::see_through, and adds notes.
  void write(const Input& input, Scene& scene) const;

 private:
  std::map<size_t, MaterialAlpha> materials_;
  std::set<Filled> filled_;  ///< why triangles are
  std::map<size_t, std::string> unread_;
};

}  // namespace nif::mesh::detail
