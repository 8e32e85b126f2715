// `cutout` objects on GPUs are a kind of `bvh` object (kernels/gpu/encodings/gpu_bvh.hpp): this only uploads them.
#pragma once

#include "kernels/gpu/encodings/gpu_bvh.hpp"
#include "kernels/reference/encodings/reference_cutout.hpp"

namespace nif::kernels::gpu {

struct CutoutEncoding {
  static constexpr uint32_t kKinds = 0;  ///< BvhEncoding::kHoles is its kind
  static constexpr bool kHasItems = false, kProves = false;

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
