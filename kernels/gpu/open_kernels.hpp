// Rays that proofs leave open (nifQueryOpen): a thread takes its ray through the top level and asks each
// object what it can prove; the lanes of a wave then reserve their places in the caller's lists together.
// Which rays are listed, and with which tmin and tmax, is exactly as runtime/src/query does it on the CPU.
#pragma once

#include "kernels/gpu/scene_kernels.hpp"
#include "kernels/reference/planes/open.hpp"
#include "kernels/reference/scene_hit.hpp"

namespace nif::kernels::gpu {

/// The lists of NifOpenRays (runtime/include/nif/nif.h): device memory of any alignment, except for the
/// count.
struct OpenLists {
  unsigned char *rays, *tmin, *tmax, *instance;  ///< all but rays may be null, and rays too if capacity is 0
  uint32_t* count;
  uint32_t capacity;
};

/// Arguments of the kernel.
struct OpenWork {
  SceneArrays scene;
  SceneQuery query;
  OpenLists lists;
  uint32_t first;  ///< number of the query's first ray in the lists
};

/// What one object proves about a ray in its space. Encodings without proofs of their own answer, and leave
/// the whole ray open if that answer is not certain.
template <uint32_t kKinds, class Thread, class Encoding, class... Others>
NIF_HOST_DEVICE NIF_INLINE ObjectAnswer prove_by_one_of(EncodingList<Encoding, Others...>,
                                                        const Thread& thread, const SceneObject& object,
                                                        const Segment& ray, uint32_t* row,
                                                        OpenInterval& open) {
  if constexpr (Encoding::kKinds != 0)
    if ((object.kind & kKindsOf<Encoding>) != 0) {
      if constexpr (Encoding::kProves) {
        return Encoding::prove(object, ray, open);
      } else {
        open = all_of(ray);
        constexpr uint32_t kFirst = kFirstKindBit<Encoding>;
        return Encoding::template ask<((kKinds & kKindsOf<Encoding>) >> kFirst)>(
            thread, object, object.kind >> kFirst, ray, row);
      }
    }
  if constexpr (sizeof...(Others) != 0)
    return prove_by_one_of<kKinds>(EncodingList<Others...>(), thread, object, ray, row, open);
  return {};
}

/// What one instance proves about a ray in world space.
template <uint32_t kKinds, class Thread>
NIF_HOST_DEVICE NIF_INLINE ObjectAnswer prove_instance(const Thread& thread, const SceneArrays& scene,
                                                       const PlacedInstance& instance, const Segment& ray,
                                                       uint32_t* row, OpenInterval& open) {
  const SceneObject& object = scene.objects[instance.object];
  const Segment local = instance.identity ? ray : to_object(instance.to_object, ray);
  ObjectAnswer answer = prove_by_one_of<kKinds>(Encodings(), thread, object, local, row, open);
  // If the instance's transform invalidates the proof, it also invalidates the bounds of the open part.
  if (!stays_certain(instance, object.reach_scale, ray, local)) {
    answer.certain = false;
    open = all_of(ray);
  }
  return answer;
}

/// What all instances prove about a ray: the outputs of the query, and in `open` the part that is left open,
/// if is_open.
struct ProvenRay {
  SceneAnswer answer;
  OpenInterval open;
  uint32_t instance;  ///< the one that leaves it open; kNoInstance if several do
  bool is_open;
};
template <uint32_t kKinds, class Thread>
NIF_HOST_DEVICE NIF_LONG_INLINE ProvenRay prove_scene(const Thread& thread, const SceneArrays& scene,
                                                      const Segment& ray, const SceneQuery& query,
                                                      uint32_t number, uint32_t* row) {
  const bool with_probability = query.probability;
  const auto meets = [&](uint32_t instance) { return lets_in(scene, query, number, instance); };
  ProvenRay proven;
  BoxRay prepared;
  SceneWay way;
  const bool has_way = start_way(scene, ray, prepared, way, proven.answer);
  const bool alone = scene.instance_count == 1 && meets(scene.sole);
  proven.instance = scene.sole;
  if (alone) {
    const PlacedInstance& instance = scene.instances[scene.sole];
    proven.answer = only_answer(prove_instance<kKinds>(thread, scene, instance, ray, row, proven.open),
                                scene.objects[instance.object].calibration, with_probability);
  } else if (has_way) {
    const float infinity = bits_as<float>(0x7f800000u);
    proven.open = {infinity, -infinity};
    if (scene.unproven) proven.open = all_of(ray);
    proven.instance = kNoInstance;
    const auto ask = [&](uint32_t instance, ObjectAnswer& answer) {
      OpenInterval open;
      answer = prove_instance<kKinds>(thread, scene, scene.instances[instance], ray, row, open);
      if (!answer.certain) {
        proven.instance = proven.open.begin <= proven.open.end ? kNoInstance : instance;
        // As on the CPU: 0 is added because the sign of a zero would depend on the order.
        proven.open.begin = min_of(open.begin, proven.open.begin) + 0.0f;
        proven.open.end = max_of(open.end, proven.open.end) + 0.0f;
      }
      return true;
    };
    follow_scene<true>(scene, ray, prepared, with_probability, way, meets, ask, proven.answer);
  }
  // A sole instance is queried even for rays that are invalid in the world, and may leave them open.
  proven.is_open = (has_way || proven.answer.logit < 0) && !proven.answer.certain;
  if (proven.is_open) {
    proven.answer.logit = kOpenLogit;
    proven.answer.probability = 0.5f;
  }
  return proven;
}

/// Any number of blocks of kSceneThreads; scene.layout.bytes of shared memory. *lists.count has been set.
template <uint32_t kKinds, class Thread>
NIF_HOST_DEVICE NIF_LONG_INLINE void scene_open(const Thread& thread, const OpenWork& work) {
  const SceneArrays& scene = work.scene;
  const SceneQuery& query = work.query;
  const OpenLists& lists = work.lists;
  uint32_t* const row = reinterpret_cast<uint32_t*>(thread.shared()) + thread.index() * scene.layout.row;
  const uint32_t rays = scene.layout.rays, step = thread.blocks() * rays;
  // All threads loop together, because the lanes of a wave vote for bits and places.
  for (uint32_t first = thread.block() * rays; first < query.count;) {
    const uint32_t i = first + thread.index();
    const bool present = thread.index() < rays && thread.index() < query.count - first;
    ProvenRay proven;
    proven.is_open = false;
    if (present) {
      proven = prove_scene<kKinds>(thread, scene, load_ray(query, i), query, i, row);
      store_answer<true>(query, i, proven.answer);
    }
    if (query.visible_bits) {
      const uint64_t bits = thread.ballot(present && proven.answer.logit >= 0);
      if (present && i % 8 == 0)
        query.visible_bits[i / 8] = static_cast<unsigned char>(bits >> thread.lane());
    }
    const uint32_t place = append(thread, proven.is_open, lists.count);
    if (proven.is_open && place < lists.capacity) {
      const uint64_t at = uint64_t(place) * 4;
      store_unaligned(lists.rays + at, work.first + i);
      if (lists.tmin) store_unaligned(lists.tmin + at, bits_as<uint32_t>(proven.open.begin));
      if (lists.tmax) store_unaligned(lists.tmax + at, bits_as<uint32_t>(proven.open.end));
      if (lists.instance) store_unaligned(lists.instance + at, proven.instance);
    }
    if (query.count - first <= step) return;  // first + step may be more than 32 bits
    first += step;
  }
}

}  // namespace nif::kernels::gpu
