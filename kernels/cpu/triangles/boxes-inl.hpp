// Tests the boxes of a node, eight at a time or as many as a vector holds.
//
// A plane is (base + step) scale, so t = step (scale inverse) + (base scale inverse + near): one conversion
// and one multiply-add per plane. The factors of the three axes are computed together, as Ylitie, Karras and
// Laine propose (HPG 2017).
//
// Compiled once for each target.
#if defined(NIF_BVH_BOXES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_BVH_BOXES_INL
#undef NIF_BVH_BOXES_INL
#else
#define NIF_BVH_BOXES_INL
#endif

#include <hwy/highway.h>

#include <limits>

#include "kernels/cpu/triangles/rays-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

/// For a node's slots.
using Slots = hn::CappedTag<float, kBvhWidth>;
using SlotInts = hn::RebindToSigned<Slots>;
constexpr uint32_t kFewestSlots = 4;  ///< in a vector

/// Four words from any address, in every block of a vector.
HWY_INLINE hn::Vec<SlotInts> load_blocks(const uint32_t* from) {
#if HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX2
  return hn::Vec<SlotInts>{
      _mm256_broadcastsi128_si256(_mm_loadu_si128(reinterpret_cast<const __m128i*>(from)))};
#else
  return hn::BitCast(SlotInts(), hn::LoadU(hn::RebindToUnsigned<Slots>(), from));
#endif
}

/// The slots of a node, as bits.
struct SlotSets {
  uint32_t inner, leaves;
};
HWY_INLINE SlotSets slot_sets(const BvhNode& node) {
  // Of the kinds, only kInnerSlot has both upper bits set.
  static_assert(kInnerSlot == 7 && kBvhLeafTriangles == 4);
#if HWY_TARGET == HWY_AVX3
  const __m128i slots = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(node.slots));
  const uint32_t inner =
      bits_of_register(_mm_cmpge_epu8_mask(slots, _mm_set1_epi8(char(make_slot(kInnerSlot, 0)))));
  return {inner, bits_of_register(_mm_test_epi8_mask(slots, slots)) & ~inner};
#elif HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_SSE4
  const __m128i slots = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(node.slots));
  const auto inner = uint32_t(_mm_movemask_epi8(_mm_and_si128(slots, _mm_add_epi8(slots, slots))));
  const auto empty = uint32_t(_mm_movemask_epi8(_mm_cmpeq_epi8(slots, _mm_setzero_si128())));
  return {inner, ~(inner | empty)};
#else
  const auto top_bits = [](uint64_t bytes) {
    return uint32_t((bytes & 0x8080808080808080u) * 0x0002040810204081u >> 56);
  };
  uint64_t slots;
  std::memcpy(&slots, node.slots, sizeof(slots));
  const uint32_t inner = top_bits(slots & slots << 1);
  return {inner, top_bits(slots | slots << 1 | slots << 2) & ~inner};
#endif
}

/// The slots whose boxes the ray may meet something in, as bits; undefined for empty slots. `entries`: null,
/// or receives where each box is entered.
HWY_INLINE uint32_t meets_boxes(const BvhNode& node, const ReadyRay& ray, float* entries = nullptr) {
  const Slots d;
  const SlotInts di;
  const hn::Rebind<uint8_t, Slots> bytes;
  // By axis, in every block; the fourth lanes are undefined.
  static_assert(offsetof(BvhNode, first_node) == offsetof(BvhNode, frame) + 12);
  const auto frame = load_blocks(node.frame);
  const auto scale = hn::BitCast(d, hn::ShiftLeft<23>(hn::And(frame, hn::Set(di, 255))));
  const auto base = hn::ConvertTo(d, hn::ShiftRight<8>(frame));
  const auto step = hn::Mul(scale, hn::LoadDup128(d, ray.inverse));
  const auto near = hn::MulAdd(base, step, hn::LoadDup128(d, ray.near));
  const auto far = hn::MulAdd(base, step, hn::LoadDup128(d, ray.far));
  const hn::Vec<Slots> steps[3] = {hn::Broadcast<0>(step), hn::Broadcast<1>(step), hn::Broadcast<2>(step)};
  const hn::Vec<Slots> nears[3] = {hn::Broadcast<0>(near), hn::Broadcast<1>(near), hn::Broadcast<2>(near)};
  const hn::Vec<Slots> fars[3] = {hn::Broadcast<0>(far), hn::Broadcast<1>(far), hn::Broadcast<2>(far)};
  uint32_t met = 0;
  for (uint32_t first = 0; first < kBvhWidth; first += uint32_t(hn::Lanes(d))) {
    auto enter = hn::Set(d, ray.limits[0]), leave = hn::Set(d, ray.limits[1]);
    for (uint32_t a = 0; a < 3; ++a) {
      const auto* const entry = reinterpret_cast<const uint8_t*>(&node) + ray.entry[a] + first;
      const auto* const exit = reinterpret_cast<const uint8_t*>(&node) + ray.exit[a] + first;
      const auto from = hn::ConvertTo(d, hn::PromoteTo(di, hn::LoadU(bytes, entry)));
      const auto to = hn::ConvertTo(d, hn::PromoteTo(di, hn::LoadU(bytes, exit)));
      // No number here is NaN, so the order of operands of minimum and maximum does not matter.
      enter = hn::Max(hn::MulAdd(from, steps[a], nears[a]), enter);
      leave = hn::Min(hn::MulAdd(to, steps[a], fars[a]), leave);
    }
    if (entries) hn::Store(enter, d, entries + first);
    met |= bits_of_mask(Slots(), hn::Le(enter, leave)) << first;
  }
  return met;
}

/// Of the given slots, at least one, the one whose box is entered first, as a bit; any of several equal ones.
HWY_INLINE uint32_t nearest_slot(const float* entries, uint32_t slots) {
  const Slots d;
  alignas(32) static constexpr uint32_t kBits[kBvhWidth] = {1, 2, 4, 8, 16, 32, 64, 128};
  const hn::RebindToUnsigned<Slots> dw;
  const auto chosen = hn::Set(dw, slots);
  const auto farthest = hn::Set(d, std::numeric_limits<float>::infinity());
  auto nearest = farthest;
  hn::Vec<Slots> entry[kBvhWidth / kFewestSlots];
  for (uint32_t first = 0, i = 0; first < kBvhWidth; first += uint32_t(hn::Lanes(d)), ++i) {
    const auto some = hn::RebindMask(d, hn::TestBit(chosen, hn::Load(dw, kBits + first)));
    entry[i] = hn::IfThenElse(some, hn::Load(d, entries + first), farthest);
    nearest = hn::Min(nearest, entry[i]);
  }
  nearest = hn::MinOfLanes(d, nearest);
  uint32_t equal = 0;
  for (uint32_t first = 0, i = 0; first < kBvhWidth; first += uint32_t(hn::Lanes(d)), ++i)
    equal |= bits_of_mask(Slots(), hn::Eq(entry[i], nearest)) << first;
  equal &= slots;
  return equal & (0 - equal);
}

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
