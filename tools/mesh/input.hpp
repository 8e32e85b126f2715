// How the verbs of `nif mesh` read their input.
#pragma once

#include <string>

#include "formats/mesh/read.hpp"
#include "tools/common/progress.hpp"

namespace nif::tools {

/// mesh::read(), or read_vdb(), for a file that fits into memory: what is there is less than the file and the
/// arrays it becomes, and the file is refused (Error(too_large)) before it is loaded. Of a .vdb nothing can
/// be chosen.
mesh::Scene read_mesh(const std::string& file, Progress& progress, const mesh::ReadLimits& limits = {});

/// Triangles of all meshes, each mesh once.
uint64_t triangles_of(const mesh::Scene& scene);

}  // namespace nif::tools
