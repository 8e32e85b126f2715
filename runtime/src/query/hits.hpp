// First hits of a batch, in a scene.
#pragma once

#include "nif/nif.h"
#include "query/work_area.hpp"
#include "scene/scene.hpp"

namespace nif::runtime {

/// Finds the first hits of area.rays, with area.mask if `masked`: area.hits. Where there is one, its normal is
/// in world space if `normals`, and else means nothing.
void intersect_batch(const NifSceneObject& scene, bool masked, bool normals, WorkArea& area);

/// Writes those of rays first, first + 1, ... to the outputs that are asked for.
void write_hits(const NifSceneObject& scene, const NifHits& hits, uint64_t first, WorkArea& area);

}  // namespace nif::runtime
