// A whole scene by one kernel: a thread takes its ray through the top level, asks each object whose box it
// may meet, and joins their answers, as runtime/src/query/answer.cpp does on the CPU, to the same bits. (But
// for the last bits of probabilities.)
//
// Objects of all encodings may be asked by threads of one wave at the same time. So each thread has a row of
// shared memory of its own, in which an object's kernel keeps whatever it keeps; rows are an odd number of
// words long, so that the same word of all rows lies in different banks.
#pragma once

#include "kernels/gpu/scene_arrays.hpp"

namespace nif::kernels::gpu {

/// A number that the compiler knows.
template <uint32_t kNumber>
struct Features {
  static constexpr uint32_t kCount = kNumber;
};

/// Asks one object. `row` is the thread's.
template <uint32_t kKinds, class Thread>
NIF_HOST_DEVICE ObjectAnswer ask_object(const Thread& thread, const SceneObject& object, const Segment& ray,
                                        uint32_t* row) {
  const uint32_t kind = object.kind;
  const auto ask_segment = [&](auto features) {
    const KeptRuns<1> kept(reinterpret_cast<float*>(row));
    return answer_segment_ray<decltype(features)::kCount>(
        thread, *static_cast<const DeviceSegmentField*>(object.field), ray, kept, object.widest,
        reinterpret_cast<unsigned char*>(row + 2 * kKeptRuns));
  };
  if constexpr ((kKinds & kPairSegment) != 0)
    if (kKinds == kPairSegment || kind == kPairSegment) return ask_segment(Features<2>());
  if constexpr ((kKinds & kAnySegment) != 0)
    if (kind == kAnySegment) return ask_segment(Features<0>());
  if constexpr ((kKinds & kSphericalObject) != 0)
    if (kind == kSphericalObject)
      return answer_spherical_ray<1>(*static_cast<const SphericalField*>(object.field), ray,
                                     reinterpret_cast<float*>(row),
                                     reinterpret_cast<float*>(row) + object.widest);
  if constexpr (kKinds == kSingleBvh)
    return answer_bvh_ray<1, float>(*static_cast<const BvhField*>(object.field), ray, row);
  if constexpr ((kKinds & kBvhObject) != 0)
    return answer_bvh_ray<1>(*static_cast<const BvhField*>(object.field), ray, row);
  return {};
}

/// Asks one instance, by a ray in world space. Whether the answer is certain counts with details only.
template <uint32_t kKinds, bool kDetails, class Thread>
NIF_HOST_DEVICE ObjectAnswer ask_instance(const Thread& thread, const SceneArrays& scene,
                                          const PlacedInstance& instance, const Segment& ray, uint32_t* row) {
  const SceneObject& object = scene.objects[instance.object];
  if (instance.identity) return ask_object<kKinds>(thread, object, ray, row);
  const Segment local = to_object(instance.to_object, ray);
  ObjectAnswer answer = ask_object<kKinds>(thread, object, local, row);
  if (kDetails && answer.certain && !(ray.tmin > ray.tmax))
    answer.certain =
        instance.well_conditioned && stays_certain(instance.to_object, object.reach_scale, ray, local);
  return answer;
}

/// A ray on its way from instance to instance, and what those that it has asked have answered.
struct SceneWay {
  Cursor cursor;
  CombinedAnswerBy<DeviceMaths> combined;
};

/// Joins an instance's answer. True where the rest need not be asked: without details any "occluded" will do.
template <bool kDetails>
NIF_HOST_DEVICE bool join_answer(const ObjectAnswer& answer, float logit_scale, bool with_probability,
                                 SceneWay& way, SceneAnswer& result) {
  if (!kDetails) {
    if (answer.logit < 0) result.logit = answer.logit;
    return answer.logit < 0;
  }
  way.combined.add(answer.logit, answer.certain, logit_scale, with_probability);
  return way.combined.blocked_for_certain();
}

/// Takes a ray on, from where it is on its way. ask(instance number, answer) asks an instance, or says no:
/// then that one's answer is still missing, and so is the ray's. Else `result` is complete, and true.
template <bool kDetails, class Ask>
NIF_HOST_DEVICE bool follow_scene(const SceneArrays& scene, const Segment& ray, const BoxRay& prepared,
                                  bool with_probability, SceneWay& way, const Ask& ask, SceneAnswer& result) {
  const auto met = [&](const TopNode& node) { return children_met(node, ray, prepared); };
  for (;;) {
    const uint32_t number = next_instance(scene.nodes, way.cursor, met);
    if (number == kNoPlace) break;
    ObjectAnswer answer;
    if (!ask(number, answer)) return false;
    if (join_answer<kDetails>(answer, scene.objects[scene.instances[number].object].logit_scale,
                              with_probability, way, result))
      break;
  }
  if (!kDetails) return true;
  result.logit = way.combined.logit();
  result.certain = way.combined.certain();
  if (with_probability) result.probability = way.combined.probability();
  return true;
}

/// At the start of its way. False where there is nothing to ask: then `result` is complete. In scenes of one
/// instance that is asked whether it is met or not, and of rays that are none, too: not for those.
NIF_HOST_DEVICE inline bool start_way(const SceneArrays& scene, const Segment& ray, BoxRay& prepared,
                                      SceneWay& way, SceneAnswer& result) {
  const bool askable = prepare_box_ray(ray, prepared);
  result.certain = askable || ray.tmin > ray.tmax;
  if (!askable || scene.instance_count == 0) return false;
  way.cursor = {children_met(scene.nodes[0], ray, prepared), 0};
  return true;
}

/// The scene's answer where its only instance gives this one.
NIF_HOST_DEVICE inline SceneAnswer only_answer(const ObjectAnswer& answer, float logit_scale,
                                               bool with_probability) {
  SceneAnswer result;
  result.logit = answer.logit;
  result.certain = answer.certain;
  if (with_probability) result.probability = visible_probability<DeviceMaths>(answer.logit, logit_scale);
  return result;
}

/// Takes one ray through the scene.
template <uint32_t kKinds, bool kDetails, class Thread>
NIF_HOST_DEVICE SceneAnswer ask_scene(const Thread& thread, const SceneArrays& scene, const Segment& ray,
                                      const SceneQuery& query, uint32_t* row) {
  const bool with_probability = kDetails && query.probability;
  if (scene.instance_count == 1) {
    const PlacedInstance& instance = scene.instances[0];
    return only_answer(ask_instance<kKinds, kDetails>(thread, scene, instance, ray, row),
                       scene.objects[instance.object].logit_scale, with_probability);
  }
  SceneAnswer result;
  BoxRay prepared;
  SceneWay way;
  if (!start_way(scene, ray, prepared, way, result)) return result;
  const auto ask = [&](uint32_t number, ObjectAnswer& answer) {
    answer = ask_instance<kKinds, kDetails>(thread, scene, scene.instances[number], ray, row);
    return true;
  };
  follow_scene<kDetails>(scene, ray, prepared, with_probability, way, ask, result);
  return result;
}

/// Answers a query about a scene whose objects are of the given kinds. Without details: only what is visible,
/// which takes fewer registers. Blocks of kSceneThreads, any number of them; scene.layout.bytes.
template <uint32_t kKinds, bool kDetails, class Thread>
NIF_HOST_DEVICE void scene_answer(const Thread& thread, const SceneWork& work) {
  const SceneArrays& scene = work.scene;
  const SceneQuery& query = work.query;
  uint32_t* const row = reinterpret_cast<uint32_t*>(thread.shared()) + thread.index() * scene.layout.row;
  const uint32_t count = work.list.rays ? *work.list.count : query.count;
  const uint32_t rays = scene.layout.rays, step = thread.blocks() * rays;
  // All threads go round together, because the lanes of a wave vote for bits.
  for (uint32_t first = thread.block() * rays; first < count;) {
    const uint32_t i = first + thread.index();
    const bool present = thread.index() < rays && thread.index() < count - first;
    SceneAnswer answer;
    if (present) {
      const uint32_t number = work.list.rays ? work.list.rays[i] : i;
      answer = ask_scene<kKinds, kDetails>(thread, scene, load_ray(query, number), query, row);
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
