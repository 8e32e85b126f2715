// How the verbs of `nif mesh` are told to write a mesh.
#pragma once

#include "formats/mesh/write.hpp"
#include "tools/common/options.hpp"

namespace nif::tools {

/// --draco, --draco-bits and --text.
void add_write_options(Command command, mesh::WriteOptions& options);

}  // namespace nif::tools
