// Moves vertices by joints: the matrices of a vertex's joints are added up as whole vectors, one, two or four columns at
// once. The order of operations is that of docs/answers.md ("Posed vertices").
//
// Compiled once for each target.
#if defined(NIF_BVH_SKIN_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_BVH_SKIN_INL
#undef NIF_BVH_SKIN_INL
#else
#define NIF_BVH_SKIN_INL
#endif

#include <hwy/highway.h>

#include "kernels/cpu/lanes-inl.hpp"
#include "kernels/reference/triangles/skin.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

/// Adds up the four columns, first to last.
template <class D, class V>
HWY_INLINE hn::Vec<hn::FixedTag<float, 4>> sum_of_columns([[maybe_unused]] D d, const V* products) {
  const hn::FixedTag<float, 4> one;
  if constexpr (kLanes == 4) {
    return hn::Add(hn::Add(hn::Add(products[0], products[1]), products[2]), products[3]);
  } else if constexpr (kLanes == 8) {
    const auto add = [&](auto sum, auto columns) HWY_ATTR {
      return hn::Add(hn::Add(sum, hn::LowerHalf(one, columns)), hn::UpperHalf(one, columns));
    };
    return add(hn::Add(hn::LowerHalf(one, products[0]), hn::UpperHalf(one, products[0])), products[1]);
  } else {
    const hn::Half<D> half;
    const auto first = hn::LowerHalf(half, products[0]), last = hn::UpperHalf(half, products[0]);
    return hn::Add(
        hn::Add(hn::Add(hn::LowerHalf(one, first), hn::UpperHalf(one, first)), hn::LowerHalf(one, last)),
        hn::UpperHalf(one, last));
  }
}

/// As skin_vertices() of the reference.
HWY_NOINLINE inline void skin_in_lanes(const SkinOrder& order, const JointMatrix* matrices,
                                       const float (*from)[4], float (*to)[4]) {
  constexpr uint32_t kParts = 16 / kLanes;  ///< vectors that hold a matrix
  const Floats d;
  const hn::FixedTag<float, 4> one;
  alignas(64) int32_t coordinates[16];
  for (int i = 0; i < 16; ++i) coordinates[i] = i / 4;
  const float* weights = order.weights;
  const uint16_t* joints = order.joints;
  for (uint32_t influences = 1; influences <= kMostInfluences; ++influences)
    for (uint32_t v = 0; v < order.vertex_count[influences]; ++v, ++from, ++to) {
      hn::Vec<Floats> mean[kParts];
      const float* const first = matrices[joints[0]].columns[0];
      const auto weight = hn::Set(d, weights[0]);
      for (uint32_t p = 0; p < kParts; ++p) mean[p] = hn::Mul(hn::Load(d, first + p * kLanes), weight);
      for (uint32_t k = 1; k < influences; ++k) {
        const float* const matrix = matrices[joints[k]].columns[0];
        const auto share = hn::Set(d, weights[k]);
        for (uint32_t p = 0; p < kParts; ++p)
          mean[p] = hn::Add(mean[p], hn::Mul(hn::Load(d, matrix + p * kLanes), share));
      }
      weights += influences;
      joints += influences;
      const auto at = hn::LoadDup128(d, *from);
      for (uint32_t p = 0; p < kParts; ++p)
        mean[p] =
            hn::Mul(mean[p], hn::TableLookupLanes(at, hn::SetTableIndices(d, coordinates + p * kLanes)));
      hn::Store(sum_of_columns(d, mean), one, *to);
    }
}

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
