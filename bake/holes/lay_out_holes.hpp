// Makes the holes part of an object from a clean mesh.
#pragma once

#include <cstdint>
#include <span>

#include "formats/mesh/clean.hpp"
#include "formats/nif/asset.hpp"

namespace nif::bake {

/// `order`: of each triangle of the object, its index among the mesh's triangles and then its slivers. Triangles that
/// show the same part of a map share a patch. Adds the maps in use to `maps`, which is empty.
format::HolesData lay_out_holes(const mesh::CleanMesh& mesh, std::span<const uint32_t> order,
                                format::AlphaMaps& maps);

/// Adds the maps of an object to those of an asset, unless they are there, and makes the object use these.
void share_alpha_maps(format::HolesData& holes, const format::AlphaMaps& own, format::AlphaMaps& all);

}  // namespace nif::bake
