// Reads the input of the verbs of `nif mesh`.
#pragma once

#include <string>

#include "formats/mesh/read.hpp"
#include "tools/common/progress.hpp"

namespace nif::tools {

/// Calls mesh::read() or read_vdb(). If free memory is less than the file and the arrays made from it need,
/// refuses the file before it is loaded (Error(too_large)). A .vdb does not support a choice by name.
mesh::Scene read_mesh(const std::string& file, Progress& progress, const mesh::ReadLimits& limits = {});

/// Triangles of all meshes, each mesh counted once.
uint64_t triangles_of(const mesh::Scene& scene);

}  // namespace nif::tools
