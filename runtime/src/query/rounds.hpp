// Answers a batch of rays in a scene of several instances, in rounds. In each round, every undecided ray
// advances to the next instance whose box it may meet; the rays are sorted by object, and a kernel gets an
// object's rays at once, or those of several objects of its kind.
#pragma once

#include "kernels/reference/batch.hpp"
#include "kernels/reference/instance.hpp"
#include "scene/scene.hpp"
#include "scene/traversal.hpp"

namespace nif::runtime {

/// Transforms the whole batch to one instance's object space.
void transform_batch(const Instance& instance, const kernels::SegmentBatch& __restrict from,
                     kernels::SegmentBatch& __restrict to);

/// Finds the rays of the batch whose proofs about the sole instance's object, where they are `local`, do not hold in the world:
/// area.entries receives their numbers. Returns how many there are.
uint32_t find_unproven(const NifSceneObject& scene, const kernels::SegmentBatch& local, WorkArea& area);

/// Finds the rays of the batch whose masks do not match the sole instance's, which see an empty scene: area.entries receives their
/// numbers. Sets their area.misses. Returns how many there are.
uint32_t find_excluded(const NifSceneObject& scene, WorkArea& area);

/// Transforms the rays of some pairs to their objects' space: area.object_rays.
void bring_to_object(const NifSceneObject& scene, const Pair* pairs, uint32_t count, WorkArea& area);

/// Sorts pairs by object, by as many bytes of the object's index as the scene needs, and returns them.
const Pair* sort_by_object(const NifSceneObject& scene, WorkArea& area, uint32_t count);

/// Fetches what will be needed soon into the cache. WebAssembly cannot.
template <class T>
void fetch([[maybe_unused]] const T& what) {
#ifndef __wasm__
  const char* const at = reinterpret_cast<const char*>(&what);
  __builtin_prefetch(at);
  __builtin_prefetch(at + sizeof(T) - 1);
#endif
}
/// So many pairs before it is needed.
constexpr uint32_t kFetchedAhead = 8;

/// What a query looks for: anything in the way, or the nearest. Says which instances a ray is asked about first.
enum class Goal { any, nearest };

/// Starts each ray at the root. Puts the rays that may meet something in area.active, and returns their
/// number. Sets area.misses.
uint32_t start_rays(const NifSceneObject& scene, Goal goal, WorkArea& area);

/// Advances each active ray to its next instance with a matching mask; rays without one are no longer active. Those whose
/// nearest hit is looked for go no farther than area.hits say that it is. Returns how many are active.
uint32_t advance(const NifSceneObject& scene, bool masked, Goal goal, WorkArea& area, uint32_t active);

/// The pairs that one call of a kernel answers, from `begin` on: those of an object, and of the next ones if their kernels
/// are of the same kind. Sets area.parts. Returns where they end.
uint32_t parts_of_call(const NifSceneObject& scene, const Pair* pairs, uint32_t begin, uint32_t count,
                       WorkArea& area);

/// Runs all rounds. `ask(pairs, count)` queries the objects of area.parts. A ray drops out once its cursor has no trail.
template <class Ask>
void go_in_rounds(const NifSceneObject& scene, bool masked, Goal goal, WorkArea& area, uint32_t active,
                  const Ask& ask) {
  while ((active = advance(scene, masked, goal, area, active)) != 0) {
    const Pair* pairs = sort_by_object(scene, area, active);
    for (uint32_t begin = 0, end; begin < active; begin = end) {
      end = parts_of_call(scene, pairs, begin, active, area);
      ask(pairs + begin, end - begin);
    }
  }
}

}  // namespace nif::runtime
