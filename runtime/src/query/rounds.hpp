// Answers a batch of rays in a scene of several instances, in rounds. In each round, every undecided ray
// advances to the next instance whose box it may meet; the rays are sorted by object, and each object's
// kernel gets its rays at once.
#pragma once

#include "kernels/reference/batch.hpp"
#include "kernels/reference/instance.hpp"
#include "scene/scene.hpp"
#include "scene/traversal.hpp"

namespace nif::runtime {

/// Transforms the whole batch to one instance's object space.
void transform_batch(const Instance& instance, const kernels::SegmentBatch& __restrict from,
                     kernels::SegmentBatch& __restrict to);

/// Transforms the rays of some pairs, all of one object, to its space: area.object_rays.
void bring_to_object(const NifSceneObject& scene, const Pair* pairs, uint32_t count, WorkArea& area);

/// Sorts pairs by object, by as many bytes of the object's index as the scene needs, and returns them.
const Pair* sort_by_object(const NifSceneObject& scene, WorkArea& area, uint32_t count);

/// Starts each ray at the root. Puts the rays that may meet something in area.active, and returns their
/// number. Sets area.misses.
uint32_t start_rays(const NifSceneObject& scene, WorkArea& area);

/// Calls exclude(ray, certain) for each ray whose mask does not match the sole instance's: it sees an empty
/// scene. certain: as area.misses.
template <class Exclude>
void exclude_by_mask(const NifSceneObject& scene, const WorkArea& area, const Exclude& exclude) {
  for (uint32_t i = 0; i < area.rays.count; ++i) {
    if (scene.instances[scene.sole].mask & area.mask[i]) continue;
    const kernels::Segment ray = kernels::segment_of(area.rays, i);
    kernels::BoxRay prepared;
    exclude(i, (kernels::prepare_box_ray(ray, prepared) || ray.tmin > ray.tmax) && !scene.unproven);
  }
}

/// Advances each active ray to its next instance with a matching mask; rays without one are no longer active.
/// Returns how many are active.
template <class RayOf>
uint32_t advance(const NifSceneObject& scene, bool masked, WorkArea& area, uint32_t active,
                 const RayOf& ray_of) {
  const Node* nodes = scene.hierarchy.nodes().data();
  uint32_t pairs = 0;
  for (uint32_t k = 0; k < active; ++k) {
    const uint32_t i = area.active[k];
    const auto ray = ray_of(i);
    uint32_t instance = next_instance(nodes, ray, area.cursors[i]);
    while (masked && instance != kernels::kNoBox && !(scene.instances[instance].mask & area.mask[i]))
      instance = next_instance(nodes, ray, area.cursors[i]);
    if (instance == kernels::kNoBox) continue;
    area.active[pairs] = uint16_t(i);
    area.pairs[0][pairs++] = {scene.instances[instance].object, instance, i};
  }
  return pairs;
}

/// Runs all rounds. `ray_of(ray)` returns the ray for box tests; `ask(pairs, count)` queries one object. A
/// ray drops out once its cursor has no trail.
template <class RayOf, class Ask>
void go_in_rounds(const NifSceneObject& scene, bool masked, WorkArea& area, uint32_t active,
                  const RayOf& ray_of, const Ask& ask) {
  while ((active = advance(scene, masked, area, active, ray_of)) != 0) {
    const Pair* pairs = sort_by_object(scene, area, active);
    for (uint32_t begin = 0, end; begin < active; begin = end) {
      for (end = begin + 1; end < active && pairs[end].object == pairs[begin].object; ++end) continue;
      ask(pairs + begin, end - begin);
    }
  }
}

}  // namespace nif::runtime
