// Finds first hits through the runtime, to measure and compare them.
#pragma once

#include <cstdint>
#include <span>

#include "bake/ground_truth/evaluate_hits.hpp"
#include "nif/nif.h"

namespace nif::tools {

/// Queries the runtime. The scene must outlive the finder.
bake::HitFinder runtime_finder(NifScene scene);

/// Number of rays whose first hits differ between the two scenes in any bit of any output.
uint64_t different_hits(std::span<const bake::Segment> segments, NifScene scene, NifScene reference);

}  // namespace nif::tools
