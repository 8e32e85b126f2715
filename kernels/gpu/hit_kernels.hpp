// First hits (nifIntersect): a thread takes its ray through the top level, queries each object that it may
// meet for its first hit, combines these, and writes the requested outputs. It takes the same steps as
// runtime/src/query/first_hits.cpp does on the CPU, with the same bits.
#pragma once

#include "kernels/gpu/scene_kernels.hpp"
#include "kernels/reference/scene_hit.hpp"

namespace nif::kernels::gpu {

/// The outputs of NifHits (runtime/include/nif/nif.h): device memory of any alignment; any may be null.
struct HitOutputs {
  unsigned char *hit, *certain;
  unsigned char *t, *t_low, *t_high, *normal, *u, *v;
  unsigned char *instance, *object, *triangle;
  unsigned char *color, *user;
};

/// Arguments of the kernel. Only the rays of the query are used.
struct HitWork {
  SceneArrays scene;
  SceneQuery query;
  HitOutputs hits;
};

/// The first hit with one object, for a ray in its space.
template <uint32_t kKinds, class Thread, class Encoding, class... Others>
NIF_HOST_DEVICE NIF_INLINE Hit intersect_one_of(EncodingList<Encoding, Others...>, const Thread& thread,
                                                const SceneObject& object, const Segment& ray, float limit,
                                                uint32_t* row) {
  if constexpr (kKindsOfAll<Others...> != 0)
    if ((object.kind & kKindsOf<Encoding>) == 0)
      return intersect_one_of<kKinds>(EncodingList<Others...>(), thread, object, ray, limit, row);
  constexpr uint32_t kFirst = kFirstKindBit<Encoding>;
  return Encoding::template intersect<((kKinds & kKindsOf<Encoding>) >> kFirst)>(
      thread, object, object.kind >> kFirst, ray, limit, row);
}

/// The first hit with a scene, for a ray in world space. Skips whatever begins beyond a proven hit.
template <uint32_t kKinds, class Thread>
NIF_HOST_DEVICE NIF_LONG_INLINE SceneHit intersect_scene(const Thread& thread, const SceneArrays& scene,
                                                         const Segment& ray, const SceneQuery& query,
                                                         uint32_t i, uint32_t* row) {
  SceneHit nearest;
  BoxRay prepared;
  const bool askable = prepare_box_ray(ray, prepared),
             alone = scene.instance_count == 1 && lets_in(scene, query, i, scene.sole);
  if ((!askable && !(ray.tmin > ray.tmax)) || scene.unproven) forget_proof(nearest);
  Cursor cursor{0, 0};
  if (!alone) {
    if (!askable || scene.instance_count == 0) return nearest;
    cursor.trail = children_met(scene.nodes[0], ray, prepared);
  }
  // A sole instance is queried whether or not its box is met, and even for invalid rays. It shares the call
  // with the others, because all of the objects' code is inlined there.
  for (;;) {
    uint32_t number = scene.sole;
    if (!alone) {
      number = next_instance(scene.nodes, cursor, [&](const TopNode& node) {
        Segment shortened = ray;
        shortened.tmax = min_of(nearest.high, ray.tmax);
        return children_met(node, shortened, prepared);
      });
      if (number == kNoBox) return nearest;
      if (!lets_in(scene, query, i, number)) continue;
    }
    const PlacedInstance& instance = scene.instances[number];
    const SceneObject& object = scene.objects[instance.object];
    const Segment local = instance.identity ? ray : to_object(instance.to_object, ray);
    Hit hit =
        intersect_one_of<kKinds>(Encodings(), thread, object, local, alone ? kNoHit : nearest.high, row);
    if (!stays_certain(instance, object.reach_scale, ray, local)) forget_proof(hit);
    if (alone) {
      static_cast<Hit&>(nearest) = hit;
      nearest.instance = hit.t < kNoHit ? number : kNoInstance;
      return nearest;
    }
    const WorldBox box = box_of_child(scene.nodes[instance.place / kTopWidth], instance.place % kTopWidth);
    begin_in_box(hit, pass_box(box, ray, prepared).enter);
    nearest.add(hit, number);
  }
}

/// Writes the outputs of one ray; nothing else writes them.
NIF_HOST_DEVICE inline void store_hit(const SceneArrays& scene, const HitOutputs& to, uint32_t ray,
                                      const Segment& segment, const SceneHit& found) {
  const bool hit = found.t < kNoHit;
  const auto store = [&](unsigned char* array, uint32_t word) {
    if (array) store_unaligned(array + uint64_t(ray) * 4, word);
  };
  if (to.hit) to.hit[ray] = hit;
  if (to.certain) to.certain[ray] = found.certain();
  store(to.t, bits_as<uint32_t>(found.t));
  store(to.t_low, bits_as<uint32_t>(found.low));
  store(to.t_high, bits_as<uint32_t>(found.high));
  store(to.u, bits_as<uint32_t>(found.u));
  store(to.v, bits_as<uint32_t>(found.v));
  store(to.instance, found.instance);
  if (to.user) {
    const uint64_t user = hit && scene.users ? scene.users[found.instance] : 0;
    store_unaligned(to.user + uint64_t(ray) * 8, uint32_t(user));
    store_unaligned(to.user + uint64_t(ray) * 8 + 4, uint32_t(user >> 32));
  }
  if (!to.object && !to.normal && !to.triangle && !to.color) return;
  uint32_t number = kNoInstance, triangle = kNoTriangle;
  float normal[3] = {0, 0, 0}, color[3] = {0, 0, 0};
  if (hit) {
    const PlacedInstance& instance = scene.instances[found.instance];
    const SceneObject& object = scene.objects[instance.object];
    number = object.number;
    if (to.triangle) triangle = source_triangle(object.details.source_triangles, found.triangle);
    if (to.normal)
      world_normal(instance.identity ? nullptr : &instance.to_object, found.normal, segment.direction,
                   normal);
    if (to.color)
      color_at(object.details.colors, instance.identity ? segment : to_object(instance.to_object, segment),
               found.t, color);
  }
  store(to.object, number);
  store(to.triangle, triangle);
  NIF_UNROLL
  for (uint32_t a = 0; a < 3; ++a) {
    const uint64_t at = (uint64_t(ray) * 3 + a) * 4;
    if (to.normal) store_unaligned(to.normal + at, bits_as<uint32_t>(normal[a]));
    if (to.color) store_unaligned(to.color + at, bits_as<uint32_t>(color[a]));
  }
}

/// Any number of blocks of kSceneThreads; scene.layout.bytes of shared memory.
template <uint32_t kKinds, class Thread>
NIF_HOST_DEVICE NIF_LONG_INLINE void scene_hits(const Thread& thread, const HitWork& work) {
  const SceneArrays& scene = work.scene;
  const uint32_t rays = scene.layout.rays, step = thread.blocks() * rays;
  if (thread.index() >= rays) return;
  uint32_t* const row = reinterpret_cast<uint32_t*>(thread.shared()) + thread.index() * scene.layout.row;
  for (uint32_t first = thread.block() * rays; first < work.query.count;) {
    const uint32_t left = work.query.count - first;
    if (thread.index() < left) {
      const uint32_t i = first + thread.index();
      const Segment ray = load_ray(work.query, i);
      store_hit(scene, work.hits, i, ray, intersect_scene<kKinds>(thread, scene, ray, work.query, i, row));
    }
    if (left <= step) return;  // first + step may be more than 32 bits
    first += step;
  }
}

}  // namespace nif::kernels::gpu
