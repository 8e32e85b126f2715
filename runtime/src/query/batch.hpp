// The unit of work that threads of a query share: one batch of rays, from the caller's arrays and back.
#pragma once

#include "query/request.hpp"
#include "query/work_area.hpp"
#include "scene/scene.hpp"

namespace nif::runtime {

/// Reads, answers and writes batch number `batch`. Threads may answer different batches at the same time.
void answer_batch_of(const NifSceneObject& scene, const Request& request, uint64_t batch, WorkArea& area);

}  // namespace nif::runtime
