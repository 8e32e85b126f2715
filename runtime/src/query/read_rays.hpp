// Copies rays from the caller's arrays, in any layout, to the columns of a batch.
#pragma once

#include "nif/nif.h"
#include "query/work_area.hpp"

namespace nif::runtime {

/// Reads rays first .. first + count - 1, and their masks if they have any; count <= kBatchRays.
void read_rays(const NifRays& rays, uint64_t first, uint32_t count, WorkArea& area);

}  // namespace nif::runtime
