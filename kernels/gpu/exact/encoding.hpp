// The `exact` objects as the list of encodings has them (kernels/gpu/encoding_list.hpp).
#pragma once

#include "kernels/gpu/bvh/encoding.hpp"
#include "kernels/gpu/exact/kernels.hpp"
#include "kernels/gpu/proof/device_field.hpp"

namespace nif::kernels::gpu {

class FieldUpload;

struct ExactEncoding {
  using HostField = ExactField;
  using Field = DeviceExactField;
  enum Kind : uint32_t { kProvenFirst = 1 };
  static constexpr uint32_t kKinds = 1;
  static constexpr bool kHasItems = false, kProves = false;

  template <uint32_t kSet, class Thread>
  NIF_HOST_DEVICE NIF_INLINE static ObjectAnswer ask(const Thread&, const SceneObject& object, uint32_t,
                                                     const Segment& ray, uint32_t* row) {
    return answer_exact_ray<1>(*static_cast<const Field*>(object.field), ray, row);
  }
  NIF_HOST_DEVICE NIF_INLINE static bool walk(const SceneObject& object, const Segment& ray, uint32_t* column,
                                              OpenItem&, ObjectAnswer& answer) {
    answer = answer_exact_ray<kBlockThreads>(*static_cast<const Field*>(object.field), ray, column);
    return true;
  }
  template <class Thread>
  NIF_HOST_DEVICE NIF_INLINE static Hit intersect(const Thread&, const SceneObject& object, uint32_t,
                                                  const Segment& ray, float limit, uint32_t* row) {
    return find_exact_hit<1>(*static_cast<const Field*>(object.field), ray, limit, row);
  }

  template <class Hash>
  static constexpr void describe(Hash& hash) {
    describe_proof(hash);
    BvhEncoding::describe(hash);
    hash.template structure<ExactField>({&ExactField::proof, &ExactField::bvh});
  }
  static FieldUpload* upload(const ExactField& field);
};

}  // namespace nif::kernels::gpu
