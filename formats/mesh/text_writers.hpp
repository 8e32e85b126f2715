// Writers of OBJ, OFF and STL. Internal to formats/mesh.
#pragma once

#include "formats/mesh/flat_scene.hpp"
#include "formats/mesh/stream.hpp"

namespace nif::mesh::detail {

/// Each instance as an object ("o"), in its own space of vertices.
void write_obj(Stream& out, const Scene& scene, const FlatScene& flat);
/// One mesh. Throws nothing of its own.
void write_off(Stream& out, const FlatScene& flat);
/// Binary, one mesh. At most 2^32 - 1 triangles.
void write_stl(Stream& out, const FlatScene& flat);
/// Each instance as a solid.
void write_stl_text(Stream& out, const Scene& scene, const FlatScene& flat);

}  // namespace nif::mesh::detail
