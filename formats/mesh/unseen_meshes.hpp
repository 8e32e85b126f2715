// The note that a scene gets where names look like those of collision shapes or of coarser levels of
// detail. formats/mesh/check.cpp adds it; how such names are recognised is in unseen_meshes.cpp.
#pragma once

#include "formats/mesh/input.hpp"

namespace nif::mesh::detail {

/// Adds a remark to a scene, whose names are clean, where names of its objects are those of collision shapes
/// or of coarser levels of detail.
void note_helpers(const Input& input, Scene& scene);

}  // namespace nif::mesh::detail
