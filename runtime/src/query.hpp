// Queries as the caller describes them.
#pragma once

#include "scene.hpp"

namespace nif::runtime {

/// What a thread needs to answer a query of `count` rays.
uint64_t scratch_bytes(uint64_t count);

/// Throws Failure where the description is wrong, or the scene not ready.
void check_query(const NifSceneObject& scene, const NifQuery& query);

}  // namespace nif::runtime
