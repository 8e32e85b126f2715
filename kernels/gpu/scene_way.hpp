// A ray's progress through a scene, and how the answers of its instances are combined.
#pragma once

#include "kernels/gpu/scene_arrays.hpp"

namespace nif::kernels::gpu {

/// Turns the answer of an instance's object, for the ray in object space, into that of the instance, for the
/// ray in world space. Whether it is certain only matters with details.
template <bool kDetails>
NIF_HOST_DEVICE void to_world(const PlacedInstance& instance, float reach_scale, const Segment& world,
                              const Segment& local, ObjectAnswer& answer) {
  if (kDetails && answer.certain) answer.certain = stays_certain(instance, reach_scale, world, local);
}

/// A ray's progress from instance to instance, and the answers so far.
struct SceneWay {
  Cursor cursor;
  CombinedAnswerBy<DeviceMaths> combined;
};

/// Adds an instance's answer. Returns true if the rest can be skipped: without details any "occluded"
/// suffices.
template <bool kDetails>
NIF_HOST_DEVICE bool join_answer(const ObjectAnswer& answer, const Calibration& calibration,
                                 bool with_probability, SceneWay& way, SceneAnswer& result) {
  if (!kDetails) {
    if (answer.logit < 0) result.logit = answer.logit;
    return answer.logit < 0;
  }
  way.combined.add(answer.logit, answer.certain, calibration, with_probability);
  return way.combined.blocked_for_certain();
}

/// Advances a ray to the instances that meets(instance number) accepts. ask(instance number, answer) queries
/// an instance, or returns false: then that instance's answer is still missing, and so is the ray's.
/// Otherwise `result` is complete, and this returns true.
template <bool kDetails, class Meets, class Ask>
NIF_HOST_DEVICE NIF_INLINE bool follow_scene(const SceneArrays& scene, const Segment& ray,
                                             const BoxRay& prepared, bool with_probability, SceneWay& way,
                                             const Meets& meets, const Ask& ask, SceneAnswer& result) {
  const auto met = [&](const TopNode& node) { return children_met(node, ray, prepared); };
  for (;;) {
    const uint32_t number = next_instance(scene.nodes, way.cursor, met);
    if (number == kNoBox) break;
    if (!meets(number)) continue;
    ObjectAnswer answer;
    if (!ask(number, answer)) return false;
    if (join_answer<kDetails>(answer, scene.objects[scene.instances[number].object].calibration,
                              with_probability, way, result))
      break;
  }
  if (!kDetails) return true;
  result.logit = way.combined.logit();
  result.certain = way.combined.certain();
  if (with_probability) result.probability = way.combined.probability();
  return true;
}

/// Starts a ray. Returns false if there is nothing to ask: then `result` is complete. Not for scenes of one
/// instance: a sole instance is queried whether or not its box is met, and even for invalid rays.
NIF_HOST_DEVICE inline bool start_way(const SceneArrays& scene, const Segment& ray, BoxRay& prepared,
                                      SceneWay& way, SceneAnswer& result) {
  const bool askable = prepare_box_ray(ray, prepared);
  result.certain = (askable || ray.tmin > ray.tmax) && !scene.unproven;
  // No ray is certain to miss what nothing proves, not even if it misses all boxes.
  if (scene.unproven) way.combined.add(kCertainLogit, false, {}, false);
  if (!askable || scene.instance_count == 0) return false;
  way.cursor = {children_met(scene.nodes[0], ray, prepared), 0};
  return true;
}

/// The scene's answer if its sole instance gives this one.
NIF_HOST_DEVICE inline SceneAnswer only_answer(const ObjectAnswer& answer, const Calibration& calibration,
                                               bool with_probability) {
  SceneAnswer result;
  result.logit = answer.logit;
  result.certain = answer.certain;
  if (with_probability) result.probability = visible_probability<DeviceMaths>(answer.logit, calibration);
  return result;
}

}  // namespace nif::kernels::gpu
