// Merges vertices that are almost at the same position. Internal to mesh/repair.
#pragma once

#include "formats/mesh/scene.hpp"

namespace nif::repair {

/// Gives every vertex within `distance` of an earlier one that position; of several, the nearest, then the
/// earliest. Chains do not grow: what is moved draws nothing along. Returns how many were moved; equal
/// positions are not. `distance` is above 0; vertices must be finite.
uint64_t snap_vertices(std::vector<mesh::Float3>& positions, double distance);

}  // namespace nif::repair
