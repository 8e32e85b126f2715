// DDA traversal by one GPU thread, with empty-space skipping, and with the bits of
// kernels/reference/planes/grid_traversal.hpp.
//
// A skip ends at the crossing at which the segment leaves the box in the voxel's word; a cell is left at the
// nearest of its planes. The crossings of the other axes then give the position along each of them, counted
// in the reference's order (t, then the lower axis): an estimate from below that is at most one finest cell
// too low is corrected by one such comparison. Along an axis with negative direction, cells and planes are
// counted by their negatives, so that every ray moves upward.
//
// Positions are integers stored in floats: conversions are slow on GPUs, and a ray must fit in few registers.
#pragma once

#include "kernels/gpu/device_memory.hpp"
#include "kernels/packed/traversal_words.hpp"
#include "kernels/reference/planes/grid_traversal.hpp"

namespace nif::kernels::gpu {

/// a b + c in one instruction, for cases in which rounding the product separately does not matter: because it
/// is exact, or the sum is an estimate.
NIF_HOST_DEVICE inline float multiply_add(float a, float b, float c) {
#if defined(NIF_ON_DEVICE)
  return __builtin_fmaf(a, b, c);
#else
  return a * b + c;
#endif
}

// In one instruction: the other number if one is NaN, and either of two zeros.
NIF_HOST_DEVICE inline float smaller(float a, float b) { return __builtin_fminf(a, b); }
NIF_HOST_DEVICE inline float larger(float a, float b) { return __builtin_fmaxf(a, b); }

/// n + 2^23 as a float, for n < 2^23: its lowest bits are those of n.
NIF_HOST_DEVICE inline float on_integers(uint32_t n) { return bits_as<float>(0x4b000000u | n); }

/// Starts a traversal with skipping: the first finest cell. Negative along an axis with negative direction.
NIF_HOST_DEVICE NIF_INLINE void begin_skipping(const TraversalResult& traversal, const GridPassage& passage,
                                               float (&cell)[3]) {
  NIF_UNROLL
  for (uint32_t a = 0; a < 3; ++a) {
    const bool down = __builtin_copysignf(1.0f, traversal.direction[a]) < 0;
    cell[a] = static_cast<float>(down ? -1 - passage.cell[a] : passage.cell[a]);
  }
}
/// SeenBits before it.
template <bool kInOrder>
NIF_HOST_DEVICE NIF_INLINE uint32_t seen_before(const GridPassage& passage) {
  return !kInOrder ? passage.seen : passage.enters_grid ? uint32_t(kSeenOutside) : 0u;
}

/// One skip, or one cell, from `now` on, in the finest cell `cell`. `near`: the traversal was certain when it
/// began. Returns false if the traversal is over.
template <bool kInOrder, class AddInterval, class Look>
NIF_HOST_DEVICE NIF_INLINE bool next_skip(const PlanesField& field, const TraversalWords& words,
                                          TraversalResult& traversal, const GridPassage& passage, bool near,
                                          float (&cell)[3], float& now, uint32_t& seen,
                                          IntervalRecord& intervals, const AddInterval& add_interval,
                                          const Look& look) {
  // From too far away estimates may be off by more than one cell: then every plane on the way is tested.
  const float slack = near ? kEstimateSlack : bits_as<float>(0x7f800000u);
  // Tells compilers that these are so small that their products are simple.
  constexpr uint32_t kFewVoxels = 2 * kMaxVoxels - 1;
  const uint32_t row = field.voxels[0] & kFewVoxels, layer = row * (field.voxels[1] & kFewVoxels);
  const uint32_t levels = field.levels;
  // Recomputed each time: that takes fewer registers.
  const auto sign = [&](uint32_t a) { return __builtin_copysignf(1.0f, traversal.direction[a]); };
  uint32_t at[3];
  NIF_UNROLL
  for (uint32_t a = 0; a < 3; ++a)
    at[a] = bits_as<uint32_t>(multiply_add(sign(a), cell[a] + 0.5f, 0x1p23f - 0.5f)) & (kMaxCells - 1);
  uint32_t word =
      load_device(words.voxels, (at[0] >> levels) + row * (at[1] >> levels) + layer * (at[2] >> levels));
  uint32_t level = levels, loads = 1;
  while (word_kind(word) == kLink) {
    --level;
    const uint32_t child = (at[0] >> level & 1) | (at[1] >> level & 1) << 1 | (at[2] >> level & 1) << 2;
    const bool there = link_mask(word) >> child & 1;
    word = there ? load_device(words.children, link_child(word, child)) : kEmptyChild;
    loads += there;
  }
  look(loads);

  // Where the segment leaves the box or the cell.
  const bool empty = word_kind(word) == kEmptyVoxel;
  const float size = bits_as<float>((127 + level) << 23);
  const uint32_t box = (empty & near) ? word : 0;
  float middle[3], exit[3];
  NIF_UNROLL
  for (uint32_t a = 0; a < 3; ++a) {
    middle[a] = on_integers(at[a] >> level << level) - (0x1p23f - 0.5f * size);
    const float extent = on_integers(extent_of(box, a, sign(a) > 0)) - (0x1p23f - 0.5f);
    // Infinite along an axis without movement, or NaN if the segment lies on the grid's far side.
    exit[a] = (multiply_add(sign(a), extent * size, middle[a]) - traversal.origin[a]) * passage.inverse[a];
  }
  const float t = smaller(smaller(exit[0], exit[1]), exit[2]);
  const bool ends = !(t < passage.leave);
  const float left = max_of(ends ? passage.leave : t, now);

  bool blocked = false;
  if (empty) {
    seen |= empty_side(word);
  } else {
    const CellPassage passed =
        pass_cell(word, middle, size, traversal.origin, traversal.direction, now, left);
    blocked = passed.blocked;
    seen |= passed.seen;
    if (passed.open) intervals.add(passed, word, now, left, passage, traversal, add_interval);
  }
  const bool within = blocked | (seen == kSeenBoth);
  if (kInOrder && ends && passage.leaves_grid) seen |= kSeenOutside;
  if (within | (kInOrder & (seen == kSeenBoth))) {
    traversal.verdict = Verdict::occluded;
    if (kInOrder) {
      traversal.last_enter = (within ? now : left) + 0.0f;
      traversal.last_leave = (within && empty ? now : left) + 0.0f;
    }
    return false;
  }
  now = left;
  if (ends) {
    end_traversal(intervals, seen, traversal);
    return false;
  }

  // In the reference's order the crossing of a lower axis at the same t comes first.
  const bool by_0 = exit[0] == t, by_1 = exit[1] == t;
  NIF_UNROLL
  for (uint32_t a = 0; a < 3; ++a) {
    const float reached = multiply_add(traversal.direction[a], t, traversal.origin[a]);
    const float estimate = round_down(multiply_add(sign(a), reached, -slack));
    const bool later = (a > 0 && by_0) | (a > 1 && by_1);
    float before = larger(estimate, cell[a]);
    for (;;) {
      const float plane = before + 1;
      const float crossed_at = multiply_add(sign(a), plane, -traversal.origin[a]) * passage.inverse[a];
      const bool crossed = (crossed_at < t) | ((crossed_at == t) & !later);
      before = crossed ? plane : before;
      // From far away several planes may be crossed at the same t; the last one belongs to the cell.
      if (near | !crossed) break;
      const float share = before * bits_as<float>((127 - level) << 23);
      if (round_down(share) == share) break;
    }
    cell[a] = before;
  }
  return true;
}

/// Traverses one segment by the words of its field and reads none of the field's arrays. The result is that
/// of follow_segment(), with the same intervals in the same order. Calls `look` for each skip and each cell,
/// with the number of words that were read for it. kInOrder: as for follow_segment(); everything that a skip
/// passes is alike, so what it proves is known at its start.
template <bool kInOrder = false, class AddInterval, class Look>
NIF_HOST_DEVICE void traverse_skipping(const PlanesField& field, const TraversalWords& words,
                                       const Segment& segment, TraversalResult& traversal,
                                       const AddInterval& add_interval, const Look& look) {
  GridPassage passage;
  if (!enter_grid(field, segment, traversal, passage)) return;
  const bool near = traversal.certain;
  float cell[3], now = passage.enter;
  begin_skipping(traversal, passage, cell);
  IntervalRecord intervals;
  uint32_t seen = seen_before<kInOrder>(passage);
  while (next_skip<kInOrder>(field, words, traversal, passage, near, cell, now, seen, intervals, add_interval,
                             look)) {
  }
}

/// The same traversal, interruptible after each skip so that others can start or continue. `traversal` must
/// always be the same.
class SkippingTraversal {
 public:
  /// Returns false if the traversal is over.
  NIF_HOST_DEVICE NIF_INLINE bool begin(const PlanesField& field, const Segment& segment,
                                        TraversalResult& traversal) {
    if (!enter_grid(field, segment, traversal, passage_)) return false;
    near_ = traversal.certain;
    begin_skipping(traversal, passage_, cell_);
    now_ = passage_.enter;
    seen_ = seen_before<false>(passage_);
    intervals_ = {};
    return true;
  }
  /// Returns false if the traversal is over.
  template <class AddInterval>
  NIF_HOST_DEVICE NIF_INLINE bool go_on(const PlanesField& field, const TraversalWords& words,
                                        TraversalResult& traversal, const AddInterval& add_interval) {
    return next_skip<false>(field, words, traversal, passage_, near_, cell_, now_, seen_, intervals_,
                            add_interval, [](uint32_t) {});
  }

 private:
  GridPassage passage_;
  IntervalRecord intervals_;
  float cell_[3];
  float now_;
  uint32_t seen_;
  bool near_;
};

/// The only form of traversal that kernels use.
template <bool kInOrder = false, class AddInterval>
NIF_HOST_DEVICE void traverse_object(const PlanesField& field, const TraversalWords& words,
                                     const Segment& segment, TraversalResult& traversal,
                                     const AddInterval& add_interval) {
  traverse_skipping<kInOrder>(field, words, segment, traversal, add_interval, [](uint32_t) {});
}

}  // namespace nif::kernels::gpu
