// The walk as a thread of a GPU does it: by leaps over voxels that are alike, and from cell to cell, to the
// bits of kernels/reference/proof/walk.hpp.
//
// A leap ends at the crossing at which the segment leaves the box that the voxel's word vouches for; a cell
// is left at the nearest of its own planes. Where the other axes stand then follows from their own crossings,
// counted in the reference's order (t, then the lower axis): an estimate from below that is off by at most
// one finest cell is put right by one such comparison. Along an axis that goes down cells and planes are
// counted by their negatives, so that every ray walks upward.
//
// Places are whole numbers in floats: conversions are slow on GPUs, and few registers are to hold a ray.
#pragma once

#include "kernels/gpu/device_memory.hpp"
#include "kernels/packed/walk_words.hpp"
#include "kernels/reference/proof/walk.hpp"

namespace nif::kernels::gpu {

/// a b + c in one instruction, where it does not matter whether the product is rounded by itself: because it
/// is exact, or the sum an estimate.
NIF_HOST_DEVICE inline float multiply_add(float a, float b, float c) {
#if defined(NIF_ON_DEVICE)
  return __builtin_fmaf(a, b, c);
#else
  return a * b + c;
#endif
}

// In one instruction: the other number where one is NaN, and of two zeros either.
NIF_HOST_DEVICE inline float smaller(float a, float b) { return __builtin_fminf(a, b); }
NIF_HOST_DEVICE inline float larger(float a, float b) { return __builtin_fmaxf(a, b); }

/// n + 2^23 as a float, n below 2^23: the lowest bits are those of n.
NIF_HOST_DEVICE inline float on_integers(uint32_t n) { return bits_as<float>(0x4b000000u | n); }

/// The walk of one segment by the words of its field, of whose arrays none is read: what follow_segment()
/// finds out, with the same runs in the same order. kInOrder as follow_segment() has it; what a leap passes
/// is alike, so what it proves is known where it begins. `walk` is always the same.
template <bool kInOrder = false>
class LeapingWalk {
 public:
  /// False where the walk is over.
  NIF_HOST_DEVICE bool begin(const ProofField& field, const Segment& segment, WalkResult& walk) {
    runs_ = {};
    if (!enter_grid(field, segment, walk, passage_)) return false;
    NIF_UNROLL
    for (uint32_t a = 0; a < 3; ++a) {
      const bool down = sign(walk, a) < 0;
      cell_[a] = static_cast<float>(down ? -1 - passage_.cell[a] : passage_.cell[a]);
    }
    // From too far away for estimates that are off by one cell at most: every plane on the way is looked at.
    near_ = walk.certain;
    seen_ = !kInOrder ? passage_.seen : passage_.enters_grid ? uint32_t(kSeenOutside) : 0u;
    now_ = passage_.enter;
    return true;
  }

  /// One leap, or one cell. `look` is called with the number of words that were read for it. False where the
  /// walk is over.
  template <class AddRun, class Look>
  NIF_HOST_DEVICE NIF_INLINE bool go_on(const ProofField& field, const WalkWords& words, WalkResult& walk,
                                        const AddRun& add_run, const Look& look) {
    const float slack = near_ ? kEstimateSlack : bits_as<float>(0x7f800000u);
    // Compilers are to know that these are so small that products of them are simple.
    constexpr uint32_t kFewVoxels = 2 * kMaxVoxels - 1;
    const uint32_t row = field.voxels[0] & kFewVoxels, layer = row * (field.voxels[1] & kFewVoxels);
    const uint32_t levels = field.levels;
    uint32_t at[3];
    NIF_UNROLL
    for (uint32_t a = 0; a < 3; ++a)
      at[a] =
          bits_as<uint32_t>(multiply_add(sign(walk, a), cell_[a] + 0.5f, 0x1p23f - 0.5f)) & (kMaxCells - 1);
    uint32_t word =
        load_device(words.voxels, (at[0] >> levels) + row * (at[1] >> levels) + layer * (at[2] >> levels));
    uint32_t level = levels, loads = 1;
    while (word_kind(word) == kLink) {
      --level;
      const uint32_t part = (at[0] >> level & 1) | (at[1] >> level & 1) << 1 | (at[2] >> level & 1) << 2;
      const bool there = link_mask(word) >> part & 1;
      word = there ? load_device(words.parts, link_part(word, part)) : kEmptyPart;
      loads += there;
    }
    look(loads);

    // Where the segment leaves the box or the cell.
    const bool empty = word_kind(word) == kEmptyVoxel;
    const float size = bits_as<float>((127 + level) << 23);
    const uint32_t box = (empty & near_) ? word : 0;
    float middle[3], exit[3];
    NIF_UNROLL
    for (uint32_t a = 0; a < 3; ++a) {
      middle[a] = on_integers(at[a] >> level << level) - (0x1p23f - 0.5f * size);
      const float extent = on_integers(extent_of(box, a, sign(walk, a) > 0)) - (0x1p23f - 0.5f);
      // Infinite along an axis that is not moved along, or NaN where the segment lies on the grid's far side.
      exit[a] =
          (multiply_add(sign(walk, a), extent * size, middle[a]) - walk.origin[a]) * passage_.inverse[a];
    }
    const float t = smaller(smaller(exit[0], exit[1]), exit[2]);
    const bool ends = !(t < passage_.leave);
    const float left = max_of(ends ? passage_.leave : t, now_);

    bool blocked = false;
    if (empty) {
      seen_ |= empty_side(word);
    } else {
      const CellPassage passed = pass_cell(word, middle, size, walk.origin, walk.direction, now_, left);
      blocked = passed.blocked;
      seen_ |= passed.seen;
      if (passed.open) runs_.add(passed, word, now_, left, passage_, walk, add_run);
    }
    const bool within = blocked | (seen_ == kSeenBoth);
    if (kInOrder && ends && passage_.leaves_grid) seen_ |= kSeenOutside;
    if (within | (kInOrder & (seen_ == kSeenBoth))) {
      walk.verdict = Verdict::occluded;
      if (kInOrder) {
        walk.last_enter = (within ? now_ : left) + 0.0f;
        walk.last_leave = (within && empty ? now_ : left) + 0.0f;
      }
      return false;
    }
    now_ = left;
    if (ends) {
      end_walk(runs_, seen_, walk);
      return false;
    }

    // In the reference's order the crossing of a lower axis at the same t comes first.
    const bool by_0 = exit[0] == t, by_1 = exit[1] == t;
    NIF_UNROLL
    for (uint32_t a = 0; a < 3; ++a) {
      const float reached = multiply_add(walk.direction[a], t, walk.origin[a]);
      const float estimate = round_down(multiply_add(sign(walk, a), reached, -slack));
      const bool later = (a > 0 && by_0) | (a > 1 && by_1);
      float before = larger(estimate, cell_[a]);
      for (;;) {
        const float plane = before + 1;
        const float crossed_at = multiply_add(sign(walk, a), plane, -walk.origin[a]) * passage_.inverse[a];
        const bool crossed = (crossed_at < t) | ((crossed_at == t) & !later);
        before = crossed ? plane : before;
        // From far away several planes may be crossed at the same t; the last one is that of the cell.
        if (near_ | !crossed) break;
        const float share = before * bits_as<float>((127 - level) << 23);
        if (round_down(share) == share) break;
      }
      cell_[a] = before;
    }
    return true;
  }

 private:
  // Found anew each time: that takes fewer registers.
  NIF_HOST_DEVICE static float sign(const WalkResult& walk, uint32_t a) {
    return __builtin_copysignf(1.0f, walk.direction[a]);
  }

  GridPassage passage_;
  RunRecord runs_;
  float cell_[3];
  float now_;
  uint32_t seen_;
  bool near_;
};

/// Walks one segment. `look` is called for each leap and each cell.
template <bool kInOrder = false, class AddRun, class Look>
NIF_HOST_DEVICE void leap_segment(const ProofField& field, const WalkWords& words, const Segment& segment,
                                  WalkResult& walk, const AddRun& add_run, const Look& look) {
  LeapingWalk<kInOrder> leaping;
  if (!leaping.begin(field, segment, walk)) return;
  while (leaping.go_on(field, words, walk, add_run, look)) {
  }
}

/// The one way in which kernels walk.
template <bool kInOrder = false, class AddRun>
NIF_HOST_DEVICE void walk_object(const ProofField& field, const WalkWords& words, const Segment& segment,
                                 WalkResult& walk, const AddRun& add_run) {
  leap_segment<kInOrder>(field, words, segment, walk, add_run, [](uint32_t) {});
}

}  // namespace nif::kernels::gpu
