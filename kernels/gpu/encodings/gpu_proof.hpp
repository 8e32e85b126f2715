// Adds the `proof` objects to the list of encodings (kernels/gpu/encoding_list.hpp).
#pragma once

#include "kernels/gpu/encoding_list.hpp"
#include "kernels/gpu/object.hpp"
#include "kernels/gpu/planes/planes_device_field.hpp"
#include "kernels/gpu/planes/planes_query.hpp"

namespace nif::kernels::gpu {

class FieldUpload;

/// In device memory. It lacks the grid's own arrays; `words` replaces them.
struct DevicePlanesField : PlanesField {
  TraversalWords words;
};

NIF_HOST_DEVICE inline ObjectAnswer answer_proof_ray(const DevicePlanesField& field, const Segment& segment) {
  OpenInterval open;
  return prove_ray(field, field.words, segment, open);
}

struct ProofEncoding {
  using Field = DevicePlanesField;
  enum Kind : uint32_t { kProven = 1 };
  static constexpr uint32_t kKinds = 1;
  static constexpr bool kHasItems = false, kProves = true;

  template <uint32_t kSet, class Thread>
  NIF_HOST_DEVICE NIF_INLINE static ObjectAnswer ask(const Thread&, const SceneObject& object, uint32_t,
                                                     const Segment& ray, uint32_t*) {
    return answer_proof_ray(*static_cast<const Field*>(object.field), ray);
  }
  template <uint32_t kSet>
  NIF_HOST_DEVICE NIF_INLINE static bool traverse(const SceneObject& object, const Segment& ray, uint32_t*,
                                                  OpenItem&, ObjectAnswer& answer) {
    answer = answer_proof_ray(*static_cast<const Field*>(object.field), ray);
    return true;
  }

  template <uint32_t kSet, class Thread>
  NIF_HOST_DEVICE NIF_INLINE static Hit intersect(const Thread&, const SceneObject& object, uint32_t,
                                                  const Segment& ray, float limit, uint32_t*) {
    const auto& field = *static_cast<const Field*>(object.field);
    return find_hit_by_planes(field, field.words, ray, limit, NoNetwork());
  }
  NIF_HOST_DEVICE NIF_INLINE static ObjectAnswer prove(const SceneObject& object, const Segment& ray,
                                                       OpenInterval& open) {
    const auto& field = *static_cast<const Field*>(object.field);
    return prove_ray(field, field.words, ray, open);
  }

  template <class Hash>
  static constexpr void describe(Hash& hash) {
    describe_planes(hash);
  }
  static FieldUpload* upload(const PlanesField& field);
};
template <>
struct GpuEncodingOf<PlanesField> {
  using Encoding = ProofEncoding;
};

}  // namespace nif::kernels::gpu
