// Merges vertices that are almost at the same position. Internal to mesh/repair.
#pragma once

#include "formats/mesh/mesh_scene.hpp"

namespace nif::repair {

/// Gives every vertex within `distance` of an earlier one that vertex's position; if there are several, that
/// of the nearest, then of the earliest. Chains do not grow: a moved vertex attracts no others. Returns how
/// many vertices moved; vertices with equal positions do not count. `distance` must be above 0, and vertices
/// must be finite.
uint64_t snap_vertices(std::vector<mesh::Float3>& positions, double distance);

}  // namespace nif::repair
