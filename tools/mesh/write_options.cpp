// Gives every verb with these options the same wording. mesh::check_options() decides what fits the format.
#include "tools/mesh/write_options.hpp"

#include <fmt/format.h>

#include "formats/mesh/draco_writer.hpp"

namespace nif::tools {

void add_write_options(Command command, mesh::WriteOptions& options) {
  command.add_flag("--draco", options.draco, "Compress a .glb with Draco (KHR_draco_mesh_compression)");
  command
      .add_option("--draco-bits", options.draco_bits,
                  fmt::format("Draco rounds coordinates to this many bits (0 = no rounding; default: {})",
                              mesh::kDracoBits))
      .range(uint32_t{0}, mesh::kMostDracoBits);
  command.add_flag("--text", options.text, "Write a text .stl, which keeps objects and their names");
}

}  // namespace nif::tools
