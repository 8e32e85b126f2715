// Logs of one range of t for each ray: for `exact` and `proof` objects, which need no intervals. In place of
// a list of cells they keep two numbers a lane, so nothing is sorted at the end
// (docs/results/cpu-kernels.md).
//
// Compiled once for each target, so the include guard toggles.
#if defined(NIF_PLANES_RANGE_LOGS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_PLANES_RANGE_LOGS_INL
#undef NIF_PLANES_RANGE_LOGS_INL
#else
#define NIF_PLANES_RANGE_LOGS_INL
#endif

#include "kernels/cpu/planes/traversal_log-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

/// A range of t for each ray.
struct RangeLog : EndedRays {
  float begin[kBatchRays + kSlack], end[kBatchRays + kSlack];  ///< [end]
  alignas(64) float slot_begin[kSlots], slot_end[kSlots];      ///< of rays in traversal

  /// Sets both ends of the ranges, each for the chosen rays.
  HWY_INLINE void keep(hn::Vec<Floats> from, hn::Vec<Floats> to, hn::Mask<Floats> begins,
                       hn::Mask<Floats> ends, uint32_t at) {
    const Floats d;
    hn::Store(hn::IfThenElse(begins, from, hn::Load(d, slot_begin + at)), d, slot_begin + at);
    hn::Store(hn::IfThenElse(ends, to, hn::Load(d, slot_end + at)), d, slot_end + at);
  }
  HWY_INLINE void finish(const LanesTogether& together, hn::Vec<Ints> info, uint32_t at,
                         const LogCounts& counts) {
    const Floats d;
    hn::StoreU(together(info), Ints(), end_info + counts.ends);
    hn::StoreU(together(hn::Load(d, slot_begin + at)), d, begin + counts.ends);
    hn::StoreU(together(hn::Load(d, slot_end + at)), d, end + counts.ends);
  }
};

/// Keeps of rays that are left open the range from their first open cell to their last, as an OpenInterval.
struct OpenRangeLog : RangeLog {
  static constexpr bool kInOrder = false;

  HWY_INLINE void start(const RaySetup<kInOrder>&, uint32_t) {}
  HWY_INLINE void pass(const Passage& passage, uint32_t at, LogCounts&) {
    keep(passage.rays.now, passage.left, hn::And(passage.open, passage.first_open()), passage.open, at);
  }

  HWY_INLINE void collect(const LogCounts& counts, AnswerBatch& answers, HardRays&) {
    const Floats d;
    const Ints di;
    uint32_t kept = 0;
    for (uint32_t i = 0; i < counts.ends; i += kLanes) {
      const auto present = hn::RebindMask(di, hn::FirstN(d, counts.ends - i));
      const auto info = hn::Load(di, end_info + i);
      const auto from = hn::Load(d, begin + i), to = hn::Load(d, end + i);
      const auto blocked = hn::And(present, is_blocked(info));
      for_rays(info, blocked, [&](uint32_t ray) { answers.logit[ray] = -kCertainLogit; });
      const uint32_t open = bits_of(hn::AndNot(blocked, present));
      const LanesTogether together(open);
      // Not beyond what has been read.
      hn::StoreU(together(info), di, end_info + kept);
      hn::StoreU(together(from), d, begin + kept);
      hn::StoreU(together(to), d, end + kept);
      kept += uint32_t(__builtin_popcount(open));
    }
    count = kept;
  }
};

/// Keeps of rays that are blocked or left open the range that holds their first hit.
struct FirstHitRangeLog : RangeLog {
  static constexpr bool kInOrder = true;

  HWY_INLINE void start(const RaySetup<kInOrder>&, uint32_t) {}
  HWY_INLINE void pass(const Passage&, uint32_t, const LogCounts&) {}
  HWY_INLINE void block(const Blocked& blocked, uint32_t at) {
    const Passage& passage = blocked.passage;
    const auto& open = passage.open;
    const auto counts = hn::Or(open, hn::And(blocked.rays, passage.active));
    keep(hn::IfThenElse(open, passage.rays.now, blocked.last_enter()),
         hn::IfThenElse(open, passage.left, blocked.last_leave()), hn::And(counts, passage.first_open()),
         counts, at);
  }
  HWY_INLINE void collect(const LogCounts& counts, AnswerBatch&, HardRays&) { count = counts.ends; }
};

static_assert(TraversalLog<OpenRangeLog> && TraversalLog<FirstHitRangeLog>);

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
