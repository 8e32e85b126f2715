// A whole scene by one kernel: a thread takes its ray through the top level, asks each object whose box it
// may meet, and joins their answers, as runtime/src/answer.cpp does on the CPU, to the same bits. (But for
// the last bits of probabilities.)
//
// Objects of all encodings may be asked by threads of one wave at the same time. So each thread has a row of
// shared memory of its own, in which an object's kernel keeps whatever it keeps; rows are an odd number of
// words long, so that the same word of all rows lies in different banks.
#pragma once

#include "kernels/hip/bvh_kernels.hpp"
#include "kernels/hip/maths.hpp"
#include "kernels/hip/segment_kernels.hpp"
#include "kernels/hip/spherical_kernels.hpp"
#include "kernels/reference/scene.hpp"
#include "kernels/reference/top_level.hpp"

namespace nif::kernels::hip {

inline constexpr uint32_t kSceneThreads = 64;  ///< of scene_answer()'s blocks

/// What an object is, as bits: a kernel is made for a set of them.
enum SceneKind : uint32_t {
  kPairSegment = 1,  ///< `segment` with two features a corner, as the baker makes them
  kAnySegment = 2,   ///< with any number
  kBvhObject = 4,
  kSphericalObject = 8,
  kAnyKind = 15
};

/// An object of a scene. Device memory, and so is what it points to.
struct SceneObject {
  const void* field;  ///< SegmentField, BvhField or SphericalField
  uint32_t kind;      ///< SceneKind
  uint32_t widest;    ///< neurons of its widest layer (`segment`: of the hidden ones)
  float logit_scale, reach_scale;
};

/// How blocks share out their memory; made on the host.
struct SceneLayout {
  uint32_t row;    ///< words that a thread has
  uint32_t rays;   ///< of a block at a time: all its threads, or fewer where rows are long; a multiple of 8
  uint32_t bytes;  ///< of shared memory
};

inline SceneObject describe_object(const SegmentField& field) {
  SceneObject object{};
  object.kind = field.features_per_corner == 2 ? kPairSegment : kAnySegment;
  object.widest = make_layout(field).whole_hidden;
  return object;
}
inline SceneObject describe_object(const BvhField&) {
  SceneObject object{};
  object.kind = kBvhObject;
  return object;
}
inline SceneObject describe_object(const SphericalField& field) {
  SceneObject object{};
  object.kind = kSphericalObject;
  object.widest = make_layout(field).width;
  return object;
}

/// Words of a thread's row that the object needs.
inline uint32_t row_words(const SegmentField& field) {
  return 2 * kKeptRuns + (field.network.layers[0].inputs + 2 * describe_object(field).widest) / 4;
}
inline uint32_t row_words(const BvhField&) { return 2 * kMaxBvhDepth; }
inline uint32_t row_words(const SphericalField& field) { return 2 * describe_object(field).widest; }

/// For rows of so many words: of any network that an asset may have, 8 and more rays fit.
inline SceneLayout make_scene_layout(uint32_t words) {
  SceneLayout layout{};
  layout.row = words | 1;
  const uint32_t row_bytes = layout.row * uint32_t(sizeof(uint32_t)),
                 fitting = kSharedLimit / row_bytes / 8 * 8;
  layout.rays = fitting < kSceneThreads ? fitting : kSceneThreads;
  layout.bytes = layout.rays * row_bytes;
  return layout;
}

/// Device memory.
struct SceneArrays {
  const TopNode* nodes;
  const PlacedInstance* instances;
  const SceneObject* objects;
  uint32_t instance_count;
  SceneLayout layout;
};

/// A query as NifQuery has it (runtime/include/nif/nif.h): all arrays are device memory of any alignment, and
/// those of tmin, tmax and outputs may be null.
struct SceneQuery {
  const unsigned char *origin[3], *direction[3], *tmin, *tmax;
  uint64_t origin_stride, direction_stride, tmin_stride, tmax_stride;  ///< bytes
  unsigned char *visible, *visible_bits, *probability, *certain, *logit;
  uint32_t count;

  /// Whether more is asked for than what is visible: a learned "occluded" then does not end the search.
  bool details() const { return probability || certain || logit; }
};

NIF_HOST_DEVICE inline uint32_t load_unaligned(const unsigned char* from) {
  if ((reinterpret_cast<uintptr_t>(from) & 3) == 0) return load_word(from);
  return from[0] | uint32_t(from[1]) << 8 | uint32_t(from[2]) << 16 | uint32_t(from[3]) << 24;
}
NIF_HOST_DEVICE inline void store_unaligned(unsigned char* to, uint32_t word) {
  if ((reinterpret_cast<uintptr_t>(to) & 3) == 0) return store_word(to, word);
  for (uint32_t i = 0; i < 4; ++i) to[i] = static_cast<unsigned char>(word >> 8 * i);
}

NIF_HOST_DEVICE inline Segment load_ray(const SceneQuery& query, uint32_t i) {
  const auto load = [&](const unsigned char* array, uint64_t stride) {
    return bits_as<float>(load_unaligned(array + i * stride));
  };
  Segment ray;
  NIF_UNROLL
  for (int a = 0; a < 3; ++a) {
    ray.origin[a] = load(query.origin[a], query.origin_stride);
    ray.direction[a] = load(query.direction[a], query.direction_stride);
  }
  ray.tmin = query.tmin ? load(query.tmin, query.tmin_stride) : 0;
  ray.tmax = query.tmax ? load(query.tmax, query.tmax_stride) : bits_as<float>(0x7f800000u);
  return ray;
}

/// A ray's answer, as the outputs of NifQuery.
struct SceneAnswer {
  int32_t logit = kCertainLogit;  ///< of the rest only the sign counts where no details are asked for
  bool certain = false;
  float probability = 1;
};

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
        thread, *static_cast<const SegmentField*>(object.field), ray, kept, object.widest,
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

/// Takes one ray through the scene.
template <uint32_t kKinds, bool kDetails, class Thread>
NIF_HOST_DEVICE SceneAnswer ask_scene(const Thread& thread, const SceneArrays& scene, const Segment& ray,
                                      const SceneQuery& query, uint32_t* row) {
  const bool with_probability = kDetails && query.probability;
  SceneAnswer result;
  if (scene.instance_count == 1) {  // asked whether it is met or not, and of rays that are none, too
    const ObjectAnswer answer = ask_instance<kKinds, kDetails>(thread, scene, scene.instances[0], ray, row);
    result.logit = answer.logit;
    result.certain = answer.certain;
    if (with_probability)
      result.probability = visible_probability<DeviceMaths>(
          answer.logit, scene.objects[scene.instances[0].object].logit_scale);
    return result;
  }
  BoxRay prepared;
  const bool askable = prepare_box_ray(ray, prepared);
  result.certain = askable || ray.tmin > ray.tmax;
  if (!askable || scene.instance_count == 0) return result;
  CombinedAnswerBy<DeviceMaths> combined;
  const auto met = [&](const TopNode& node) { return children_met(node, ray, prepared); };
  Cursor cursor{met(scene.nodes[0]), 0};
  for (;;) {
    const uint32_t number = next_instance(scene.nodes, cursor, met);
    if (number == kNoPlace) break;
    const PlacedInstance& instance = scene.instances[number];
    const ObjectAnswer answer = ask_instance<kKinds, kDetails>(thread, scene, instance, ray, row);
    if (kDetails) {
      combined.add(answer.logit, answer.certain, scene.objects[instance.object].logit_scale,
                   with_probability);
      if (combined.blocked_for_certain()) break;
    } else if (answer.logit < 0) {
      result.logit = answer.logit;
      return result;
    }
  }
  if (!kDetails) return result;
  result.logit = combined.logit();
  result.certain = result.certain && combined.certain();
  if (with_probability) result.probability = combined.probability();
  return result;
}

/// Answers a query about a scene whose objects are of the given kinds. Without details: only what is visible,
/// which takes fewer registers. Blocks of kSceneThreads, any number of them; scene.layout.bytes.
template <uint32_t kKinds, bool kDetails, class Thread>
NIF_HOST_DEVICE void scene_answer(const Thread& thread, const SceneArrays& scene, const SceneQuery& query) {
  uint32_t* const row = reinterpret_cast<uint32_t*>(thread.shared()) + thread.index() * scene.layout.row;
  const uint32_t rays = scene.layout.rays, step = thread.blocks() * rays;
  // All threads go round together, because the lanes of a wave vote for bits.
  for (uint32_t first = thread.block() * rays; first < query.count;) {
    const uint32_t i = first + thread.index();
    const bool present = thread.index() < rays && thread.index() < query.count - first;
    SceneAnswer answer;
    if (present) {
      answer = ask_scene<kKinds, kDetails>(thread, scene, load_ray(query, i), query, row);
      if (query.visible) query.visible[i] = answer.logit >= 0;
      if (kDetails && query.certain) query.certain[i] = answer.certain;
      if (kDetails && query.probability)
        store_unaligned(query.probability + uint64_t(i) * 4, bits_as<uint32_t>(answer.probability));
      if (kDetails && query.logit) store_unaligned(query.logit + uint64_t(i) * 4, uint32_t(answer.logit));
    }
    if (query.visible_bits) {
      const uint64_t bits = thread.ballot(present && answer.logit >= 0);
      if (present && i % 8 == 0)
        query.visible_bits[i / 8] = static_cast<unsigned char>(bits >> thread.lane());
    }
    if (query.count - first <= step) return;  // first + step may be more than 32 bits
    first += step;
  }
}

}  // namespace nif::kernels::hip
