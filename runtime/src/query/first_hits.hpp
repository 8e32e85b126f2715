// First hits of a batch, in a scene.
#pragma once

#include "query/work_area.hpp"
#include "scene/scene.hpp"

namespace nif::runtime {

/// Finds the first hits of area.rays, with area.mask if `masked`: area.hits. Where there is one, its normal is
/// in world space if `normals`, and else means nothing.
void intersect_batch(const NifSceneObject& scene, bool masked, bool normals, WorkArea& area);

}  // namespace nif::runtime
