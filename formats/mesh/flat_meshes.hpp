// Makes the mesh that is left if a transform flattens it. A scale of 0 along one axis turns a cube into a
// floor: it blocks rays, but the transform has no inverse, so no instance can represent it. Instead, its
// vertices are transformed, and the instance has only the translation.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <utility>

#include "formats/mesh/input.hpp"
#include "formats/mesh/transform.hpp"

namespace nif::mesh::detail {

/// Whether a transform needs this: it has no inverse in single precision, or one so skewed that answers with
/// it are not certain (beyond a scale of 1 : 4096).
bool is_flat(const Affine& place);

class FlatMeshes {
 public:
  /// Adds meshes to the scene. The arguments must outlive this.
  FlatMeshes(const Input& input, Scene& scene);

  /// The number of a mesh with the positions of `mesh` transformed by the linear part of a transform and
  /// rounded once. Equal ones are made once. Returns nothing if it has no area: no triangle is higher than
  /// rounding of its positions alone could make it, or all of it is too small or too large to be baked.
  /// Throws too_large if the triangles to examine or to keep exceed the limits.
  /// limits.
  std::optional<uint32_t> add(uint32_t mesh, const Affine& place);

 private:
  std::optional<uint32_t> make(uint32_t mesh, const Affine& linear);

  const Input& input_;
  Scene& scene_;
  std::map<std::pair<uint32_t, Affine>, std::optional<uint32_t>> known_;
  uint64_t read_ = 0;       ///< triangles of the original scene
  uint64_t looked_at_ = 0;  ///< triangles, or a third of the positions
};

}  // namespace nif::mesh::detail
