// A scene, a query about it and its answers, as kernels read them from device memory.
#pragma once

#include "kernels/gpu/maths.hpp"
#include "kernels/gpu/object.hpp"
#include "kernels/reference/scene_query.hpp"
#include "kernels/reference/top_level.hpp"

namespace nif::kernels::gpu {

inline constexpr uint32_t kSceneThreads = 64;  ///< block size of scene_answer()

/// How a block divides its shared memory; made on the host.
struct SceneLayout {
  uint32_t row;    ///< words per thread
  uint32_t rays;   ///< rays of a block at a time: one per thread, or fewer if rows are long; a multiple of 8
  uint32_t bytes;  ///< of shared memory
};

/// For rows of `words` words. At least 8 rays fit with any network that an asset may have.
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
  const uint64_t* users;  ///< [as instances] values that hits return; null: 0
  const SceneObject* objects;
  uint32_t instance_count;  ///< instances that rays can meet: 0, 1, or more
  uint32_t sole;            ///< the instance, if there is 1
  uint32_t unproven;        ///< 1: rays can meet an instance whose file proves nothing
  SceneLayout layout;
};

/// A query, as in NifRays and NifAnswers (runtime/include/nif/nif.h): all arrays are device memory of any
/// alignment, and those of tmin, tmax, masks and outputs may be null.
struct SceneQuery {
  const unsigned char *origin[3], *direction[3], *tmin, *tmax, *mask;
  uint64_t origin_stride, direction_stride, tmin_stride, tmax_stride, mask_stride;  ///< bytes
  unsigned char *visible, *visible_bits, *probability, *certain, *logit;
  uint32_t count;
  uint32_t whole_rays;  ///< 1 if inputs are an array of NifRay, starting at origin[0] and aligned to 16 bytes

  /// Whether the caller wants more than visibility: then a learned "occluded" does not end the search.
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
  // `== 1`, because clang 15 takes fewer registers for that than for any comparison but with 0.
  if (query.whole_rays == 1) {  // origin, tmin, direction, tmax: two loads instead of eight
    const unsigned char* const from = query.origin[0] + uint64_t(i) * 32;
    const AlignedWords<4> first = load_words<4>(from), second = load_words<4>(from + 16);
    for (int a = 0; a < 3; ++a) {
      ray.origin[a] = bits_as<float>(first.word[a]);
      ray.direction[a] = bits_as<float>(second.word[a]);
    }
    ray.tmin = bits_as<float>(first.word[3]);
    ray.tmax = bits_as<float>(second.word[3]);
    return ray;
  }
  NIF_UNROLL
  for (int a = 0; a < 3; ++a) {
    ray.origin[a] = load(query.origin[a], query.origin_stride);
    ray.direction[a] = load(query.direction[a], query.direction_stride);
  }
  ray.tmin = query.tmin ? load(query.tmin, query.tmin_stride) : 0;
  ray.tmax = query.tmax ? load(query.tmax, query.tmax_stride) : bits_as<float>(0x7f800000u);
  return ray;
}

/// Does the mask of ray i let it meet an instance?
NIF_HOST_DEVICE NIF_INLINE bool lets_in(const SceneArrays& scene, const SceneQuery& query, uint32_t i,
                                        uint32_t instance) {
  return !query.mask || (scene.instances[instance].mask & load_unaligned(query.mask + i * query.mask_stride));
}

/// A ray's answer, with the outputs of NifAnswers.
struct SceneAnswer {
  int32_t logit = kCertainLogit;  ///< without details only the signs of the rest count
  bool certain = false;
  float probability = 1;
};

/// All outputs except visible_bits, which combine several rays.
template <bool kDetails>
NIF_HOST_DEVICE NIF_INLINE void store_answer(const SceneQuery& query, uint32_t ray,
                                             const SceneAnswer& answer) {
  if (query.visible) query.visible[ray] = answer.logit >= 0;
  if (!kDetails) return;
  if (query.certain) query.certain[ray] = answer.certain;
  if (query.probability)
    store_unaligned(query.probability + uint64_t(ray) * 4, bits_as<uint32_t>(answer.probability));
  if (query.logit) store_unaligned(query.logit + uint64_t(ray) * 4, uint32_t(answer.logit));
}

/// Some of a query's rays: `rays` has *count ray numbers; null means all rays.
struct RayList {
  const uint32_t* rays;
  const uint32_t* count;
};

/// Arguments of a kernel.
struct SceneWork {
  SceneArrays scene;
  SceneQuery query;
  RayList list;  ///< visible_bits are written only if it is all rays
};

}  // namespace nif::kernels::gpu
