// Answering batches of rays.
#pragma once

#include "scene.hpp"

namespace nif::runtime {

/// Throws Failure where the description is wrong; otherwise fills the outputs. Allocates nothing.
void run_query(const NifSceneObject& scene, const NifQuery& query);

}  // namespace nif::runtime
