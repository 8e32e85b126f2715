// What is left of a mesh where a transform flattens it. A scale of 0 along one axis makes a floor of a cube:
// it blocks, but the transform has no inverse, so no instance can stand for it. Its vertices are moved
// instead, and the instance has only their translation.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <utility>

#include "formats/mesh/input.hpp"
#include "formats/mesh/transform.hpp"

namespace nif::mesh::detail {

/// Whether a transform needs that: it has no inverse in single precision, or one that is so skewed that
/// answers by it are not certain (beyond a scale of 1 : 4096).
bool is_flat(const Affine& place);

class FlatMeshes {
 public:
  /// Adds meshes to the scene. The arguments must outlive this.
  FlatMeshes(const Input& input, Scene& scene);

  /// The number of a mesh that has a mesh's positions taken through the linear part of a transform: rounded
  /// once, with all the rest of it. Equal ones are made once. None where it has no area: no triangle is
  /// higher than what rounding of its positions alone could make it, or all of it is too small or too large
  /// to be baked. Throws too_large where so many would have to be looked at or kept that they exceed the
  /// limits.
  std::optional<uint32_t> add(uint32_t mesh, const Affine& place);

 private:
  std::optional<uint32_t> make(uint32_t mesh, const Affine& linear);

  const Input& input_;
  Scene& scene_;
  std::map<std::pair<uint32_t, Affine>, std::optional<uint32_t>> known_;
  uint64_t read_ = 0;       ///< triangles of the scene as it was
  uint64_t looked_at_ = 0;  ///< triangles, or a third of the positions
};

}  // namespace nif::mesh::detail
