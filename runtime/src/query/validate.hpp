// Checks the caller's description of a query, so that the code behind it can rely on it.
#pragma once

#include "query/request.hpp"
#include "scene/scene.hpp"

namespace nif::runtime {

/// Bytes of scratch that a thread needs to answer a query of `count` rays.
uint64_t scratch_bytes(uint64_t count);

/// Does the device's GPU answer the query? If it cannot, the CPU answers queries in host memory.
bool answered_by_gpu(const NifSceneObject& scene, const NifRays& rays);

/// Throws Failure if the description is wrong, or the scene is not ready.
void check_query(const NifSceneObject& scene, const NifRays& rays, const NifAnswers& answers);
/// The same for a query that lists open rays.
void check_open_query(const NifSceneObject& scene, const NifRays& rays, const NifOpenRays& open);
/// The same for a query for first hits.
void check_hit_query(const NifSceneObject& scene, const NifRays& rays, const NifHits& hits);
/// The same for what only the CPU uses: the scratch, and arrays that must be host memory.
void check_on_cpu(const NifSceneObject& scene, const Request& request);

}  // namespace nif::runtime
