// Applies the alpha of a material to its triangles, and describes what became of them. Internal to formats/mesh.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>

#include "formats/mesh/alpha_picture.hpp"
#include "formats/mesh/input.hpp"

namespace nif::mesh::detail {

/// Of a material: alpha is the factor, times that of a vertex, times that of a texel. It is multiplied in doubles, and
/// compared in floats, as files have them.
struct AlphaTest {
  double factor = 1;  ///< 0 to 1
  double cutoff = 0;
  const AlphaPicture* picture = nullptr;  ///< null: all texels are opaque
  std::array<Wrap, 2> wrap{};

  /// What a triangle is whose corners are at these places of the picture. The alpha of its vertices lies between two
  /// bounds; if they decide differently, it is cut.
  /// `steps`: as AlphaPicture::show().
  TriangleAlpha show(const std::array<TexelPoint, 3>& corners, uint64_t& steps, float least_alpha = 1,
                     float most_alpha = 1) const;

 private:
  TriangleAlpha show_at(const std::array<TexelPoint, 3>& corners, double alpha, uint64_t& steps) const;
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
  void count(size_t material, TriangleAlpha alpha);
  /// Its picture counts as opaque. `why` goes on from the name: "cannot be decoded".
  void cannot_read(size_t material, const std::string& why) { unread_.try_emplace(material, why); }

  /// Sets Scene::see_through, and adds notes.
  void write(const Input& input, Scene& scene) const;

 private:
  std::map<size_t, MaterialAlpha> materials_;
  std::map<size_t, std::string> unread_;
};

}  // namespace nif::mesh::detail
