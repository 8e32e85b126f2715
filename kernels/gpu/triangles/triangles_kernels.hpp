// The exact `bvh` objects on GPUs. kernels/reference/triangles/triangles_query.hpp tests boxes and triangles;
// this file only chooses the order of nodes, which changes no answer.
#pragma once

#include "kernels/gpu/object.hpp"
#include "kernels/gpu/shim.hpp"
#include "kernels/reference/triangles/triangles_hit.hpp"
#include "kernels/reference/triangles/triangles_query.hpp"

namespace nif::kernels::gpu {

/// The slots whose boxes the ray may meet, one bit each. Reads planes as words, four slots at a time.
template <class Real>
NIF_HOST_DEVICE uint32_t meets_slots(const BvhRayOf<Real>& ray, const BvhNode& node) {
  uint32_t met = 0;
  NIF_UNROLL
  for (uint32_t half = 0; half < kBvhWidth; half += 4) {
    const uint32_t slots = load_word(node.slots + half);
    if (slots == 0) break;
    uint32_t low[3], high[3];
    NIF_UNROLL
    for (int a = 0; a < 3; ++a) {
      low[a] = load_word(node.low[a] + half);
      high[a] = load_word(node.high[a] + half);
    }
    NIF_UNROLL
    for (uint32_t s = 0; s < 4; ++s) {
      const uint8_t below[3] = {uint8_t(low[0] >> 8 * s), uint8_t(low[1] >> 8 * s), uint8_t(low[2] >> 8 * s)};
      const uint8_t above[3] = {uint8_t(high[0] >> 8 * s), uint8_t(high[1] >> 8 * s),
                                uint8_t(high[2] >> 8 * s)};
      if ((slots >> 8 * s & 255) != 0 && meets_planes(ray, node.frame, below, above)) met |= 1u << (half + s);
    }
  }
  return met;
}

/// Where the ray enters a slot's box, or would; approximate.
NIF_HOST_DEVICE inline float enters_slot(const BvhRay& ray, const BvhNode& node, uint32_t slot) {
  float enter = ray.enter;
  NIF_UNROLL
  for (int a = 0; a < 3; ++a) {
    const uint8_t step = ray.negative[a] ? node.high[a][slot] : node.low[a][slot];
    enter = max_of((frame_plane(node.frame[a], step) - ray.near[a]) * ray.inverse[a], enter);
  }
  return enter;
}

/// Words of the stack for a tree with this many levels. After Ylitie, Karras and Laine (HPG 2017): an entry,
/// of two words, holds all inner slots of a node that are still to be visited, so there are at most as many
/// entries as nodes on the way down.
NIF_HOST_DEVICE constexpr uint32_t bvh_stack_words(uint32_t levels) { return 2 * levels; }

/// Like meets_bvh(). `stack` is the thread's own, of words kStride apart. `blocks`: see AllTriangles.
template <uint32_t kStride, class Real, class Blocks = AllTriangles>
NIF_HOST_DEVICE bool meets_nodes(const TrianglesField& field, const BvhRayOf<Real>& ray, uint32_t* stack,
                                 const Blocks& blocks = {}) {
  uint32_t size = 0, number = 0;  // words on the stack: the node of slots, and their ranks as bits
  for (;;) {
    const BvhNode& node = field.nodes[number];
    uint32_t inner = 0;
    for (uint32_t met = meets_slots(ray, node); met != 0; met &= met - 1) {
      const uint8_t slot = node.slots[count_bits((met & -met) - 1)];
      if (slot_kind(slot) == kInnerSlot)
        inner |= 1u << slot_rank(slot);
      else if (meets_leaf(field, ray, node, slot, blocks))
        return true;
    }
    if (inner != 0) {
      stack[size * kStride] = node.first_node;
      stack[(size + 1) * kStride] = inner;
      size += 2;
    }
    if (size == 0) return false;
    const uint32_t ranks = stack[(size - 1) * kStride], rest = ranks & (ranks - 1);
    number = stack[(size - 2) * kStride] + count_bits((ranks & -ranks) - 1);
    stack[(size - 1) * kStride] = rest;
    if (rest == 0) size -= 2;
  }
}

/// `stack`: as for meets_nodes(). Real: as for BvhRayOf.
template <uint32_t kStride, class Real = double, class Blocks = AllTriangles>
NIF_HOST_DEVICE ObjectAnswer answer_bvh_ray(const TrianglesField& field, const Segment& segment,
                                            uint32_t* stack, const Blocks& blocks = {}) {
  BvhRayOf<Real> ray;
  if (!prepare_ray(field, segment, ray)) {
    const Answer none = answer_no_ray(segment);
    return {none.logit, none.certain};
  }
  return {meets_nodes<kStride>(field, ray, stack, blocks) ? -kCertainLogit : kCertainLogit,
          certain_bvh(field, segment)};
}

/// Like find_nearest(); `stack`: as for meets_nodes(). Of a node's children, the one that the ray enters
/// first is visited next: a hit there culls the boxes behind.
template <uint32_t kStride, class Blocks = AllTriangles>
NIF_HOST_DEVICE void find_nearest_nodes(const TrianglesField& field, BvhRay& ray, uint32_t* stack,
                                        NearestTriangle& nearest, const Blocks& blocks = {}) {
  uint32_t size = 0, number = 0;
  for (;;) {
    const BvhNode& node = field.nodes[number];
    uint32_t inner = 0, next = 0;
    float soonest = kNoHit;
    for (uint32_t met = meets_slots(ray, node); met != 0; met &= met - 1) {
      const uint32_t s = count_bits((met & -met) - 1);
      const uint8_t slot = node.slots[s];
      if (slot_kind(slot) != kInnerSlot) {
        look_at_leaf(field, ray, node, slot, nearest, blocks);
        leave_at(nearest, ray);
        continue;
      }
      const uint32_t rank = slot_rank(slot);
      const float enter = enters_slot(ray, node, s);
      if (inner == 0 || enter < soonest) soonest = enter, next = rank;
      inner |= 1u << rank;
    }
    if (inner != 0) {
      const uint32_t rest = inner & ~(1u << next);
      number = node.first_node + next;
      if (rest == 0) continue;
      stack[size * kStride] = node.first_node;
      stack[(size + 1) * kStride] = rest;
      size += 2;
      continue;
    }
    if (size == 0) return;
    const uint32_t ranks = stack[(size - 1) * kStride], rest = ranks & (ranks - 1);
    number = stack[(size - 2) * kStride] + count_bits((ranks & -ranks) - 1);
    stack[(size - 1) * kStride] = rest;
    if (rest == 0) size -= 2;
  }
}

/// Like nearest_hit(), for a prepared segment.
template <uint32_t kStride, class Blocks = AllTriangles>
NIF_HOST_DEVICE Hit nearest_bvh_hit(const TrianglesField& field, const Segment& segment, float limit,
                                    BvhRay& ray, uint32_t* stack, const Blocks& blocks = {}) {
  leave_at(limit, ray);
  NearestTriangle nearest;
  find_nearest_nodes<kStride>(field, ray, stack, nearest, blocks);
  return hit_of(field, nearest, certain_bvh(field, segment));
}

/// Like intersect(). `stack`: as for meets_nodes().
template <uint32_t kStride, class Blocks = AllTriangles>
NIF_HOST_DEVICE Hit find_bvh_hit(const TrianglesField& field, const Segment& segment, float limit,
                                 uint32_t* stack, const Blocks& blocks = {}) {
  BvhRay ray;
  if (!prepare_ray(field, segment, ray)) return no_hit(answer_no_ray(segment).certain);
  return nearest_bvh_hit<kStride>(field, segment, limit, ray, stack, blocks);
}

}  // namespace nif::kernels::gpu
