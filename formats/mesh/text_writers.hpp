// Writers of OBJ, OFF and STL. Internal to formats/mesh.
#pragma once

#include <string_view>

#include "formats/mesh/flat_scene.hpp"
#include "formats/mesh/stream.hpp"

namespace nif::mesh::detail {

/// OBJ cannot represent such names: a reader may trim the line, and then the backslash joins the next line.
bool ends_in_backslash(std::string_view name);

/// Each instance as an object ("o"), with its own vertices.
void write_obj(Stream& out, const Scene& scene, const FlatScene& flat);
/// One mesh. Throws only what `out` throws.
void write_off(Stream& out, const FlatScene& flat);
/// Binary, one mesh. At most 2^32 - 1 triangles.
void write_stl(Stream& out, const FlatScene& flat);
/// Each instance as a solid.
void write_stl_text(Stream& out, const Scene& scene, const FlatScene& flat);

}  // namespace nif::mesh::detail
