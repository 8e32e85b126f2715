// Writes the answers of a batch to the caller's arrays.
#pragma once

#include "nif/nif.h"
#include "query/work_area.hpp"
#include "scene/scene.hpp"

namespace nif::runtime {

/// Adds the uncertain rays of the batch to the caller's lists, and sets their answers to "open". `first`: the
/// batch's first ray in the query. Threads may call it at the same time.
void list_open_rays(const NifOpenRays& lists, uint64_t first, WorkArea& area);

/// Writes the area's answers to each output that is asked for. first is a multiple of 8.
void write_answers(const NifAnswers& answers, uint64_t first, uint32_t count, WorkArea& area);

/// Writes the first hits of rays first, first + 1, ... to the outputs that are asked for.
void write_hits(const NifSceneObject& scene, const NifHits& hits, uint64_t first, WorkArea& area);

}  // namespace nif::runtime
