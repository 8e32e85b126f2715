// Adds `cutout` objects to the list of encodings (kernels/gpu/encoding_list.hpp): triangles as those of `bvh`, of which
// some have holes.
#pragma once

#include "kernels/gpu/encoding_list.hpp"
#include "kernels/gpu/triangles/triangles_kernels.hpp"
#include "kernels/reference/encodings/reference_cutout.hpp"

namespace nif::kernels::gpu {

class FieldUpload;

struct CutoutEncoding {
  using Field = CutoutField;
  enum Kind : uint32_t { kExact = 1 };
  static constexpr uint32_t kKinds = 1;
  static constexpr bool kHasItems = false, kProves = false;

  template <uint32_t kSet, class Thread>
  NIF_HOST_DEVICE NIF_INLINE static ObjectAnswer ask(const Thread&, const SceneObject& object, uint32_t,
                                                     const Segment& ray, uint32_t* row) {
    const auto& field = *static_cast<const Field*>(object.field);
    return answer_bvh_ray<1, double>(field.triangles, ray, row, BlockingTriangles{field.holes});
  }
  NIF_HOST_DEVICE NIF_INLINE static bool traverse(const SceneObject& object, const Segment& ray,
                                                  uint32_t* column, OpenItem&, ObjectAnswer& answer) {
    const auto& field = *static_cast<const Field*>(object.field);
    answer =
        answer_bvh_ray<kBlockThreads, double>(field.triangles, ray, column, BlockingTriangles{field.holes});
    return true;
  }
  template <class Thread>
  NIF_HOST_DEVICE NIF_INLINE static Hit intersect(const Thread&, const SceneObject& object, uint32_t,
                                                  const Segment& ray, float limit, uint32_t* row) {
    const auto& field = *static_cast<const Field*>(object.field);
    return find_bvh_hit<1>(field.triangles, ray, limit, row, BlockingTriangles{field.holes});
  }

  template <class Hash>
  static constexpr void describe(Hash& hash) {
    using F = CutoutField;
    using Holes = HolesField;
    hash.template structure<AlphaMap>(
        {&AlphaMap::tiles, &AlphaMap::width, &AlphaMap::height, &AlphaMap::wrap});
    hash.template structure<AlphaPatch>({&AlphaPatch::map, &AlphaPatch::shift, &AlphaPatch::places});
    hash.template structure<Holes>(
        {&Holes::maps, &Holes::patches, &Holes::numbers, &Holes::map_count, &Holes::patch_count});
    hash.template structure<F>({&F::triangles, &F::holes});
  }
  static FieldUpload* upload(const CutoutField& field);
};
template <>
struct GpuEncodingOf<CutoutField> {
  using Encoding = CutoutEncoding;
};

}  // namespace nif::kernels::gpu
