// First hits that the runtime finds.
#pragma once

#include <cstdint>
#include <span>

#include "bake/oracle/hits.hpp"
#include "nif/nif.h"

namespace nif::tools {

/// Asks the runtime. The scene must outlive the finder.
bake::HitFinder runtime_finder(NifScene scene);

/// The rays whose first hits differ between the two in any bit of any output.
uint64_t different_hits(std::span<const bake::Segment> segments, NifScene scene, NifScene reference);

}  // namespace nif::tools
