// The traversal of a BVH in SIMD. Boxes as kernels/reference/bvh/query.hpp tests them, eight at a time;
// triangles by its very functions.
//
// No include guard in the usual sense: compiled once for each target.
#if defined(NIF_BVH_TRAVERSE_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_BVH_TRAVERSE_INL
#undef NIF_BVH_TRAVERSE_INL
#else
#define NIF_BVH_TRAVERSE_INL
#endif

#include <cstddef>

#include <hwy/highway.h>

#include "kernels/reference/bvh/query.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using BoxFloats = hn::CappedTag<float, kBvhWidth>;
using BoxVector = hn::Vec<BoxFloats>;

/// Planes of some slots, seen from `origin`, in units of t.
HWY_INLINE BoxVector planes(BoxFloats d, const uint8_t* steps, hn::Vec<hn::Rebind<int32_t, BoxFloats>> frame,
                            float origin, float inverse) {
  const hn::Rebind<int32_t, BoxFloats> ints;
  const hn::Rebind<uint8_t, BoxFloats> bytes;
  const auto counted = hn::Add(hn::PromoteTo(ints, hn::LoadU(bytes, steps)), hn::ShiftRight<8>(frame));
  const BoxVector scale = hn::BitCast(d, hn::ShiftLeft<23>(hn::And(frame, hn::Set(ints, 255))));
  const BoxVector plane = hn::Mul(hn::ConvertTo(d, counted), scale);
  return hn::Mul(hn::Sub(plane, hn::Set(d, origin)), hn::Set(d, inverse));
}

/// The lower or upper planes along an axis, by arithmetic in place of a branch.
HWY_INLINE const uint8_t* planes_of(const BvhNode& node, int axis, bool upper) {
  static_assert(offsetof(BvhNode, high) == offsetof(BvhNode, low) + sizeof(node.low));
  return &node.low[0][0] + size_t(axis) * kBvhWidth + size_t(upper) * sizeof(node.low);
}

/// Tests all eight boxes of a node. Returns, bit by slot, the leaf slots that the ray may meet something in,
/// and puts the nodes of inner ones at `next`, where there is room for eight; `count` of them count. All
/// without a branch, because which boxes are met cannot be foreseen.
HWY_INLINE uint32_t meets_boxes(const BvhRay& ray, const BvhNode& node, uint32_t* next, uint32_t& count) {
  const BoxFloats d;
  const hn::Rebind<uint32_t, BoxFloats> words;
  const hn::Rebind<uint8_t, BoxFloats> bytes;
  uint32_t leaves = 0;
  count = 0;
  for (uint32_t first = 0; first < kBvhWidth; first += uint32_t(hn::Lanes(d))) {
    BoxVector enter = hn::Set(d, ray.enter), leave = hn::Set(d, ray.leave);
    for (int a = 0; a < 3; ++a) {
      const auto frame = hn::Set(hn::Rebind<int32_t, BoxFloats>(), int32_t(node.frame[a]));
      // No number here is NaN, so the order of operands of minimum and maximum does not matter.
      const uint8_t* entry = planes_of(node, a, ray.negative[a]) + first;
      const uint8_t* exit = planes_of(node, a, !ray.negative[a]) + first;
      enter = hn::Max(planes(d, entry, frame, ray.near[a], ray.inverse[a]), enter);
      leave = hn::Min(planes(d, exit, frame, ray.far[a], ray.inverse[a]), leave);
    }
    const auto slots = hn::PromoteTo(words, hn::LoadU(bytes, node.slots + first));
    const auto kinds = hn::ShiftRight<5>(slots), ranks = hn::And(slots, hn::Set(words, 31u));
    const auto met = hn::RebindMask(words, hn::Le(enter, leave));
    const auto inner = hn::Eq(kinds, hn::Set(words, kInnerSlot));
    const auto nodes = hn::Add(ranks, hn::Set(words, node.first_node));
    const auto met_inner = hn::And(met, inner);
    // Not CompressStore, which takes a hundred cycles on Zen 4.
    hn::StoreU(hn::Compress(nodes, met_inner), words, next + count);
    count += uint32_t(hn::CountTrue(words, met_inner));
    const auto leaf = hn::AndNot(inner, hn::Ne(kinds, hn::Zero(words)));
    uint8_t bits[8] = {};
    hn::StoreMaskBits(words, hn::And(met, leaf), bits);
    leaves |= uint32_t(bits[0]) << first;
  }
  return leaves;
}

HWY_INLINE bool traverse(const BvhField& field, const BvhRay& ray) {
  uint32_t stack[kBvhStack + kBvhWidth];
  uint32_t* top = stack;  // past the last entry
  for (uint32_t index = 0;; index = *--top) {
    const BvhNode& node = field.nodes[index];
    uint32_t count;
    for (uint32_t leaves = meets_boxes(ray, node, top, count); leaves != 0; leaves &= leaves - 1)
      if (meets_leaf(field, ray, node, node.slots[hwy::Num0BitsBelowLS1Bit_Nonzero32(leaves)])) return true;
    top += count;
    if (top == stack) return false;
  }
}

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
