// Answering one batch of rays.
#pragma once

#include "query/batch.hpp"
#include "scene/scene.hpp"

namespace nif::runtime {

/// From area.rays, and area.mask if `masked`, to area.answers, and area.probability where wanted. The answer to
/// a ray does not depend on the other rays of the batch, nor on what else is wanted.
void answer_batch(const NifSceneObject& scene, bool masked, const Wanted& wanted, WorkArea& area);

}  // namespace nif::runtime
