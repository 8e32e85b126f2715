// Checks of queries as the caller describes them.
#pragma once

#include "scene/scene.hpp"

namespace nif::runtime {

/// What a thread needs to answer a query of `count` rays.
uint64_t scratch_bytes(uint64_t count);

/// Whether the device's GPU answers it; the CPU answers queries of host memory where that cannot.
bool answered_by_gpu(const NifSceneObject& scene, const NifRays& rays);

/// Throws Failure where the description is wrong, or the scene not ready.
void check_query(const NifSceneObject& scene, const NifRays& rays, const NifAnswers& answers);
/// The same of a query that lists what stays open.
void check_open_query(const NifSceneObject& scene, const NifRays& rays, const NifOpenRays& open);
/// The same of a query for first hits.
void check_hit_query(const NifSceneObject& scene, const NifRays& rays, const NifHits& hits);
/// The same of the scratch, which the CPU works in.
void check_scratch(const NifRays& rays);

}  // namespace nif::runtime
