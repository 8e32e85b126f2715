// Turns closed surfaces to face outwards, and the walls of cavities inwards. Internal to mesh/repair.
#pragma once

#include <cstdint>

#include "formats/mesh/scene.hpp"

namespace nif::repair {

struct Nesting {
  uint64_t turned = 0;   ///< solids that faced the wrong way
  uint64_t unclear = 0;  ///< that seem to, but stay, because it is not sure what they are in
};

/// Turns solids, closed components, by how many others they are within: an even number, and they face
/// outwards; an odd one, and they are walls of cavities and face inwards. The volume says how a solid faces.
///
/// That is told for a solid that is not within the bounds of any other; and for one that neither crosses nor
/// touches another one, if those around it do not, either. With `keep_nested`, solids within the bounds of
/// another stay as they are. The mesh is as orient() leaves it. Takes time for n log n triangles; where it
/// would be more, solids stay as they are.
Nesting turn_solids(mesh::Mesh& mesh, bool keep_nested);

}  // namespace nif::repair
