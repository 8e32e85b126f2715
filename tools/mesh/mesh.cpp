// `nif mesh`: what can be done with meshes themselves, one file a verb.
#include "tools/mesh/mesh.hpp"

#include "tools/mesh/vdb.hpp"

namespace nif::tools {

void add_mesh(Command app) {
  const Command command = app.add_subcommand("mesh", "Look at meshes, make, convert and change them");
  command.require_subcommand();
  add_mesh_compare(command);
  add_mesh_convert(command);
  add_mesh_decimate(command);
  add_mesh_generate(command);
  add_mesh_info(command);
  add_mesh_read_vdb(command);
  add_mesh_remesh(command);
  add_mesh_repair(command);
  add_mesh_subdivide(command);
  add_mesh_voxelize(command);
  command.footer("Example: nif mesh generate statue -o statue.ply --triangles 1000000");
}

}  // namespace nif::tools
