// Declares the verbs of `nif mesh`, each in the file of its name.
#pragma once

#include "tools/common/options.hpp"

namespace nif::tools {

/// Each adds a verb's options to `mesh`; its callback does the work and throws nif::Error on failure.
void add_mesh_compare(Command mesh);
void add_mesh_convert(Command mesh);
void add_mesh_decimate(Command mesh);
void add_mesh_generate(Command mesh);
void add_mesh_info(Command mesh);
void add_mesh_remesh(Command mesh);
void add_mesh_repair(Command mesh);
void add_mesh_subdivide(Command mesh);
void add_mesh_voxelize(Command mesh);

}  // namespace nif::tools
