// Adds the note that a scene gets if names look like those of collision shapes or of coarser levels of
// detail. formats/mesh/check.cpp calls it; unseen_meshes.cpp recognises such names.
#pragma once

#include "formats/mesh/input.hpp"

namespace nif::mesh::detail {

/// Adds a remark to a scene if names of its objects are those of collision shapes or of coarser levels of
/// detail. The names must be clean.
void note_helpers(const Input& input, Scene& scene);

}  // namespace nif::mesh::detail
