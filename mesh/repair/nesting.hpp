// Turns closed surfaces to face outwards, and the walls of cavities inwards. Internal to mesh/repair.
#pragma once

#include <cstdint>

#include "formats/mesh/mesh_scene.hpp"

namespace nif::repair {

struct Nesting {
  uint64_t turned = 0;  ///< solids that faced the wrong way
  /// Seem to face the wrong way, but are left, because it is not certain what contains them.
  uint64_t unclear = 0;
};

/// Orients solids, which are closed components, by how many others contain them. If the number is even, they
/// face outwards. If it is odd, they are walls of cavities and face inwards. The sign of the volume tells how
/// a solid faces.
///
/// A solid is turned if it is not within the bounds of any other; or if neither it nor the solids around it
/// cross or touch another one. With `keep_nested`, solids within the bounds of another stay as they are. The
/// mesh must be as orient() leaves it. Takes O(n log n) time for n triangles; solids that would need more
/// stay as they are.
Nesting turn_solids(mesh::Mesh& mesh, bool keep_nested);

}  // namespace nif::repair
