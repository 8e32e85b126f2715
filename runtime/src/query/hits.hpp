// First hits of a batch, in a scene.
#pragma once

#include "nif/nif.h"
#include "query/work_area.hpp"
#include "scene/scene.hpp"

namespace nif::runtime {

/// Calls visit(array) for each output, whose entries are one for each ray, but for `normal` and `color`.
template <class Visit>
void visit_hit_outputs(const NifHits& hits, const Visit& visit) {
  visit(hits.hit), visit(hits.certain);
  visit(hits.t), visit(hits.t_low), visit(hits.t_high), visit(hits.normal), visit(hits.u), visit(hits.v);
  visit(hits.instance), visit(hits.object), visit(hits.triangle), visit(hits.color);
}

/// Finds the first hits of area.rays: area.hits. Where there is one, its normal is in world space if
/// `normals`, and else means nothing.
void intersect_batch(const NifSceneObject& scene, bool normals, WorkArea& area);

/// Writes those of rays first, first + 1, ... to the outputs that are asked for.
void write_hits(const NifSceneObject& scene, const NifHits& hits, uint64_t first, WorkArea& area);

}  // namespace nif::runtime
