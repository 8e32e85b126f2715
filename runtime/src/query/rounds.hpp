// Answers a batch of rays in a scene of several instances, in rounds. In each round, every undecided ray
// advances to the next instance whose box it may meet; the rays are sorted by object, and a kernel gets an
// object's rays at once, or those of several objects of its kind.
#pragma once

#include <cmath>

#include "kernels/reference/batch.hpp"
#include "kernels/reference/instance.hpp"
#include "scene/scene.hpp"
#include "scene/traversal.hpp"

namespace nif::runtime {

/// Transforms the whole batch to one instance's object space.
void transform_batch(const Instance& instance, const kernels::SegmentBatch& __restrict from,
                     kernels::SegmentBatch& __restrict to);

/// Transforms the rays of some pairs to their objects' space: area.object_rays.
void bring_to_object(const NifSceneObject& scene, const Pair* pairs, uint32_t count, WorkArea& area);

/// Sorts pairs by object, by as many bytes of the object's index as the scene needs, and returns them.
const Pair* sort_by_object(const NifSceneObject& scene, WorkArea& area, uint32_t count);

/// Which instances a query asks a ray about first. By large boxes, or by near ones.
inline kernels::LargeFirst large_first(const WorkArea&, uint32_t) { return {}; }
inline kernels::NearFirst near_first(const WorkArea& area, uint32_t ray) {
  uint32_t signs = 0;
  for (uint32_t a = 0; a < 3; ++a) signs |= uint32_t(std::signbit(area.inverse[a][ray])) << a;
  return {signs};
}

/// Fetches what will be needed soon into the cache.
template <class T>
void fetch(const T& what) {
  const char* const at = reinterpret_cast<const char*>(&what);
  __builtin_prefetch(at);
  __builtin_prefetch(at + sizeof(T) - 1);
}

/// Starts each ray at the root. Puts the rays that may meet something in area.active, and returns their
/// number. Sets area.misses.
template <class OrderOf>
uint32_t start_rays(const NifSceneObject& scene, WorkArea& area, const OrderOf& order_of) {
  const std::span<const Node> nodes = scene.hierarchy.nodes();
  uint32_t active = 0;
  for (uint32_t i = 0; i < area.rays.count; ++i) {
    const kernels::Segment ray = kernels::segment_of(area.rays, i);
    kernels::BoxRay prepared;
    const bool askable = kernels::prepare_box_ray(ray, prepared);
    area.misses[i] = (askable || ray.tmin > ray.tmax) && !scene.unproven;
    if (!askable || nodes.empty()) continue;
    for (int a = 0; a < 3; ++a) area.inverse[a][i] = prepared.inverse[a];
    area.cursors[i] = start(nodes.data(), TraversalRay(area, i), order_of(area, i));
    if (area.cursors[i].trail != 0) area.active[active++] = uint16_t(i);
  }
  return active;
}

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

/// So many pairs before it is used.
constexpr uint32_t kFetchedAhead = 8;

/// Rays that advance by turns: the next node of each is fetched meanwhile.
constexpr uint32_t kWalkers = 8;
template <class Order>
struct Walker {
  TraversalRay ray;
  Order order;
  uint32_t number;  ///< the ray's
};

/// Advances each active ray to its next instance with a matching mask; rays without one are no longer active.
/// Returns how many are active.
template <class RayOf, class OrderOf>
uint32_t advance(const NifSceneObject& scene, bool masked, WorkArea& area, uint32_t active,
                 const RayOf& ray_of, const OrderOf& order_of) {
  using Order = decltype(order_of(area, 0));
  const Node* nodes = scene.hierarchy.nodes().data();
  uint32_t pairs = 0, started = 0;
  // Goes on with a ray up to the next node, which it fetches, or an instance. Returns false if that was the last.
  const auto go_on = [&](const Walker<Order>& walker) {
    const uint32_t i = walker.number;
    Cursor& cursor = area.cursors[i];
    while (true) {
      const uint32_t child = kernels::next_child(nodes, cursor, walker.order);
      if (child == kernels::kNoBox) return false;
      if (!(child & kLeaf)) {
        fetch(nodes[child]);
        return true;
      }
      const uint32_t instance = child & ~kLeaf;
      if (masked && !(scene.instances[instance].mask & area.mask[i])) continue;
      fetch(scene.instances[instance]);
      area.active[pairs] = uint16_t(i);
      area.pairs[0][pairs++] = {0, instance, i};
      return false;
    }
  };
  Walker<Order> walkers[kWalkers];
  uint32_t walking = 0;
  const auto start = [&](Walker<Order>& walker) {
    while (started < active) {
      const uint32_t i = area.active[started++];
      walker = {ray_of(i), order_of(area, i), i};
      if (go_on(walker)) return true;
    }
    return false;
  };
  while (walking < kWalkers && start(walkers[walking])) ++walking;
  while (walking > 0) {
    for (uint32_t w = 0; w < walking;) {
      Walker<Order>& walker = walkers[w];
      Cursor& cursor = area.cursors[walker.number];
      const Node& node = nodes[cursor.node];
      cursor.trail = cursor.trail << 4 | walker.order.places_of(node, may_meet(node, walker.ray));
      if (go_on(walker) || start(walker))
        ++w;
      else
        walker = walkers[--walking];
    }
  }
  for (uint32_t k = 0; k < pairs; ++k)
    area.pairs[0][k].object = scene.instances[area.pairs[0][k].instance].object;
  return pairs;
}

/// The pairs that one call of a kernel answers, from `begin` on: those of an object, and of the next ones if their kernels
/// are of the same kind. Sets area.parts. Returns where they end.
uint32_t parts_of_call(const NifSceneObject& scene, const Pair* pairs, uint32_t begin, uint32_t count,
                       WorkArea& area);

/// Runs all rounds. `ray_of(ray)` returns the ray for box tests, order_of(area, ray) as start_rays() had it; `ask(pairs, count)` queries the objects of area.parts. A
/// ray drops out once its cursor has no trail.
template <class RayOf, class OrderOf, class Ask>
void go_in_rounds(const NifSceneObject& scene, bool masked, WorkArea& area, uint32_t active,
                  const RayOf& ray_of, const OrderOf& order_of, const Ask& ask) {
  while ((active = advance(scene, masked, area, active, ray_of, order_of)) != 0) {
    const Pair* pairs = sort_by_object(scene, area, active);
    for (uint32_t begin = 0, end; begin < active; begin = end) {
      end = parts_of_call(scene, pairs, begin, active, area);
      ask(pairs + begin, end - begin);
    }
  }
}

}  // namespace nif::runtime
