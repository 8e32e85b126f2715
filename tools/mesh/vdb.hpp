// Reads the level sets of a .vdb as meshes, in a separate process because OpenVDB trusts its input.
#pragma once

#include "formats/mesh/mesh_scene.hpp"
#include "tools/common/options.hpp"

namespace nif::tools {

/// Whether the file starts like a .vdb. Returns false if it cannot be read.
bool is_vdb(const std::string& file);

/// Returns each level set of a .vdb as a mesh of that name, in its place, and a warning for each grid that is
/// not a level set. OpenVDB trusts what it reads, so another process of this program reads the file. If that
/// process crashes, or needs more memory than there is, that is an error here. Throws as mesh::read() does,
/// and Error(interrupted).
mesh::Scene read_vdb(const std::string& file);

/// The verb that the other process runs; not listed by --help.
void add_mesh_read_vdb(Command mesh);

}  // namespace nif::tools
