// Adds the `segment` encoding to the list of encodings (kernels/gpu/encoding_list.hpp).
#pragma once

#include "kernels/gpu/encoding_list.hpp"
#include "kernels/gpu/network/network_stages.hpp"
#include "kernels/gpu/planes/planes_device_field.hpp"
#include "kernels/gpu/planes/planes_query.hpp"

namespace nif::kernels::gpu {

class FieldUpload;

struct SegmentEncoding {
  using Field = DeviceSegmentField;
  enum Kind : uint32_t {
    kPairs = 1,  ///< two features per corner, in corner bricks: what the baker makes
    kOthers = 2
  };
  static constexpr uint32_t kKinds = 2;
  static constexpr bool kHasItems = true, kProves = true;

  template <uint32_t kSet, class Thread>
  NIF_HOST_DEVICE NIF_INLINE static ObjectAnswer ask(const Thread& thread, const SceneObject& object,
                                                     uint32_t kind, const Segment& ray, uint32_t* row) {
    if constexpr ((kSet & kPairs) != 0)
      if (kSet == kPairs || kind == kPairs) return ask_row<2>(thread, object, ray, row);
    if constexpr ((kSet & kOthers) != 0) return ask_row<0>(thread, object, ray, row);
    return {};
  }
  template <uint32_t kSet>
  NIF_HOST_DEVICE NIF_INLINE static bool traverse(const SceneObject& object, const Segment& ray,
                                                  uint32_t* column, OpenItem& item, ObjectAnswer& answer) {
    return traverse_segment_item(object, ray, column, item, answer);
  }

  template <uint32_t kSet, class Thread>
  NIF_HOST_DEVICE NIF_INLINE static Hit intersect(const Thread& thread, const SceneObject& object,
                                                  uint32_t kind, const Segment& ray, float limit,
                                                  uint32_t* row) {
    const auto& field = *static_cast<const Field*>(object.field);
    const auto network = [&](const Segment& part) {
      return ask<kPairs | kOthers>(thread, object, kind, part, row).logit < 0;
    };
    return find_hit_by_planes(field, field.words, ray, limit, network);
  }
  NIF_HOST_DEVICE NIF_INLINE static ObjectAnswer prove(const SceneObject& object, const Segment& ray,
                                                       OpenInterval& open) {
    const auto& field = *static_cast<const Field*>(object.field);
    return prove_ray(field, field.words, ray, open);
  }

  template <class Hash>
  static constexpr void describe(Hash& hash) {
    using F = NetworkField;
    using Layer = Network::Layer;
    hash.template structure<Layer>(
        {&Layer::inputs, &Layer::outputs, &Layer::shift, &Layer::weights, &Layer::biases});
    hash.template structure<Calibration>({&Calibration::scale, &Calibration::threshold});
    hash.template structure<Network>({&Network::layer_count, &Network::layers, &Network::calibration});
    describe_planes(hash);
    hash.template structure<F>({&F::brick_corners, &F::corner_base, &F::features, &F::corners,
                                &F::features_per_corner, &F::samples, &F::length_scale, &F::network});
    hash.template structure<SegmentField>(
        {Hash::template part<PlanesField>(), Hash::template part<NetworkField>()});
  }
  static FieldUpload* upload(const SegmentField& field);

 private:
  template <uint32_t kFeatures, class Thread>
  NIF_HOST_DEVICE NIF_INLINE static ObjectAnswer ask_row(const Thread& thread, const SceneObject& object,
                                                         const Segment& ray, uint32_t* row) {
    const KeptIntervals<1> kept(row);
    return answer_segment_ray<kFeatures>(thread, *static_cast<const Field*>(object.field), ray, kept,
                                         object.widest, reinterpret_cast<unsigned char*>(row + kKeptWords));
  }
};
template <>
struct GpuEncodingOf<SegmentField> {
  using Encoding = SegmentEncoding;
};

/// Networks of fields with two features per corner, and with any number.
#define NIF_SEGMENT_STAGES(STAGE)                                                        \
  STAGE(kPairNetworks, segment_2, kBlockThreads, 6, false, pipeline_segments<Matrix, 2>) \
  STAGE(kAnyNetworks, segment_any, kBlockThreads, 1, false, pipeline_segments<Matrix, 0>)

}  // namespace nif::kernels::gpu
