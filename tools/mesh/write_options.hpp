// Adds the options that say how the verbs of `nif mesh` write a mesh.
#pragma once

#include "formats/mesh/write.hpp"
#include "tools/common/options.hpp"

namespace nif::tools {

/// Adds --draco, --draco-bits and --text.
void add_write_options(Command command, mesh::WriteOptions& options);

}  // namespace nif::tools
