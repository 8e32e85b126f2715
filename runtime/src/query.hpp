// Answering batches of rays.
#pragma once

#include "scene.hpp"

namespace nif::runtime {

/// What a thread needs to answer a query of `count` rays.
uint64_t scratch_bytes(uint64_t count);

/// Throws Failure where the description is wrong; otherwise fills the outputs. Allocates nothing.
void run_query(const NifSceneObject& scene, const NifQuery& query);

}  // namespace nif::runtime
