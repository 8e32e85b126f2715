// `nif mesh`: collects the verbs for meshes, one file each.
#include "tools/mesh/verbs.hpp"

#include "tools/common/options.hpp"
#include "tools/mesh/vdb.hpp"
#include "tools/subcommands.hpp"

namespace nif::tools {

void add_mesh(Command app) {
  const Command command = app.add_subcommand("mesh", "Inspect, generate, convert and change meshes");
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
  command.footer(
      "Examples:\n"
      "  nif mesh generate statue -o statue.ply --triangles 1000000\n"
      "  nif mesh info statue.ply\n"
      "  nif mesh convert statue.ply -o statue.glb\n"
      "'nif mesh SUBCOMMAND --help' describes each.");
}

}  // namespace nif::tools
