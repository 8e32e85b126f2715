// The list of encodings that have GPU kernels. Kernels and the GPU module take from it everything that is
// alike for all encodings. To add an encoding, add a file to kernels/gpu/encodings and include it
// (docs/adding-a-part.md).
#pragma once

#include "kernels/gpu/encoding_list.hpp"
#include "kernels/gpu/encodings/gpu_bvh.hpp"
#include "kernels/gpu/encodings/gpu_cutout.hpp"
#include "kernels/gpu/encodings/gpu_exact.hpp"
#include "kernels/gpu/encodings/gpu_proof.hpp"
#include "kernels/gpu/encodings/gpu_segment.hpp"
#include "kernels/gpu/encodings/gpu_spherical.hpp"
#include "kernels/reference/field_list.hpp"

namespace nif::kernels::gpu {

/// In the order of kernels/reference/field_list.hpp.
using Encodings = OfFields<EncodingsOf>;

/// Kernels of the pipeline that answer items, for the encodings that have items (kernel_list.hpp describes
/// the arguments).
#define NIF_NETWORK_STAGES(STAGE) \
  NIF_SEGMENT_STAGES(STAGE)       \
  NIF_SPHERICAL_STAGES(STAGE)

template <class Encoding>
inline constexpr uint32_t kFirstKindBit = first_kind_bit<Encoding>(Encodings());
/// One kind of an encoding, as a bit of the sets of kinds.
template <class Encoding, uint32_t kKind>
inline constexpr uint32_t kKindBit = kKind << kFirstKindBit<Encoding>;
template <class Encoding>
inline constexpr uint32_t kKindsOf = kKindBit<Encoding, (1u << Encoding::kKinds) - 1>;
/// Those of several encodings.
template <class... Encoding>
inline constexpr uint32_t kKindsOfAll = (0u | ... | kKindsOf<Encoding>);

template <class... Encoding>
constexpr uint32_t all_kinds(EncodingList<Encoding...>, bool with_items_alone) {
  return ((Encoding::kHasItems || !with_items_alone ? kKindsOf<Encoding> : 0) | ...);
}

// Sets of kinds that have kernels (kernel_list.hpp).
inline constexpr uint32_t kPairSegment = kKindBit<SegmentEncoding, SegmentEncoding::kPairs>,
                          kSegments = kKindsOf<SegmentEncoding>,
                          kBvhObject = kKindBit<BvhEncoding, BvhEncoding::kExact>,
                          kSingleBvh = kKindBit<BvhEncoding, BvhEncoding::kSingle>,
                          kKindsWithItems = all_kinds(Encodings(), true),
                          kEveryKind = all_kinds(Encodings(), false),
                          kAnyKind = kEveryKind & ~kKindBit<BvhEncoding, BvhEncoding::kHoles>;

}  // namespace nif::kernels::gpu
