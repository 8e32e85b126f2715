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

#include "kernels/cpu/lanes-inl.hpp"
#include "kernels/cpu/walk_grid.hpp"
#include "kernels/object_kernel.hpp"
#include "kernels/reference/walk.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

/// Groups of lanes that take turns: while one's voxels are fetched, another leaps.
constexpr uint32_t kGroups = 2;
constexpr uint32_t kSlots = kGroups * kLanes;
/// Leaps between two looks for lanes that are done: more leave lanes idle, fewer cost more than they fill.
constexpr uint32_t kLeapsPerRefill = 4;

/// Rays walked before their answers are collected.
inline constexpr uint32_t kQueueRays = 512;
/// Ends of runs that a batch of them has room for; where there are more, the rest goes to the reference.
inline constexpr uint32_t kMaxTurns = 24 * kQueueRays;
/// Runs of one ray that the network's part has room for.
inline constexpr uint32_t kMaxPendingRuns = 16;

/// More than the walk's rounding in voxels (docs/model.md: 0.0061 for the crossing and as much for the
/// place), less than a voxel by far.
constexpr float kEstimateSlack = 1.0f / 32;
/// Ranks of lanes.
alignas(64) constexpr int32_t kAscending[16] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
/// Stands for the origin along an axis that is not moved along: its planes are never reached.
constexpr float kFlatOrigin = -3e38f;

enum RayFlags : int32_t { kNegativeAxes = 7, kEntersGrid = 8, kLeavesGrid = 16 };
/// Marks a turn in a ray's first voxel.
constexpr int32_t kFresh = 1 << 30;
/// In place of what a ray has seen: its turns are not all in the log.
constexpr int32_t kIncomplete = -1;

/// Rays that meet the grid, ready to be walked. Entries beyond the last may be read, as they are by whole
/// vectors.
inline constexpr uint32_t kQueueRoom = kQueueRays + 16;
struct Queue {
  alignas(64) float origin[3][kQueueRoom];
  float direction[3][kQueueRoom], inverse[3][kQueueRoom], voxel[3][kQueueRoom];
  float enter[kQueueRoom], leave[kQueueRoom];
  int32_t flags[kQueueRoom], ray[kQueueRoom];
  uint32_t count;
};

/// Rays being walked, one to a lane.
struct Slots {
  alignas(64) float origin[3][kSlots];
  float direction[3][kSlots], inverse[3][kSlots], voxel[3][kSlots], stride[3][kSlots], base[kSlots];
  float now[kSlots], leave[kSlots];
  int32_t code[kSlots];    ///< of the current voxel
  int32_t state[kSlots];   ///< VoxelClass of the current voxel
  int32_t seen[kSlots];    ///< union of all so far
  int32_t queued[kSlots];  ///< which ray of the queue; with kFresh in its first voxel
};

/// What happens on the way, in the order of the steps: written without a branch, and sorted by ray at the
/// end.
struct WalkLog {
  alignas(64) int32_t turn_queued[kMaxTurns + 16];       ///< a run begins or ends: the ray, with kFresh
  float turn_t[kMaxTurns + 16];                          ///< and the t at which the voxel was entered
  int32_t end_queued[kQueueRoom], end_seen[kQueueRoom];  ///< a ray is done: which, what it has seen,
  float end_entered[kQueueRoom];                         ///< and the t at which its last voxel was entered
  uint32_t turns, ends;
  uint32_t first[kQueueRays + 1];  ///< of each ray's turns in `t`
  uint32_t count[kQueueRays];
  uint8_t starts[kQueueRays];  ///< whether the first voxel is a surface voxel
  float t[kMaxTurns + 2 * kQueueRays];
};

/// Walks one batch. `Sink` receives what the walk cannot answer: sink.ambiguous(walker, slot) and
/// sink.hard(ray).
template <class Sink>
class Walker {
 public:
  Walker(const SegmentField& field, const WalkGrid& grid, Queue& queue, Slots& slots, WalkLog& log,
         Sink& sink)
      : field_(field), grid_(grid), queue_(queue), slots_(slots), log_(log), sink_(sink) {
    for (uint32_t octant = 0; octant < 8; ++octant) {
      float base = 0;
      for (uint32_t a = 0; a < 3; ++a) {
        const bool negative = (octant >> a) & 1;
        strides_[octant][a] = negative ? -grid.stride[a] : grid.stride[a];
        // Mirrored voxel v is voxel -v - 1, and its brick floor(v / 4) is brick -floor(v / 4) - 1.
        if (negative) base -= grid.stride[a] * (1 + grid.beyond[a]);
      }
      strides_[octant][3] = base;
      for (uint32_t k = 0; k < 4; ++k) strides_by_octant_[k][octant] = strides_[octant][k];
    }
  }

  void walk(const SegmentBatch& batch, AnswerBatch& answers) {
    answers_ = &answers;
    for (uint32_t first = 0; first < batch.count; first += kQueueRays) {
      const uint32_t end = std::min(first + kQueueRays, batch.count);
      queue_.count = 0;
      for (uint32_t i = first; i < end; i += kLanes) enqueue(batch, i);
      next_ = 0;
      active_ = 0;
      log_.turns = log_.ends = 0;
      full_ = false;
      for (uint32_t slot = 0; slot < kSlots; ++slot) refill(slot);
      for (uint32_t group = 0; group < kGroups; ++group) look(group);
      while (active_ != 0) {
        for (uint32_t k = 0; k < kLeapsPerRefill; ++k)
          for (uint32_t group = 0; group < kGroups; ++group) {
            leap(group);
            if (k + 1 == kLeapsPerRefill) refill_group(group);
            look(group);
          }
      }
      collect();
    }
  }

 private:
  /// To grid space, clipped; rays that miss the grid are answered here.
  HWY_INLINE void enqueue(const SegmentBatch& batch, uint32_t i) {
    const Floats d;
    const Ints di;
    const auto zero = hn::Zero(d), one = hn::Set(d, 1.0f);
    const auto tmin = hn::Load(d, batch.tmin + i), tmax = hn::Load(d, batch.tmax + i);
    const auto present = hn::FirstN(d, batch.count - i);
    const auto scale = hn::Set(d, field_.voxels_per_unit);
    hn::Vec<Floats> origin[3], direction[3], inverse[3], voxel[3];

    // Whatever is not finite or far away fails one of these.
    auto easy = hn::And(present, hn::Le(tmin, tmax));
    auto steepest = zero;
    for (uint32_t a = 0; a < 3; ++a) {
      origin[a] = hn::Mul(hn::Sub(hn::Load(d, batch.origin[a] + i), hn::Set(d, field_.origin[a])), scale);
      direction[a] = hn::Mul(hn::Load(d, batch.direction[a] + i), scale);
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

    hn::StoreU(hn::Set(di, kCertainLogit), di, answers_->logit + i);
    std::memset(answers_->certain + i, 1, std::min(kLanes, batch.count - i));
    for (uint32_t hard = bits_of(hn::AndNot(easy, present)); hard != 0; hard &= hard - 1)
      sink_.hard(i + uint32_t(__builtin_ctz(hard)));

    const uint32_t to = queue_.count, lanes = bits_of(meets);
    for (uint32_t a = 0; a < 3; ++a) {
      hn::StoreU(gather_lanes(lanes, origin[a]), d, queue_.origin[a] + to);
      hn::StoreU(gather_lanes(lanes, direction[a]), d, queue_.direction[a] + to);
      hn::StoreU(gather_lanes(lanes, inverse[a]), d, queue_.inverse[a] + to);
      hn::StoreU(gather_lanes(lanes, voxel[a]), d, queue_.voxel[a] + to);
    }
    hn::StoreU(gather_lanes(lanes, enter), d, queue_.enter + to);
    hn::StoreU(gather_lanes(lanes, leave), d, queue_.leave + to);
    hn::StoreU(gather_lanes(lanes, flags), di, queue_.flags + to);
    hn::StoreU(gather_lanes(lanes, hn::Iota(di, int32_t(i))), di, queue_.ray + to);
    queue_.count += uint32_t(__builtin_popcount(lanes));
  }

  /// Puts the next ray into a slot, or one that stands still.
  HWY_INLINE void refill(uint32_t slot) {
    const uint64_t bit = uint64_t{1} << slot;
    slots_.state[slot] = slots_.seen[slot] = slots_.queued[slot] = 0;
    if (next_ == queue_.count) {
      active_ &= ~bit;
      for (uint32_t a = 0; a < 3; ++a) {
        slots_.origin[a][slot] = slots_.direction[a][slot] = slots_.inverse[a][slot] = 0;
        slots_.voxel[a][slot] = slots_.stride[a][slot] = 0;
      }
      slots_.base[slot] = slots_.now[slot] = 0;
      slots_.leave[slot] = -1;
      return;
    }
    const uint32_t i = next_++;
    const float* strides = strides_[queue_.flags[i] & kNegativeAxes];
    for (uint32_t a = 0; a < 3; ++a) {
      slots_.origin[a][slot] = queue_.origin[a][i];
      slots_.direction[a][slot] = queue_.direction[a][i];
      slots_.inverse[a][slot] = queue_.inverse[a][i];
      slots_.voxel[a][slot] = queue_.voxel[a][i];
      slots_.stride[a][slot] = strides[a];
    }
    slots_.base[slot] = strides[3];
    slots_.now[slot] = queue_.enter[i];
    slots_.leave[slot] = queue_.leave[i];
    slots_.queued[slot] = int32_t(i) | kFresh;
    active_ |= bit;
  }

  /// Puts the next rays into the slots of a group that stand still.
  HWY_INLINE void refill_group(uint32_t group) {
    const Floats d;
    const Ints di;
    const uint32_t at = group * kLanes, idle = ~uint32_t(active_ >> at) & kAllLanes;
    const auto wanted = uint32_t(__builtin_popcount(idle));
    if (HWY_UNLIKELY(queue_.count - next_ < wanted)) {
      for (uint32_t left = idle; left != 0; left &= left - 1) refill(at + uint32_t(__builtin_ctz(left)));
      return;
    }
    const auto put = [&](const float* from, float* to) {
      hn::Store(scatter_lanes(idle, hn::Load(d, to + at), from + next_), d, to + at);
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
    const auto flags = scatter_lanes(idle, hn::Zero(di), queue_.flags + next_);
    const auto octants = hn::And(flags, hn::Set(di, kNegativeAxes));
    const auto choose = [&](uint32_t which, float* to) {
      const auto strides = look_up<8>(d, strides_by_octant_[which], octants);
      hn::Store(hn::IfThenElse(filled, strides, hn::Load(d, to + at)), d, to + at);
    };
    for (uint32_t a = 0; a < 3; ++a) choose(a, slots_.stride[a]);
    choose(3, slots_.base);
    const auto number = hn::Set(di, int32_t(next_) | kFresh);
    hn::Store(hn::Add(scatter_lanes(idle, hn::Load(di, slots_.queued + at), kAscending),
                      hn::IfThenElseZero(filled_int, number)),
              di, slots_.queued + at);
    hn::Store(hn::IfThenZeroElse(filled_int, hn::Load(di, slots_.state + at)), di, slots_.state + at);
    hn::Store(hn::IfThenZeroElse(filled_int, hn::Load(di, slots_.seen + at)), di, slots_.seen + at);
    next_ += wanted;
    active_ |= uint64_t{kAllLanes} << at;
  }

  /// Fetches the codes of a group's voxels. The leap that needs them comes after another group's.
  HWY_INLINE void look(uint32_t group) {
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
    const auto active = mask_of(uint32_t((active_ >> at) & kAllLanes));
    const auto number = hn::IfThenElseZero(hn::RebindMask(di, active), hn::ConvertTo(di, place));
    const auto word =
        hn::GatherIndex(di, reinterpret_cast<const int32_t*>(grid_.codes.data()), hn::ShiftRight<3>(number));
    const auto shift = hn::ShiftLeft<2>(hn::And(number, hn::Set(di, 7)));
    const auto code = hn::And(hn::Shr(hn::BitCast(dw, word), hn::BitCast(dw, shift)), hn::Set(dw, 15));
    hn::Store(hn::BitCast(di, code), di, slots_.code + at);
  }

  /// One leap of every lane of a group.
  HWY_INLINE void leap(uint32_t group) {
    const Floats d;
    const Ints di;
    const uint32_t at = group * kLanes;
    hn::Vec<Floats> voxel[3], origin[3], inverse[3], exit[3];
    for (uint32_t a = 0; a < 3; ++a) {
      voxel[a] = hn::Load(d, slots_.voxel[a] + at);
      origin[a] = hn::Load(d, slots_.origin[a] + at);
      inverse[a] = hn::Load(d, slots_.inverse[a] + at);
    }
    const auto active = mask_of(uint32_t((active_ >> at) & kAllLanes));
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
    const auto queued = hn::Load(di, slots_.queued + at);
    const auto ray = hn::AndNot(hn::Set(di, kFresh), queued);
    hn::Store(ray, di, slots_.queued + at);

    const uint32_t turning = bits_of(hn::And(hn::RebindMask(d, turns), active));
    hn::StoreU(gather_lanes(turning, queued), di, log_.turn_queued + log_.turns);
    hn::StoreU(gather_lanes(turning, now), d, log_.turn_t + log_.turns);
    log_.turns += uint32_t(__builtin_popcount(turning));
    if (HWY_UNLIKELY(log_.turns > kMaxTurns)) {
      log_.turns = kMaxTurns;
      full_ = true;
    }
    const uint32_t ending = bits_of(hn::AndNot(goes_on, active));
    active_ &= ~(uint64_t{ending} << at);
    // A ray that ends once the log is full may lack turns: no state is what it is known by.
    const auto seen_or_none = full_ ? hn::Set(di, kIncomplete) : seen;
    hn::StoreU(gather_lanes(ending, ray), di, log_.end_queued + log_.ends);
    hn::StoreU(gather_lanes(ending, seen_or_none), di, log_.end_seen + log_.ends);
    hn::StoreU(gather_lanes(ending, now), d, log_.end_entered + log_.ends);
    log_.ends += uint32_t(__builtin_popcount(ending));
  }

  /// Sorts the log by ray, and hands out the answers.
  HWY_INLINE void collect() {
    std::memset(log_.count, 0, sizeof(log_.count));
    std::memset(log_.starts, 0, sizeof(log_.starts));
    for (uint32_t i = 0; i < log_.turns; ++i) {
      const int32_t queued = log_.turn_queued[i];
      const uint32_t ray = uint32_t(queued & ~kFresh);
      ++log_.count[ray];
      log_.starts[ray] |= uint8_t(queued != int32_t(ray));
    }
    uint32_t sum = 0;
    for (uint32_t ray = 0; ray < queue_.count; ++ray) {
      log_.first[ray] = sum;
      sum += (log_.count[ray] + 1) & ~1u;  // room for the end of a run that the segment ends in
      log_.count[ray] = 0;
    }
    for (uint32_t i = 0; i < log_.turns; ++i) {
      const auto ray = uint32_t(log_.turn_queued[i] & ~kFresh);
      log_.t[log_.first[ray] + log_.count[ray]++] = log_.turn_t[i];
    }
    constexpr int32_t kBoth = kOutsideBit | kInsideBit;
    for (uint32_t i = 0; i < log_.ends; ++i) {
      const auto queued = uint32_t(log_.end_queued[i]);
      const auto ray = uint32_t(queue_.ray[queued]);
      const int32_t seen = log_.end_seen[i];
      const uint32_t turns = log_.count[queued];
      if (HWY_UNLIKELY(seen == kIncomplete)) {
        sink_.hard(ray);
      } else if ((seen & kBoth) == kBoth) {
        answers_->logit[ray] = -kCertainLogit;
      } else if (HWY_UNLIKELY(turns > 2 * kMaxPendingRuns)) {
        sink_.hard(ray);
      } else if (turns != 0) {
        float* t = log_.t + log_.first[queued];
        if (turns % 2 == 1) t[turns] = max_of(queue_.leave[queued], log_.end_entered[i]);
        sink_.ambiguous(queue_, queued, seen, log_.starts[queued] != 0, turns, t);
      }
    }
  }

  const SegmentField& field_;
  const WalkGrid& grid_;
  Queue& queue_;
  Slots& slots_;
  WalkLog& log_;
  Sink& sink_;
  AnswerBatch* answers_ = nullptr;
  float strides_[8][4];                        ///< [octant]: of the mirrored voxels, then the base
  alignas(64) float strides_by_octant_[4][8];  ///< the same, transposed
  uint32_t next_ = 0;
  uint64_t active_ = 0;  ///< slots as bits
  bool full_ = false;    ///< the log of turns
};

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
