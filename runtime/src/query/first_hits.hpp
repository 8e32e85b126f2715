// Finds first hits in a scene, one batch at a time.
#pragma once

#include "query/work_area.hpp"
#include "scene/scene.hpp"

namespace nif::runtime {

/// Finds the first hits of area.rays (with area.mask if `masked`) and puts them in area.hits. Normals of hits
/// are in world space if `normals` is set, and undefined otherwise.
void intersect_batch(const NifSceneObject& scene, bool masked, bool normals, WorkArea& area);

}  // namespace nif::runtime
