// The walk in SIMD: a ray to a lane, several groups of lanes in turn so that one's loads hide another's.
//
// Each axis is mirrored where the direction is negative: (k - o) * inv keeps its bits when all three change
// sign, and every ray then walks upward. A step leaps as far as the voxel's distance allows, to the crossing
// (t, axis) at which the segment leaves the cube around it; where the other axes stand then follows from
// their own crossings, counted in the reference's order (t, then the lower axis). An estimate from below that
// is off by at most one voxel is put right by one such comparison.
//
// No include guard in the usual sense: compiled once for each target.
#if defined(NIF_SEGMENT_WALK_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_SEGMENT_WALK_INL
#undef NIF_SEGMENT_WALK_INL
#else
#define NIF_SEGMENT_WALK_INL
#endif

#include <algorithm>
#include <cstring>
#include <type_traits>

#include "kernels/cpu/lanes-inl.hpp"
#include "kernels/packed/walk_grid.hpp"
#include "kernels/reference/object_kernel.hpp"
#include "kernels/reference/segment/walk.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

/// Groups of lanes that take turns: while one's voxels are fetched, another leaps.
constexpr uint32_t kGroups = 2;
constexpr uint32_t kSlots = kGroups * kLanes;
/// Leaps between two looks for lanes that are done: more leave lanes idle, fewer cost more than they fill.
constexpr uint32_t kLeapsPerRefill = 4;

/// Rays that are taken up at a time; few, so that they stay in the nearest cache.
inline constexpr uint32_t kQueueRays = 128;
/// Ends of runs that are logged before answers are collected. Where those of a few rays are more than there
/// is room for, the reference answers them.
inline constexpr uint32_t kMaxTurns = 8 * kBatchRays;
/// Runs of one ray that the network's part has room for.
inline constexpr uint32_t kMaxPendingRuns = 16;

/// Stands for the origin along an axis that is not moved along: its planes are never reached.
constexpr float kFlatOrigin = -3e38f;

enum RayFlags : int32_t { kNegativeAxes = 7, kFlatAxis = 8, kEntersGrid = 64, kLeavesGrid = 128 };
/// Marks a turn in a ray's first voxel.
constexpr int32_t kFresh = 1 << 30;
/// In place of what a ray has seen: its turns are not all in the log.
constexpr int32_t kIncomplete = -1;

/// Whole vectors are read and written, also where the last entries are fewer.
inline constexpr uint32_t kSlack = 16;

/// Rays that meet the grid, ready to be walked, from `next` on.
struct Queue {
  static constexpr uint32_t kRoom = kQueueRays + kSlots + kSlack;
  alignas(64) float origin[3][kRoom];
  float direction[3][kRoom], inverse[3][kRoom], voxel[3][kRoom];
  float enter[kRoom], leave[kRoom];
  int32_t octant[kRoom];  ///< kNegativeAxes
  int32_t ray[kRoom];
  uint32_t next, count;
};

/// Rays being walked, one to a lane.
struct Slots {
  alignas(64) float origin[3][kSlots];
  float direction[3][kSlots], inverse[3][kSlots], voxel[3][kSlots], stride[3][kSlots], base[kSlots];
  float now[kSlots], leave[kSlots];
  int32_t code[kSlots];   ///< of the current voxel
  int32_t state[kSlots];  ///< VoxelClass of the one before
  int32_t seen[kSlots];   ///< union of all so far
  int32_t ray[kSlots];    ///< with kFresh in its first voxel
};

/// What happens on the way, in the order of the steps: written without a branch, and sorted by ray at the
/// end.
struct WalkLog {
  alignas(64) int32_t turn_ray[kMaxTurns + kSlack];  ///< a run begins or ends: the ray, with kFresh
  float turn_t[kMaxTurns + kSlack];                  ///< and the t at which the voxel was entered
  int32_t end_ray[kBatchRays + kSlack],
      end_seen[kBatchRays + kSlack];       ///< a ray is done: which, what it has seen,
  float end_entered[kBatchRays + kSlack];  ///< and the t at which its last voxel was entered
  float leave[kBatchRays + kSlack];        ///< [ray]
  int32_t flags[kBatchRays + kSlack];      ///< [ray]
  int32_t rank[kBatchRays + kSlack];  ///< [ray] among those that the walk leaves open; -1 where it does not
};

/// How far a walk is. Kept by itself, so that no store through a pointer can seem to change it.
struct Progress {
  uint64_t active = 0;           ///< slots with a ray, as bits
  uint32_t turns = 0, ends = 0;  ///< in the log
  bool full = false;             ///< the log of turns
};

/// Rays that the walk leaves open: the first `count` ends of the log are theirs.
struct OpenRays {
  uint32_t count;
  alignas(64) int32_t turns[kBatchRays + kSlack];  ///< how often a run begins or ends, with kFresh as above
  int32_t first[kBatchRays + kSlack];              ///< past the last of these in `t`
  float t[kMaxTurns + kBatchRays + 2 * kMaxPendingRuns];
};

/// Rays that are for the reference: not finite, far away, or with more runs than there is room for.
struct HardRays {
  uint32_t count;
  uint32_t ray[kBatchRays + kSlack];
};

/// Walks one batch, as far as the log has room at a time.
class Walker {
 public:
  Walker(const SegmentField& field, const WalkGrid& grid, const SegmentBatch& batch, AnswerBatch& answers,
         Queue& queue, Slots& slots, WalkLog& log, OpenRays& open, HardRays& hard)
      : field_(field),
        grid_(grid),
        batch_(batch),
        answers_(answers),
        queue_(queue),
        slots_(slots),
        log_(log),
        open_(open),
        hard_(hard) {
    for (uint32_t octant = 0; octant < 8; ++octant) {
      strides_[3][octant] = (octant >> grid.axis) & 1 ? float(grid.second) : 0.0f;
      for (uint32_t a = 0; a < 3; ++a) {
        const bool negative = (octant >> a) & 1;
        strides_[a][octant] = negative ? -grid.stride[a] : grid.stride[a];
        // Mirrored voxel v is voxel -v - 1, and its brick floor(v / 4) is brick -floor(v / 4) - 1.
        if (negative) strides_[3][octant] -= grid.stride[a] * (1 + grid.beyond[a]);
      }
    }
    std::memset(slots_.voxel, 0, sizeof(slots_.voxel));
    std::memset(slots_.code, 0, sizeof(slots_.code));
    queue_.next = queue_.count = 0;
    hard_.count = 0;
  }

  /// Answers rays that the walk alone decides, and lists the others. False where there are no more.
  bool walk() {
    Progress now;
    take_up(now);
    for (uint32_t group = 0; group < kGroups; ++group) {
      refill(group, now);
      look(group, now);
    }
    if (now.active == 0) return false;
    while (now.active != 0) {
      take_up(now);
      for (uint32_t k = 1; k < kLeapsPerRefill; ++k)
        for (uint32_t group = 0; group < kGroups; ++group) {
          leap(group, now);
          look(group, now);
        }
      for (uint32_t group = 0; group < kGroups; ++group) {
        leap(group, now);
        refill(group, now);
        look(group, now);
      }
    }
    collect(now);
    return true;
  }

 private:
  /// To grid space, clipped; rays that miss the grid are answered here.
  HWY_INLINE void enqueue(uint32_t i) {
    const Floats d;
    const Ints di;
    const auto zero = hn::Zero(d), one = hn::Set(d, 1.0f);
    const auto tmin = hn::Load(d, batch_.tmin + i), tmax = hn::Load(d, batch_.tmax + i);
    const auto present = hn::FirstN(d, batch_.count - i);
    const auto scale = hn::Set(d, field_.voxels_per_unit);
    hn::Vec<Floats> origin[3], direction[3], inverse[3], voxel[3];

    // Whatever is not finite or far away fails one of these.
    auto easy = hn::And(present, hn::Le(tmin, tmax));
    auto steepest = zero;
    for (uint32_t a = 0; a < 3; ++a) {
      origin[a] = hn::Mul(hn::Sub(hn::Load(d, batch_.origin[a] + i), hn::Set(d, field_.origin[a])), scale);
      direction[a] = hn::Mul(hn::Load(d, batch_.direction[a] + i), scale);
      easy = hn::And(easy, hn::Le(hn::Abs(origin[a]), hn::Set(d, kCertainReach)));
      easy = hn::And(easy, hn::Le(hn::Abs(direction[a]), hn::Set(d, kMaxDirection)));
      steepest = hn::Max(steepest, hn::Abs(direction[a]));
    }
    easy = hn::And(easy, hn::Ge(steepest, hn::Set(d, kMinDirection)));

    const auto flat_limit = hn::Mul(steepest, hn::Set(d, kFlatDirection));
    auto meets = easy;
    auto enter = tmin, leave = tmax;
    auto flags = hn::Zero(di);
    hn::Mask<Floats> negative[3], flat[3];
    for (uint32_t a = 0; a < 3; ++a) {
      const auto size = hn::Set(d, float(field_.voxels[a]));
      flat[a] = hn::Lt(hn::Abs(direction[a]), flat_limit);
      const auto beside = hn::And(flat[a], hn::Or(hn::Lt(origin[a], zero), hn::Gt(origin[a], size)));
      meets = hn::AndNot(beside, meets);
      negative[a] = hn::AndNot(flat[a], hn::Lt(direction[a], zero));
      origin[a] = hn::IfThenElse(negative[a], hn::Neg(origin[a]), origin[a]);
      direction[a] = hn::IfThenZeroElse(flat[a], hn::Abs(direction[a]));
      inverse[a] = hn::IfThenElse(flat[a], one, hn::Div(one, direction[a]));
      const auto low = hn::IfThenElseZero(negative[a], hn::Neg(size));
      const auto high = hn::IfThenZeroElse(negative[a], size);
      const auto first = hn::Mul(hn::Sub(low, origin[a]), inverse[a]);
      const auto last = hn::Mul(hn::Sub(high, origin[a]), inverse[a]);
      const auto later = hn::AndNot(flat[a], hn::Gt(first, enter));
      const auto sooner = hn::AndNot(flat[a], hn::Lt(last, leave));
      enter = hn::IfThenElse(later, first, enter);
      leave = hn::IfThenElse(sooner, last, leave);
      flags = hn::Or(flags, hn::IfThenElseZero(hn::RebindMask(di, negative[a]), hn::Set(di, 1 << a)));
      flags = hn::Or(flags, hn::IfThenElseZero(hn::RebindMask(di, flat[a]), hn::Set(di, kFlatAxis << a)));
      flags = hn::Or(flags, hn::IfThenElseZero(hn::RebindMask(di, later), hn::Set(di, kEntersGrid)));
      flags = hn::Or(flags, hn::IfThenElseZero(hn::RebindMask(di, sooner), hn::Set(di, kLeavesGrid)));
    }
    meets = hn::And(meets, hn::Le(enter, leave));
    for (uint32_t a = 0; a < 3; ++a) {
      auto at = hn::Add(origin[a], hn::Mul(enter, direction[a]));
      at = hn::IfThenElse(negative[a], hn::Neg(at), at);
      const auto top = hn::Set(d, float(field_.voxels[a] - 1));
      const auto index = hn::Trunc(hn::Min(hn::Max(at, zero), top));
      voxel[a] = hn::IfThenElse(negative[a], hn::Sub(hn::Set(d, -1.0f), index), index);
      origin[a] = hn::IfThenElse(flat[a], hn::Set(d, kFlatOrigin), origin[a]);
    }

    hn::StoreU(hn::Set(di, kCertainLogit), di, answers_.logit + i);
    std::memset(answers_.certain + i, 1, std::min(kLanes, batch_.count - i));
    const uint32_t hard = bits_of(hn::AndNot(easy, present));
    hn::StoreU(gather_lanes(hard, hn::Iota(Words(), i)), Words(), hard_.ray + hard_.count);
    hard_.count += uint32_t(__builtin_popcount(hard));

    hn::StoreU(leave, d, log_.leave + i);
    hn::StoreU(flags, di, log_.flags + i);
    hn::StoreU(hn::Set(di, -1), di, log_.rank + i);
    const uint32_t to = queue_.count, lanes = bits_of(meets);
    for (uint32_t a = 0; a < 3; ++a) {
      hn::StoreU(gather_lanes(lanes, origin[a]), d, queue_.origin[a] + to);
      hn::StoreU(gather_lanes(lanes, direction[a]), d, queue_.direction[a] + to);
      hn::StoreU(gather_lanes(lanes, inverse[a]), d, queue_.inverse[a] + to);
      hn::StoreU(gather_lanes(lanes, voxel[a]), d, queue_.voxel[a] + to);
    }
    hn::StoreU(gather_lanes(lanes, enter), d, queue_.enter + to);
    hn::StoreU(gather_lanes(lanes, leave), d, queue_.leave + to);
    hn::StoreU(gather_lanes(lanes, hn::And(flags, hn::Set(di, kNegativeAxes))), di, queue_.octant + to);
    hn::StoreU(gather_lanes(lanes, hn::Iota(di, int32_t(i))), di, queue_.ray + to);
    queue_.count += uint32_t(__builtin_popcount(lanes));
  }

  /// Sees to it that the queue has enough for all lanes, as long as there are rays and the log has room.
  HWY_INLINE void take_up(const Progress& p) {
    while (queue_.count - queue_.next < kSlots && taken_ < batch_.count && p.turns <= kMaxTurns / 2) {
      move_to_front();
      const uint32_t end = std::min(taken_ + kQueueRays, batch_.count);
      for (; taken_ < end; taken_ += kLanes) enqueue(taken_);
    }
  }

  void move_to_front() {
    const uint32_t next = queue_.next, left = queue_.count - next;
    const auto move = [&](auto* entries) {
      const hn::Rebind<std::remove_pointer_t<decltype(entries)>, Floats> d;
      for (uint32_t i = 0; i < left; i += kLanes) hn::Store(hn::LoadU(d, entries + next + i), d, entries + i);
    };
    for (uint32_t a = 0; a < 3; ++a) {
      move(queue_.origin[a]);
      move(queue_.direction[a]);
      move(queue_.inverse[a]);
      move(queue_.voxel[a]);
    }
    move(queue_.enter);
    move(queue_.leave);
    move(queue_.octant);
    move(queue_.ray);
    queue_.next = 0;
    queue_.count = left;
  }

  /// Puts the next rays into the slots of a group that stand still, as far as there are any.
  HWY_INLINE void refill(uint32_t group, Progress& p) {
    const Floats d;
    const Ints di;
    const uint32_t at = group * kLanes;
    uint32_t idle = ~uint32_t(p.active >> at) & kAllLanes;
    const uint32_t next = queue_.next;
    while (uint32_t(__builtin_popcount(idle)) > queue_.count - next) idle &= idle - 1;
    const auto put = [&](const float* from, float* to) {
      hn::Store(scatter_lanes(idle, hn::Load(d, to + at), from + next), d, to + at);
    };
    for (uint32_t a = 0; a < 3; ++a) {
      put(queue_.origin[a], slots_.origin[a]);
      put(queue_.direction[a], slots_.direction[a]);
      put(queue_.inverse[a], slots_.inverse[a]);
      put(queue_.voxel[a], slots_.voxel[a]);
    }
    put(queue_.enter, slots_.now);
    put(queue_.leave, slots_.leave);
    const auto filled = mask_of(idle);
    const auto filled_int = hn::RebindMask(di, filled);
    const auto octants = scatter_lanes(idle, hn::Zero(di), queue_.octant + next);
    const auto choose = [&](uint32_t which, float* to) {
      const auto strides = look_up<8>(d, strides_[which], octants);
      hn::Store(hn::IfThenElse(filled, strides, hn::Load(d, to + at)), d, to + at);
    };
    for (uint32_t a = 0; a < 3; ++a) choose(a, slots_.stride[a]);
    choose(3, slots_.base);
    const auto rays = scatter_lanes(idle, hn::Load(di, slots_.ray + at), queue_.ray + next);
    hn::Store(hn::Or(rays, hn::IfThenElseZero(filled_int, hn::Set(di, kFresh))), di, slots_.ray + at);
    hn::Store(hn::IfThenZeroElse(filled_int, hn::Load(di, slots_.state + at)), di, slots_.state + at);
    hn::Store(hn::IfThenZeroElse(filled_int, hn::Load(di, slots_.seen + at)), di, slots_.seen + at);
    queue_.next += uint32_t(__builtin_popcount(idle));
    p.active |= uint64_t{idle} << at;
  }

  /// Fetches the codes of a group's voxels. The leap that needs them comes after another group's.
  HWY_INLINE void look(uint32_t group, Progress& p) {
    const Floats d;
    const Ints di;
    const Words dw;
    const uint32_t at = group * kLanes;
    auto place = hn::Load(d, slots_.base + at);  // exact: integers below 2^24
    for (uint32_t a = 0; a < 3; ++a) {
      const auto voxel = hn::Load(d, slots_.voxel[a] + at);
      const auto brick = hn::Floor(hn::Mul(voxel, hn::Set(d, 0.25f)));
      const auto number = hn::MulAdd(brick, hn::Set(d, grid_.beyond[a]), voxel);
      place = hn::MulAdd(number, hn::Load(d, slots_.stride[a] + at), place);
    }
    // Lanes that stand still may have left the grid.
    const auto active = mask_of(uint32_t((p.active >> at) & kAllLanes));
    const auto number = hn::IfThenElseZero(hn::RebindMask(di, active), to_ints(place));
    const auto word =
        hn::GatherIndex(di, reinterpret_cast<const int32_t*>(grid_.codes.data()), hn::ShiftRight<3>(number));
    const auto shift = hn::ShiftLeft<2>(hn::And(number, hn::Set(di, 7)));
    const auto code = hn::And(hn::Shr(hn::BitCast(dw, word), hn::BitCast(dw, shift)), hn::Set(dw, 15));
    hn::Store(hn::BitCast(di, code), di, slots_.code + at);
  }

  /// One leap of every lane of a group.
  HWY_INLINE void leap(uint32_t group, Progress& p) {
    const Floats d;
    const Ints di;
    const uint32_t at = group * kLanes;
    hn::Vec<Floats> voxel[3], origin[3], inverse[3], exit[3];
    for (uint32_t a = 0; a < 3; ++a) {
      voxel[a] = hn::Load(d, slots_.voxel[a] + at);
      origin[a] = hn::Load(d, slots_.origin[a] + at);
      inverse[a] = hn::Load(d, slots_.inverse[a] + at);
    }
    const auto active = mask_of(uint32_t((p.active >> at) & kAllLanes));
    const auto code = hn::Load(di, slots_.code + at);
    const auto distance = look_up<16>(d, kCodeDistance, code);
    const auto state = look_up<16>(di, kCodeClass, code);
    const auto turns =
        hn::TestBit(hn::Xor(state, hn::Load(di, slots_.state + at)), hn::Set(di, int32_t(kSurfaceBit)));
    const auto seen = hn::Or(hn::Load(di, slots_.seen + at), state);
    const auto both = hn::Set(di, int32_t(kOutsideBit) | int32_t(kInsideBit));
    const auto blocked = hn::RebindMask(d, hn::Eq(hn::And(seen, both), both));

    for (uint32_t a = 0; a < 3; ++a)
      exit[a] = hn::Mul(hn::Sub(hn::Add(voxel[a], distance), origin[a]), inverse[a]);
    const auto t = hn::Min(hn::Min(exit[0], exit[1]), exit[2]);
    const auto goes_on = hn::AndNot(blocked, hn::Lt(t, hn::Load(d, slots_.leave + at)));
    const auto along_0 = hn::Eq(exit[0], t);
    const auto below_2 = hn::Or(along_0, hn::Eq(exit[1], t));
    for (uint32_t a = 0; a < 3; ++a) {
      const auto reached = hn::MulAdd(t, hn::Load(d, slots_.direction[a] + at), origin[a]);
      const auto estimate = hn::Floor(hn::Sub(reached, hn::Set(d, kEstimateSlack)));
      const auto before = hn::Max(estimate, voxel[a]);
      const auto plane = hn::Add(before, hn::Set(d, 1.0f));
      const auto crossing = hn::Mul(hn::Sub(plane, origin[a]), inverse[a]);
      // In the reference's order the crossing of a lower axis at the same t comes first.
      auto crossed = hn::Le(crossing, t);
      if (a > 0) crossed = hn::AndNot(hn::And(a == 1 ? along_0 : below_2, hn::Eq(crossing, t)), crossed);
      hn::Store(hn::IfThenElse(crossed, plane, before), d, slots_.voxel[a] + at);
    }
    const auto now = hn::Load(d, slots_.now + at);
    hn::Store(hn::Max(t, now), d, slots_.now + at);
    hn::Store(state, di, slots_.state + at);
    hn::Store(seen, di, slots_.seen + at);
    const auto maybe_fresh = hn::Load(di, slots_.ray + at);
    const auto ray = hn::AndNot(hn::Set(di, kFresh), maybe_fresh);
    hn::Store(ray, di, slots_.ray + at);

    const uint32_t turning = bits_of(hn::And(hn::RebindMask(d, turns), active));
    hn::StoreU(gather_lanes(turning, maybe_fresh), di, log_.turn_ray + p.turns);
    hn::StoreU(gather_lanes(turning, now), d, log_.turn_t + p.turns);
    p.turns += uint32_t(__builtin_popcount(turning));
    if (HWY_UNLIKELY(p.turns > kMaxTurns)) {
      p.turns = kMaxTurns;
      p.full = true;
    }
    const uint32_t ending = bits_of(hn::AndNot(goes_on, active));
    p.active &= ~(uint64_t{ending} << at);
    // A ray that ends once the log is full may lack turns: no state is what it is known by.
    const auto seen_or_none = p.full ? hn::Set(di, kIncomplete) : seen;
    hn::StoreU(gather_lanes(ending, ray), di, log_.end_ray + p.ends);
    hn::StoreU(gather_lanes(ending, seen_or_none), di, log_.end_seen + p.ends);
    hn::StoreU(gather_lanes(ending, now), d, log_.end_entered + p.ends);
    p.ends += uint32_t(__builtin_popcount(ending));
  }

  /// Hands out the answers that there are, and sorts the log of the rays left open by ray.
  HWY_INLINE void collect(const Progress& p) {
    const Floats d;
    const Ints di;
    open_.count = 0;
    const auto both = hn::Set(di, int32_t(kOutsideBit) | int32_t(kInsideBit));
    for (uint32_t i = 0; i < p.ends; i += kLanes) {
      const auto present = hn::RebindMask(di, hn::FirstN(d, p.ends - i));
      const auto ray = hn::Load(di, log_.end_ray + i), seen = hn::Load(di, log_.end_seen + i);
      const auto entered = hn::Load(d, log_.end_entered + i);
      const auto incomplete = hn::And(present, hn::Lt(seen, hn::Zero(di)));
      const auto blocked = hn::AndNot(incomplete, hn::And(present, hn::Eq(hn::And(seen, both), both)));
      const auto surface = hn::And(present, hn::TestBit(seen, hn::Set(di, int32_t(kSurfaceBit))));
      const uint32_t open = bits_of(hn::AndNot(hn::Or(incomplete, blocked), surface));
      alignas(64) int32_t rays[kLanes];
      hn::Store(ray, di, rays);
      for (uint32_t lanes = bits_of(blocked); lanes != 0; lanes &= lanes - 1)
        answers_.logit[rays[__builtin_ctz(lanes)]] = -kCertainLogit;
      for (uint32_t lanes = bits_of(incomplete); HWY_UNLIKELY(lanes != 0); lanes &= lanes - 1)
        hard_.ray[hard_.count++] = uint32_t(rays[__builtin_ctz(lanes)]);
      // No more than have been read.
      hn::StoreU(gather_lanes(open, ray), di, log_.end_ray + open_.count);
      hn::StoreU(gather_lanes(open, seen), di, log_.end_seen + open_.count);
      hn::StoreU(gather_lanes(open, entered), d, log_.end_entered + open_.count);
      open_.count += uint32_t(__builtin_popcount(open));
    }
    for (uint32_t k = 0; k < open_.count; ++k) log_.rank[log_.end_ray[k]] = int32_t(k);

    uint32_t turns = 0;
    for (uint32_t i = 0; i < p.turns; i += kLanes) {
      const auto ray = hn::Load(di, log_.turn_ray + i);
      const auto present = hn::RebindMask(di, hn::FirstN(d, p.turns - i));
      const auto fresh = hn::And(ray, hn::Set(di, kFresh));
      const auto rank = hn::GatherIndex(di, log_.rank, hn::IfThenElseZero(present, hn::Xor(ray, fresh)));
      const uint32_t open = bits_of(hn::And(present, hn::Gt(rank, hn::Set(di, -1))));
      const auto t = hn::Load(d, log_.turn_t + i);
      hn::StoreU(gather_lanes(open, hn::Or(rank, fresh)), di, log_.turn_ray + turns);
      hn::StoreU(gather_lanes(open, t), d, log_.turn_t + turns);
      turns += uint32_t(__builtin_popcount(open));
    }
    std::memset(open_.turns, 0, open_.count * sizeof(open_.turns[0]));
    for (uint32_t i = 0; i < turns; ++i) {
      const int32_t rank = log_.turn_ray[i];
      open_.turns[rank & ~kFresh] += (rank & kFresh) + 1;
    }
    int32_t sum = 0;
    for (uint32_t k = 0; k < open_.count; ++k) {
      open_.first[k] = sum;
      sum += open_.turns[k] & ~kFresh;
    }
    for (uint32_t i = 0; i < turns; ++i) open_.t[open_.first[log_.turn_ray[i] & ~kFresh]++] = log_.turn_t[i];
  }

  const SegmentField& field_;
  const WalkGrid& grid_;
  const SegmentBatch& batch_;
  AnswerBatch& answers_;
  Queue& queue_;
  Slots& slots_;
  WalkLog& log_;
  OpenRays& open_;
  HardRays& hard_;
  alignas(64) float strides_[4][kLanes > 8 ? kLanes : 8];  ///< along each axis, then the base; [octant]
  uint32_t taken_ = 0;                                     ///< rays of the batch so far
};

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
