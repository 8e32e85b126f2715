// `nif mesh`: what can be done with meshes themselves, one file a verb.
#include "tools/mesh.hpp"

namespace nif::tools {

void add_mesh(CLI::App& app) {
  CLI::App* command = app.add_subcommand("mesh", "Look at meshes, make and convert them");
  command->require_subcommand(1);
  add_mesh_convert(*command);
  add_mesh_generate(*command);
  add_mesh_info(*command);
  command->footer("Example: nif mesh generate statue -o statue.ply --triangles 1000000");
}

}  // namespace nif::tools
