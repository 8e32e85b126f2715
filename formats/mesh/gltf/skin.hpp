// Where a skinned mesh is in its bind pose. glTF ignores the transform of its node: joints place it, each
// with its own transform after the inverse of its bind transform. If all joints agree, the mesh moves as a
// whole and becomes an instance. If they do not, it would be deformed.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <vector>

#include "formats/mesh/gltf/accessor.hpp"
#include "formats/mesh/gltf/hierarchy.hpp"

namespace nif::mesh::detail {

struct BindPlace {
  Affine place{};
  double reach = 0;  ///< how far from its origin the mesh has joints

  /// The same place, but for what rounding and the matrices' few digits make of it.
  bool alike(const Affine& other) const;
};

/// Where a skin's meshes stand in their bind pose. None where its joints do not agree on a place, or the skin
/// is malformed. `worlds` has the places of the nodes that are shown. Throws nothing but bad_alloc.
std::optional<BindPlace> bind_place(const GltfData& data, const GltfSkin& skin,
                                    std::span<const std::optional<Affine>> worlds);

}  // namespace nif::mesh::detail
