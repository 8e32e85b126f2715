// Takes rays down the hierarchy, several by turns; transforms them to object space; and sorts pairs of ray and instance by
// object: by a radix sort, byte by byte, which allocates nothing; few by insertion.
#include "query/rounds.hpp"

#include "query/streams.hpp"

namespace nif::runtime {
namespace {

/// The order in which a ray visits the children of nodes.
struct Order {
  bool nearest = false;
  uint32_t signs = 0;  ///< of the ray's direction, bit `axis` if negative

  uint32_t child_at(const Node& node, uint32_t place) const {
    return nearest ? node.near_first[signs] >> 2 * place & 3 : place;
  }
  /// Of children as bits.
  uint32_t places_of(const Node& node, uint32_t children) const {
    if (!nearest) return children;
    uint32_t places = 0;
    for (uint32_t place = 0; place < kWidth; ++place)
      places |= (children >> child_at(node, place) & 1) << place;
    return places;
  }
};
Order order_of(Goal goal, const WorkArea& area, uint32_t ray) {
  Order order{kNearFirst && goal == Goal::nearest};
  for (uint32_t a = 0; a < 3; ++a) order.signs |= uint32_t(area.inverse[a][ray] < 0) << a;
  return order;
}

/// So few pairs are sorted faster by insertion than by a radix sort, which goes through all values of a byte.
[[maybe_unused]] constexpr uint32_t kFewToSort = 24;

/// Rays that advance by turns: the next node of each is fetched meanwhile.
constexpr uint32_t kWalkers = 8;
struct Walker {
  void start(Goal goal, const WorkArea& area, uint32_t i) {
    ray = TraversalRay(area, i);
    number = i;
    order = order_of(goal, area, i);
    if (goal == Goal::nearest) ray.tmax = all_of(kernels::min_of(area.hits.high[i], area.rays.tmax[i]));
  }

  TraversalRay ray;
  uint32_t number;  ///< the ray's
  Order order;
  bool at_node = false;
};

/// Of what next_child() returns: neither a node nor kNoBox.
bool is_instance(uint32_t child) { return (child & kLeaf) != 0 && child != kNoBox; }

}  // namespace

using kernels::Segment;
using kernels::segment_of;
using kernels::SegmentBatch;
using kernels::set_segment;

void transform_batch(const Instance& instance, const SegmentBatch& __restrict from,
                     SegmentBatch& __restrict to) {
  const kernels::WorldToObject transform = instance.to_object;
  const uint32_t count = to.count = from.count;
  for (uint32_t i = 0; i < count; ++i) set_segment(to, i, to_object(transform, segment_of(from, i)));
}

uint32_t find_unproven(const NifSceneObject& scene, const SegmentBatch& local, WorkArea& area) {
  const Instance& instance = scene.instances[scene.sole];
  const float reach_scale = scene.objects[instance.object].reach_scale;
#ifndef __wasm__  // where code size matters
  if (instance.identity && !instance.unproven) return 0;
  if (const kernels::cpu::StreamFunctions* const streams = scene.device->streams)
    return streams->find_unproven(area.rays, nullptr, local, instance, reach_scale, area.entries);
#endif
  uint32_t count = 0;
  for (uint32_t i = 0; i < area.rays.count; ++i) {
    if (!stays_certain(instance, reach_scale, segment_of(area.rays, i), segment_of(local, i)))
      area.entries[count++] = i;
  }
  return count;
}

uint32_t find_excluded(const NifSceneObject& scene, WorkArea& area) {
  uint32_t count = 0;
  for (uint32_t i = 0; i < area.rays.count; ++i) {
    if (scene.instances[scene.sole].mask & area.mask[i]) continue;
    const Segment ray = segment_of(area.rays, i);
    kernels::BoxRay prepared;
    area.misses[i] = (kernels::prepare_box_ray(ray, prepared) || ray.tmin > ray.tmax) && !scene.unproven;
    area.entries[count++] = i;
  }
  return count;
}

void bring_to_object(const NifSceneObject& scene, const Pair* pairs, uint32_t count, WorkArea& area) {
  area.object_rays.count = count;
  for (uint32_t k = 0; k < count; ++k) {
    if (k + kFetchedAhead < count) fetch(scene.instances[pairs[k + kFetchedAhead].instance]);
    const Instance& instance = scene.instances[pairs[k].instance];
    const Segment ray = segment_of(area.rays, pairs[k].ray);
    set_segment(area.object_rays, k, instance.identity ? ray : to_object(instance.to_object, ray));
  }
}

uint32_t start_rays(const NifSceneObject& scene, Goal goal, WorkArea& area) {
  const std::span<const Node> nodes = scene.hierarchy.nodes();
  uint32_t active = 0;
  const auto start = [&](uint32_t i) {
    const uint32_t met = may_meet(nodes[0], TraversalRay(area, i));
    area.cursors[i] = {order_of(goal, area, i).places_of(nodes[0], met), 0};
    if (met != 0) area.active[active++] = uint16_t(i);
  };
#ifndef __wasm__  // where code size matters
  if (scene.device->streams) {
    start_stream(scene, false, area);
    const kernels::cpu::RayStream& stream = area.streams[0];
    for (uint32_t k = 0; k < stream.count && !nodes.empty(); ++k) {
      for (int a = 0; a < 3; ++a) area.inverse[a][stream.ray[k]] = stream.inverse[a][k];
      start(stream.ray[k]);
    }
    return active;
  }
#endif
  for (uint32_t i = 0; i < area.rays.count; ++i) {
    const Segment ray = segment_of(area.rays, i);
    kernels::BoxRay prepared;
    const bool askable = kernels::prepare_box_ray(ray, prepared);
    area.misses[i] = (askable || ray.tmin > ray.tmax) && !scene.unproven;
    if (!askable || nodes.empty()) continue;
    for (int a = 0; a < 3; ++a) area.inverse[a][i] = prepared.inverse[a];
    start(i);
  }
  return active;
}

uint32_t advance(const NifSceneObject& scene, bool masked, Goal goal, WorkArea& area, uint32_t active) {
  const Node* nodes = scene.hierarchy.nodes().data();
  Walker walkers[kWalkers];
  uint32_t pairs = 0, started = 0, walking;
  do {
    walking = 0;
    for (Walker& walker : walkers) {
      if (walker.at_node) {
        Cursor& cursor = area.cursors[walker.number];
        const Node& node = nodes[cursor.node];
        cursor.trail = cursor.trail << 4 | walker.order.places_of(node, may_meet(node, walker.ray));
      } else if (started < active) {
        walker.start(goal, area, area.active[started++]);
      } else {
        continue;
      }
      const uint32_t i = walker.number;
      uint32_t child;
      do child = kernels::next_child(nodes, area.cursors[i], walker.order);
      while (masked && is_instance(child) && !(scene.instances[child & ~kLeaf].mask & area.mask[i]));
      walker.at_node = !(child & kLeaf);
      if (walker.at_node) {
        fetch(nodes[child]);
        ++walking;
      } else if (is_instance(child)) {
        fetch(scene.instances[child & ~kLeaf]);
        area.active[pairs] = uint16_t(i);
        area.pairs[0][pairs++] = {0, child & ~kLeaf, i};
      }
    }
  } while (walking > 0 || started < active);
  for (uint32_t k = 0; k < pairs; ++k)
    area.pairs[0][k].object = scene.instances[area.pairs[0][k].instance].object;
  return pairs;
}

uint32_t parts_of_call(const NifSceneObject& scene, const Pair* pairs, uint32_t begin, uint32_t count,
                       WorkArea& area) {
  const uint32_t kind = scene.objects[pairs[begin].object].kernel->kind();
  uint32_t end = begin;
  for (uint32_t part = 0; end < count; ++part) {
    const uint32_t object = pairs[end].object;
    const kernels::ObjectKernel* const kernel = scene.objects[object].kernel;
    if (part > 0 && (kind == 0 || kernel->kind() != kind)) break;
    while (end < count && pairs[end].object == object) ++end;
    area.parts[part] = {kernel, end - begin};
  }
  return end;
}

const Pair* sort_by_object(const NifSceneObject& scene, WorkArea& area, uint32_t count) {
#ifndef __wasm__  // where code size matters
  if (count <= kFewToSort) {
    Pair* const pairs = area.pairs[0];
    for (uint32_t k = 1; k < count; ++k) {
      const Pair pair = pairs[k];
      uint32_t to = k;
      for (; to > 0 && pairs[to - 1].object > pair.object; --to) pairs[to] = pairs[to - 1];
      pairs[to] = pair;
    }
    return pairs;
  }
#endif
  uint32_t now = 0;
  for (uint32_t shift = 0; shift < 32 && (scene.objects.size() - 1) >> shift != 0; shift += 8, now ^= 1) {
    uint32_t begins[257] = {};
    const Pair* from = area.pairs[now];
    for (uint32_t k = 0; k < count; ++k) ++begins[(from[k].object >> shift & 255) + 1];
    for (uint32_t b = 1; b < 257; ++b) begins[b] += begins[b - 1];
    Pair* to = area.pairs[now ^ 1];
    for (uint32_t k = 0; k < count; ++k) to[begins[from[k].object >> shift & 255]++] = from[k];
  }
  return area.pairs[now];
}

}  // namespace nif::runtime
