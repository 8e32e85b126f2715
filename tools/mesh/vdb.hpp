// Reads the level sets of a .vdb as meshes, for `nif mesh`.
#pragma once

#include "formats/mesh/scene.hpp"
#include "tools/common/options.hpp"

namespace nif::tools {

/// Does the file begin as a .vdb does? False where it cannot be read.
bool is_vdb(const std::string& file);

/// Each level set of a .vdb as a mesh of that name, where it stands; a warning for each grid that is none.
/// OpenVDB trusts what it reads, so another process of this program does it: what crashes that one, or makes
/// it take more memory than there is, is an error here. Throws as mesh::read(), and Error(interrupted).
mesh::Scene read_vdb(const std::string& file);

/// The verb that the other process runs; not listed by --help.
void add_mesh_read_vdb(Command mesh);

}  // namespace nif::tools
