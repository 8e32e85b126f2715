// The verbs of `nif mesh`, each in the file of its name.
#pragma once

#include "tools/command.hpp"

namespace nif::tools {

/// Each adds a verb's options to `mesh`; its callback does the work and throws nif::Error on failure.
void add_mesh_compare(CLI::App& mesh);
void add_mesh_convert(CLI::App& mesh);
void add_mesh_decimate(CLI::App& mesh);
void add_mesh_generate(CLI::App& mesh);
void add_mesh_info(CLI::App& mesh);
void add_mesh_remesh(CLI::App& mesh);
void add_mesh_repair(CLI::App& mesh);
void add_mesh_subdivide(CLI::App& mesh);
void add_mesh_voxelize(CLI::App& mesh);

}  // namespace nif::tools
