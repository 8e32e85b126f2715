// Adds the `spherical` encoding to the list of encodings (kernels/gpu/encoding_list.hpp).
#pragma once

#include "kernels/gpu/encoding_list.hpp"
#include "kernels/gpu/spherical/spherical_kernels.hpp"
#include "kernels/gpu/spherical/spherical_stages.hpp"
#include "kernels/reference/spherical/spherical_query.hpp"

namespace nif::kernels::gpu {

class FieldUpload;

struct SphericalEncoding {
  using Field = SphericalField;
  static constexpr uint32_t kKinds = 1;
  static constexpr bool kHasItems = true, kProves = false;

  template <uint32_t kSet, class Thread>
  NIF_HOST_DEVICE NIF_INLINE static ObjectAnswer ask(const Thread&, const SceneObject& object, uint32_t,
                                                     const Segment& ray, uint32_t* row) {
    return answer_spherical_ray<1>(*static_cast<const Field*>(object.field), ray,
                                   reinterpret_cast<float*>(row),
                                   reinterpret_cast<float*>(row) + object.widest);
  }
  template <uint32_t kSet>
  NIF_HOST_DEVICE NIF_INLINE static bool traverse(const SceneObject& object, const Segment& ray,
                                                  uint32_t* column, OpenItem& item, ObjectAnswer& answer) {
    return traverse_spherical_item(object, ray, column, item, answer);
  }
  template <uint32_t kSet, class Thread>
  NIF_HOST_DEVICE NIF_INLINE static Hit intersect(const Thread& thread, const SceneObject& object,
                                                  uint32_t kind, const Segment& ray, float, uint32_t* row) {
    const ObjectAnswer answer = ask<1>(thread, object, kind, ray, row);
    return hit_on_box(*static_cast<const Field*>(object.field), ray, answer.logit >= 0, answer.certain);
  }

  template <class Hash>
  static constexpr void describe(Hash& hash) {
    using F = SphericalField;
    using Values = SphericalValues;
    using Grid = SphericalGrid;
    using Net = SphericalNetwork;
    using Bounds = SphericalBounds;
    hash.template structure<Values>({&Values::data, &Values::half});
    hash.template structure<Grid>({&Grid::values, &Grid::resolution, &Grid::features});
    hash.template structure<Net>(
        {&Net::weights, &Net::inputs, &Net::width, &Net::hidden_layers, &Net::outputs});
    hash.template structure<Bounds>({&Bounds::low, &Bounds::high, &Bounds::centre, &Bounds::distance_scale,
                                     &Bounds::margin, &Bounds::extent, &Bounds::reach_scale});
    hash.template structure<F>({Hash::template part<Bounds>(), &F::outer_position, &F::outer_direction,
                                &F::inner_position, &F::inner_direction, &F::distance, &F::outer, &F::inner,
                                &F::slope});
  }
  static FieldUpload* upload(const SphericalField& field);
};
template <>
struct GpuEncodingOf<SphericalField> {
  using Encoding = SphericalEncoding;
};

/// Half precision: narrow networks have kHalfTiles, wide ones kMostHalfTiles.
#define NIF_SPHERICAL_STAGES(STAGE)                                        \
  STAGE(kNarrowOuter, half_outer_64, kHalfThreads, 2, false,               \
        pipeline_halves<HalfMatrix, SphericalKind::outer, kHalfTiles>)     \
  STAGE(kWideOuter, half_outer_96, kHalfThreads, 1, false,                 \
        pipeline_halves<HalfMatrix, SphericalKind::outer, kMostHalfTiles>) \
  STAGE(kNarrowInner, half_inner_64, kHalfThreads, 2, true,                \
        pipeline_halves<HalfMatrix, SphericalKind::inner, kHalfTiles>)     \
  STAGE(kWideInner, half_inner_96, kHalfThreads, 1, true,                  \
        pipeline_halves<HalfMatrix, SphericalKind::inner, kMostHalfTiles>)

}  // namespace nif::kernels::gpu
