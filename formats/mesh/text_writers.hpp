// Writers of OBJ, OFF and STL. Internal to formats/mesh.
#pragma once

#include <string_view>

#include "formats/mesh/flat_scene.hpp"
#include "formats/mesh/stream.hpp"

namespace nif::mesh::detail {

/// What OBJ cannot hold: a reader may trim the line, and then take the backslash for one that joins the next.
bool ends_in_backslash(std::string_view name);

/// Each instance as an object ("o"), in its own space of vertices.
void write_obj(Stream& out, const Scene& scene, const FlatScene& flat);
/// One mesh. Throws nothing of its own.
void write_off(Stream& out, const FlatScene& flat);
/// Binary, one mesh. At most 2^32 - 1 triangles.
void write_stl(Stream& out, const FlatScene& flat);
/// Each instance as a solid.
void write_stl_text(Stream& out, const Scene& scene, const FlatScene& flat);

}  // namespace nif::mesh::detail
