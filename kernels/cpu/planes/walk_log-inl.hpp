// Records what the SIMD traversal finds, and turns it into answers and the intervals of the rays that are
// left open.
//
// Compiled once for each target, so the include guard toggles.
#if defined(NIF_SEGMENT_WALK_LOG_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_SEGMENT_WALK_LOG_INL
#undef NIF_SEGMENT_WALK_LOG_INL
#else
#define NIF_SEGMENT_WALK_LOG_INL
#endif

#include <cstring>

#include "kernels/cpu/lanes-inl.hpp"
#include "kernels/reference/object_kernel.hpp"
#include "kernels/reference/planes/walk.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

/// Open parts that are logged before answers are collected. If the open parts of a few rays exceed this, the
/// reference answers those rays.
inline constexpr uint32_t kMaxOpenParts = 3 * kBatchRays;
/// Intervals of one ray that the network's stage has room for.
inline constexpr uint32_t kMaxPendingRuns = 32;

/// Flags of a ray of the batch.
enum RayFlags : int32_t { kFlatAxis = 1, kEntersGrid = 8, kLeavesGrid = 16 };

/// What is known about a ray in traversal, in one word.
enum RayInfo : int32_t {
  kOctant = 7,     ///< axes whose direction is negative
  kSeenShift = 3,  ///< of the SeenBits
  kSeenSides = kSeenBoth << kSeenShift,
  kHasRun = 1 << 5,       ///< some piece was open
  kIncomplete = 1 << 6,   ///< its open parts are not all in the log
  kEndsOutside = 1 << 7,  ///< for in-order traversal: the ray leaves the grid
  kRayShift = 8           ///< its number in the batch
};

/// Vectors are always read and written whole, even if the last entries are fewer.
inline constexpr uint32_t kSlack = 16;

/// Rays that a traversal leaves open: the first `count` ends of its log belong to them.
struct OpenRays {
  uint32_t count;
  alignas(64) int32_t runs[kBatchRays + kSlack];  ///< number of intervals
  int32_t first[kBatchRays + kSlack];             ///< index of the first one in the arrays below
  float begin[kMaxOpenParts], end[kMaxOpenParts];
  int32_t heights[kMaxOpenParts];
};

/// What happens during a traversal, in the order of its steps; sorted by ray at the end.
struct WalkLog {
  static constexpr bool kHasRuns = true, kInOrder = false;

  // An open cell: for which ray, from where to where in t and in heights, and between which planes.
  alignas(64) int32_t part_info[kMaxOpenParts + kSlack];
  float part_begin[kMaxOpenParts + kSlack], part_end[kMaxOpenParts + kSlack];
  float enter_height[kMaxOpenParts + kSlack], leave_height[kMaxOpenParts + kSlack];
  int32_t part_word[kMaxOpenParts + kSlack];
  float part_size[kMaxOpenParts + kSlack];
  int32_t end_info[kBatchRays + kSlack];  ///< a ray is done: RayInfo
  float enter[kBatchRays + kSlack];       ///< [ray]
  float leave[kBatchRays + kSlack];       ///< [ray]
  int32_t flags[kBatchRays + kSlack];     ///< [ray] RayFlags
  int32_t rank[kBatchRays + kSlack];      ///< [ray] among the rays left open; -1 if the ray is decided
  OpenRays open;                          ///< at the end
};

/// Replaces a WalkLog if only the part of each ray counts that the traversal leaves open, as an OpenInterval.
/// Lists the rays that are done, and at the end those that are left open.
struct HullLog {
  static constexpr bool kHasRuns = false, kInOrder = false;

  uint32_t count;                                     ///< at the end
  alignas(64) int32_t end_info[kBatchRays + kSlack];  ///< RayInfo
  float begin[kBatchRays + kSlack], end[kBatchRays + kSlack];

  uint32_t ray(uint32_t k) const { return uint32_t(end_info[k] >> kRayShift); }
};

/// Replaces a HullLog if the part of each ray counts that contains its first hit; includes blocked rays.
/// Traverses in order, like follow_segment<true>().
struct FirstLog : HullLog {
  static constexpr bool kInOrder = true;
};

/// Replaces a WalkLog if the open cells of each ray count that may contain its first hit; includes blocked
/// rays. In `open`, `heights` are the indices of parts, by ray and in order, and t is unused. Traverses in
/// order, like follow_segment<true>().
struct HitLog : WalkLog {
  static constexpr bool kInOrder = true;

  float begin[kBatchRays + kSlack], end[kBatchRays + kSlack];  ///< by end: of the piece that blocks

  uint32_t ray(uint32_t k) const { return uint32_t(end_info[k] >> kRayShift); }
  bool blocked(uint32_t k) const { return (uint32_t(end_info[k]) & kSeenSides) == uint32_t(kSeenSides); }
};

/// Rays for the reference: not finite, far away, or with more intervals than there is room for.
struct HardRays {
  uint32_t count;
  uint32_t ray[kBatchRays + kSlack];
};

/// Heights of the planes that words stand for. Exact, with or without fused multiply-add.
struct Planes {
  hn::Vec<Floats> lower, upper;

  HWY_INLINE Planes(hn::Vec<Ints> from, hn::Vec<Floats> size) {
    const Floats d;
    const Ints di;
    const Words dw;
    const auto word = hn::BitCast(dw, from);
    const auto half_span = hn::MulAdd(size, hn::Set(d, static_cast<float>(kNormalHalf)), hn::Set(d, 1.0f));
    const auto step = hn::Mul(half_span, hn::Set(d, 1.0f / (kPlanePlaces / 2)));
    const auto lower_place = hn::BitCast(di, hn::And(hn::ShiftRight<16>(word), hn::Set(dw, 255)));
    const auto upper_place = hn::BitCast(di, hn::ShiftRight<24>(word));
    lower = hn::MulSub(hn::ConvertTo(d, lower_place), step, half_span);
    upper = hn::MulSub(hn::ConvertTo(d, upper_place), step, hn::Sub(half_span, step));
  }
};

/// The intervals of parts of the log, as in pass_cell().
struct RunLanes {
  hn::Vec<Floats> begin, end;
  hn::Vec<Ints> heights;

  HWY_INLINE RunLanes(const WalkLog& log, uint32_t i) {
    const Floats d;
    const auto now = hn::Load(d, log.part_begin + i), left = hn::Load(d, log.part_end + i),
               enter_height = hn::Load(d, log.enter_height + i),
               leave_height = hn::Load(d, log.leave_height + i);
    const Planes planes(hn::Load(Ints(), log.part_word + i), hn::Load(d, log.part_size + i));
    const auto &lower = planes.lower, &upper = planes.upper;
    const auto enters_above = hn::Gt(enter_height, upper), enters_below = hn::Lt(enter_height, lower);
    const auto leaves_above = hn::Gt(leave_height, upper), leaves_below = hn::Lt(leave_height, lower);
    const auto rate = hn::Div(hn::Sub(left, now), hn::Sub(leave_height, enter_height));
    const auto first = hn::Sub(hn::IfThenElse(enters_above, upper, lower), enter_height);
    const auto last = hn::Sub(hn::IfThenElse(leaves_above, upper, lower), enter_height);
    const auto from = hn::Min(hn::Max(hn::Add(now, hn::Mul(first, rate)), now), left);
    begin = hn::IfThenElse(hn::Or(enters_above, enters_below), from, now);
    const auto to = hn::Min(hn::Max(hn::Add(now, hn::Mul(last, rate)), begin), left);
    end = hn::IfThenElse(hn::Or(leaves_above, leaves_below), to, left);
    const auto top = hn::Set(d, static_cast<float>(kTopHeight));
    const auto scale = hn::Div(top, hn::Sub(upper, lower));
    const auto height = [&](hn::Vec<Floats> h) HWY_ATTR {
      const auto scaled = hn::Add(hn::Mul(hn::Sub(h, lower), scale), hn::Set(d, 0.5f));
      return to_ints(hn::Min(hn::Max(scaled, hn::Zero(d)), top));
    };
    heights = hn::Or(height(enter_height), hn::ShiftLeft<8>(height(leave_height)));
  }
};

/// Writes the known answers, and sorts the log of the rays left open by ray.
HWY_INLINE void collect_answers(WalkLog& log, uint32_t ends, uint32_t parts, AnswerBatch& answers,
                                HardRays& hard) {
  const Floats d;
  const Ints di;
  OpenRays& open_rays = log.open;
  open_rays.count = 0;
  const auto sides = hn::Set(di, kSeenSides);
  for (uint32_t i = 0; i < ends; i += kLanes) {
    const auto present = hn::RebindMask(di, hn::FirstN(d, ends - i));
    const auto info = hn::Load(di, log.end_info + i);
    const auto blocked = hn::And(present, hn::Eq(hn::And(info, sides), sides));
    const auto incomplete =
        hn::AndNot(blocked, hn::And(present, hn::TestBit(info, hn::Set(di, kIncomplete))));
    const uint32_t open = bits_of(hn::AndNot(hn::Or(incomplete, blocked), present));
    alignas(64) int32_t rays[kLanes];
    hn::Store(hn::ShiftRight<kRayShift>(info), di, rays);
    for (uint32_t lanes = bits_of(blocked); lanes != 0; lanes &= lanes - 1)
      answers.logit[rays[__builtin_ctz(lanes)]] = -kCertainLogit;
    for (uint32_t lanes = bits_of(incomplete); HWY_UNLIKELY(lanes != 0); lanes &= lanes - 1)
      hard.ray[hard.count++] = uint32_t(rays[__builtin_ctz(lanes)]);
    // Not beyond what has been read.
    hn::StoreU(gather_lanes(open, info), di, log.end_info + open_rays.count);
    open_rays.count += uint32_t(__builtin_popcount(open));
  }
  for (uint32_t k = 0; k < open_rays.count; ++k) log.rank[log.end_info[k] >> kRayShift] = int32_t(k);

  uint32_t kept = 0;
  for (uint32_t i = 0; i < parts; i += kLanes) {
    const auto ray = hn::ShiftRight<kRayShift>(hn::Load(di, log.part_info + i));
    const auto present = hn::RebindMask(di, hn::FirstN(d, parts - i));
    const auto rank = hn::GatherIndex(di, log.rank, hn::IfThenElseZero(present, ray));
    const uint32_t open = bits_of(hn::And(present, hn::Gt(rank, hn::Set(di, -1))));
    if (open == 0) continue;
    const RunLanes run(log, i);
    // Not beyond what has been read.
    hn::StoreU(gather_lanes(open, rank), di, log.part_info + kept);
    hn::StoreU(gather_lanes(open, run.begin), d, log.part_begin + kept);
    hn::StoreU(gather_lanes(open, run.end), d, log.part_end + kept);
    hn::StoreU(gather_lanes(open, run.heights), di, log.part_word + kept);
    kept += uint32_t(__builtin_popcount(open));
  }
  std::memset(open_rays.runs, 0, open_rays.count * sizeof(open_rays.runs[0]));
  for (uint32_t i = 0; i < kept; ++i) ++open_rays.runs[log.part_info[i]];
  int32_t sum = 0;
  for (uint32_t k = 0; k < open_rays.count; ++k) {
    open_rays.first[k] = sum;
    sum += open_rays.runs[k];
    open_rays.runs[k] = 0;
  }
  for (uint32_t i = 0; i < kept; ++i) {
    const int32_t k = log.part_info[i];
    const int32_t next = open_rays.first[k] + open_rays.runs[k]++;
    open_rays.begin[next] = log.part_begin[i];
    open_rays.end[next] = log.part_end[i];
    open_rays.heights[next] = log.part_word[i];
  }
}

/// Keeps all rays whose parts are complete, and sorts the parts by ray.
HWY_INLINE void collect_answers(HitLog& log, uint32_t ends, uint32_t parts, AnswerBatch&, HardRays& hard) {
  OpenRays& open = log.open;
  open.count = 0;
  for (uint32_t i = 0; i < ends; ++i) {
    const int32_t info = log.end_info[i];
    const int32_t ray = info >> kRayShift;
    if (info & kIncomplete) {
      hard.ray[hard.count++] = uint32_t(ray);
      continue;
    }
    const uint32_t k = open.count++;
    log.end_info[k] = info;
    log.begin[k] = log.begin[i];
    log.end[k] = log.end[i];
    log.rank[ray] = int32_t(k);
    open.runs[k] = 0;
  }
  for (uint32_t i = 0; i < parts; ++i) {
    const int32_t k = log.rank[log.part_info[i] >> kRayShift];
    if (k >= 0) ++open.runs[k];
  }
  int32_t sum = 0;
  for (uint32_t k = 0; k < open.count; ++k) {
    open.first[k] = sum;
    sum += open.runs[k];
    open.runs[k] = 0;
  }
  for (uint32_t i = 0; i < parts; ++i) {
    const int32_t k = log.rank[log.part_info[i] >> kRayShift];
    if (k >= 0) open.heights[open.first[k] + open.runs[k]++] = int32_t(i);
  }
}

/// Keeps all rays.
HWY_INLINE void collect_answers(FirstLog& log, uint32_t ends, uint32_t, AnswerBatch&, HardRays&) {
  log.count = ends;
}

/// Writes the known answers, and keeps the rays that are left open.
HWY_INLINE void collect_answers(HullLog& log, uint32_t ends, uint32_t, AnswerBatch& answers, HardRays&) {
  const Floats d;
  const Ints di;
  const auto sides = hn::Set(di, kSeenSides);
  uint32_t count = 0;
  for (uint32_t i = 0; i < ends; i += kLanes) {
    const auto present = hn::RebindMask(di, hn::FirstN(d, ends - i));
    const auto info = hn::Load(di, log.end_info + i);
    const auto begin = hn::Load(d, log.begin + i), end = hn::Load(d, log.end + i);
    const auto blocked = hn::And(present, hn::Eq(hn::And(info, sides), sides));
    alignas(64) int32_t rays[kLanes];
    hn::Store(hn::ShiftRight<kRayShift>(info), di, rays);
    for (uint32_t lanes = bits_of(blocked); lanes != 0; lanes &= lanes - 1)
      answers.logit[rays[__builtin_ctz(lanes)]] = -kCertainLogit;
    const uint32_t open = bits_of(hn::AndNot(blocked, present));
    const LanesTogether together(open);
    // Not beyond what has been read.
    hn::StoreU(together(info), di, log.end_info + count);
    hn::StoreU(together(begin), d, log.begin + count);
    hn::StoreU(together(end), d, log.end + count);
    count += uint32_t(__builtin_popcount(open));
  }
  log.count = count;
}

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
