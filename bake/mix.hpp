// The mix of ray sets that training rays are drawn from.
#pragma once

#include <array>

#include "bake/ground_truth/ray_sets.hpp"

namespace nif::bake {

/// The weight of each ray set among the training rays; weights need not sum to 1.
using Mix = std::array<double, kRaySets.size()>;

/// Draws a set by weight; at least one weight must be above 0.
RaySet draw_set(const Mix& mix, Random& random);

inline constexpr size_t kTrainingChunk = 1024;  ///< rays that share a random stream

}  // namespace nif::bake
