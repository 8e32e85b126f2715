// Answers of a batch to the caller's arrays.
#pragma once

#include "nif/nif.h"
#include "query/work_area.hpp"
#include "scene/scene.hpp"

namespace nif::runtime {

/// Adds the rays of the batch that are not certain to the caller's lists, and lets their answers say that
/// they are open. `first`: the batch's first ray in the query. Threads may do so at the same time.
void list_open_rays(const NifOpenRays& lists, uint64_t first, WorkArea& area);

/// Writes the area's answers to each output that is asked for. first is a multiple of 8.
void write_answers(const NifAnswers& answers, uint64_t first, uint32_t count, WorkArea& area);

/// Writes the first hits of rays first, first + 1, ... to the outputs that are asked for.
void write_hits(const NifSceneObject& scene, const NifHits& hits, uint64_t first, WorkArea& area);

}  // namespace nif::runtime
