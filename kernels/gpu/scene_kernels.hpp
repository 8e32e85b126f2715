// Answers a whole scene with one kernel: a thread takes its ray through the top level, asks each object whose
// box it may meet, and combines their answers, as runtime/src/query/visibility.cpp does on the CPU, with the
// same bits (except for the last bits of probabilities).
//
// Threads of one wave may query objects of all encodings at the same time. So each thread has its own row of
// shared memory, which the current object's kernel uses; rows are an odd number of words long, so that the
// same word of all rows lies in different banks.
#pragma once

#include "kernels/gpu/gpu_encodings.hpp"
#include "kernels/gpu/scene_way.hpp"
#include "kernels/gpu/shim.hpp"

namespace nif::kernels::gpu {

/// Asks one object, of the kinds in a set and the encodings of a list. `row` is the thread's own.
template <uint32_t kKinds, class Thread, class Encoding, class... Others>
NIF_HOST_DEVICE NIF_INLINE ObjectAnswer ask_one_of(EncodingList<Encoding, Others...>, const Thread& thread,
                                                   const SceneObject& object, const Segment& ray,
                                                   uint32_t* row) {
  constexpr uint32_t kOwn = kKinds & kKindsOf<Encoding>, kRest = kKinds & ~kOwn;
  if constexpr (kOwn != 0)
    if (kRest == 0 || (object.kind & kOwn) != 0) {
      constexpr uint32_t kFirst = kFirstKindBit<Encoding>;
      return Encoding::template ask<(kOwn >> kFirst)>(thread, object, object.kind >> kFirst, ray, row);
    }
  if constexpr (kRest != 0) return ask_one_of<kRest>(EncodingList<Others...>(), thread, object, ray, row);
  return {};
}
template <uint32_t kKinds, class Thread>
NIF_HOST_DEVICE ObjectAnswer ask_object(const Thread& thread, const SceneObject& object, const Segment& ray,
                                        uint32_t* row) {
  return ask_one_of<kKinds>(Encodings(), thread, object, ray, row);
}

/// Asks one instance, for a ray in world space.
template <uint32_t kKinds, bool kDetails, class Thread>
NIF_HOST_DEVICE ObjectAnswer ask_instance(const Thread& thread, const SceneArrays& scene,
                                          const PlacedInstance& instance, const Segment& ray, uint32_t* row) {
  const SceneObject& object = scene.objects[instance.object];
  if (instance.identity) {
    ObjectAnswer answer = ask_object<kKinds>(thread, object, ray, row);
    if (kDetails && instance.unproven) answer.certain = false;
    return answer;
  }
  const Segment local = to_object(instance.to_object, ray);
  ObjectAnswer answer = ask_object<kKinds>(thread, object, local, row);
  to_world<kDetails>(instance, object.reach_scale, ray, local, answer);
  return answer;
}

/// Takes one ray through the scene.
template <uint32_t kKinds, bool kDetails, class Thread>
NIF_HOST_DEVICE NIF_LONG_INLINE SceneAnswer ask_scene(const Thread& thread, const SceneArrays& scene,
                                                      const Segment& ray, const SceneQuery& query,
                                                      uint32_t number, uint32_t* row) {
  const bool with_probability = kDetails && query.probability;
  const auto meets = [&](uint32_t instance) { return lets_in(scene, query, number, instance); };
  if (scene.instance_count == 1 && meets(scene.sole)) {
    const PlacedInstance& instance = scene.instances[scene.sole];
    return only_answer(ask_instance<kKinds, kDetails>(thread, scene, instance, ray, row),
                       scene.objects[instance.object].calibration, with_probability);
  }
  SceneAnswer result;
  BoxRay prepared;
  SceneWay way;
  if (!start_way(scene, ray, prepared, way, result)) return result;
  const auto ask = [&](uint32_t instance, ObjectAnswer& answer) {
    answer = ask_instance<kKinds, kDetails>(thread, scene, scene.instances[instance], ray, row);
    return true;
  };
  follow_scene<kDetails>(scene, ray, prepared, with_probability, way, meets, ask, result);
  return result;
}

/// Answers a query about a scene whose objects are of the given kinds. Without details it only computes
/// visibility, which takes fewer registers. Any number of blocks of kSceneThreads; scene.layout.bytes of
/// shared memory.
template <uint32_t kKinds, bool kDetails, class Thread>
NIF_HOST_DEVICE NIF_LONG_INLINE void scene_answer(const Thread& thread, const SceneWork& work) {
  const SceneArrays& scene = work.scene;
  const SceneQuery& query = work.query;
  uint32_t* const row = reinterpret_cast<uint32_t*>(thread.shared()) + thread.index() * scene.layout.row;
  const uint32_t count = work.list.rays ? *work.list.count : query.count;
  const uint32_t rays = scene.layout.rays, step = thread.blocks() * rays;
  // All threads loop together, because the lanes of a wave vote for bits.
  for (uint32_t first = thread.block() * rays; first < count;) {
    const uint32_t i = first + thread.index();
    const bool present = thread.index() < rays && thread.index() < count - first;
    SceneAnswer answer;
    if (present) {
      const uint32_t number = work.list.rays ? work.list.rays[i] : i;
      answer = ask_scene<kKinds, kDetails>(thread, scene, load_ray(query, number), query, number, row);
      store_answer<kDetails>(query, number, answer);
    }
    if (query.visible_bits && !work.list.rays) {
      const uint64_t bits = thread.ballot(present && answer.logit >= 0);
      if (present && i % 8 == 0)
        query.visible_bits[i / 8] = static_cast<unsigned char>(bits >> thread.lane());
    }
    if (count - first <= step) return;  // first + step may be more than 32 bits
    first += step;
  }
}

}  // namespace nif::kernels::gpu
