// The walk in SIMD: a ray to a lane.
//
// Rays that leap over empty voxels and rays that pass cells have lanes of their own, because a cell takes
// more than twice the work of a leap. A ray whose next piece is of the other sort waits for a few others, and
// they move together. There are several groups of lanes of each sort, which take turns, so that one's loads
// hide another's.
//
// Each axis is mirrored where the direction is negative: (k - o) * inv keeps its bits when all three change
// sign, and so do heights when normals do, too. Every ray then walks upward. A step goes as far as the piece,
// or the box around the voxel, reaches: to the crossing (t, axis) at which the segment leaves it. In which
// finest cell the ray is then along the other axes follows from their own crossings, counted in the
// reference's order (t, then the lower axis). An estimate from below that is off by at most one cell is put
// right by one such comparison.
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
#include "kernels/packed/walk_grid.hpp"
#include "kernels/reference/object_kernel.hpp"
#include "kernels/reference/segment/walk.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

/// Groups of lanes of one sort that take turns: while one's voxels are fetched, another goes on.
constexpr uint32_t kGroups = 2;
constexpr uint32_t kSlots = kGroups * kLanes;
/// So many lanes of a group must have nothing to do before rays are moved: fewer cost more than they fill.
constexpr uint32_t kIdleToLeap = kLanes * 3 / 8, kIdleToPass = kLanes / 4;

/// Rays that wait for lanes of one sort, before the others get to work; few, so that they stay in the nearest
/// cache.
inline constexpr uint32_t kWaitingRays = 64;
/// Runs that are logged before answers are collected. Where those of a few
/// rays are more than there is room for, the reference answers them.
inline constexpr uint32_t kMaxOpenParts = 6 * kBatchRays;
/// Runs of one ray that the network's part has room for.
inline constexpr uint32_t kMaxPendingRuns = 32;

/// Of a ray of the batch.
enum RayFlags : int32_t { kFlatAxis = 1, kEntersGrid = 8, kLeavesGrid = 16 };

/// What is known of a ray on its way, in one word.
enum RayInfo : int32_t {
  kOctant = 7,     ///< axes whose direction is negative
  kSeenShift = 3,  ///< SeenBits
  kSeenSides = kSeenBoth << kSeenShift,
  kHasRun = 1 << 5,      ///< some piece was open
  kIncomplete = 1 << 6,  ///< its open parts are not all in the log
  kRayShift = 7          ///< its number in the batch
};

/// Whole vectors are read and written, also where the last entries are fewer.
inline constexpr uint32_t kSlack = 16;

/// A ray being walked, word by word; in mirrored finest cells.
enum RayMember : uint32_t {
  kOrigin = 0,
  kDirection = 3,
  kInverse = 6,
  kCell = 9,  ///< in which it is
  kNow = 12,  ///< the t at which it came there
  kLeave,
  kInfo,  ///< RayInfo
  kWord,  ///< of its voxel
  kRayMembers
};
template <uint32_t kRoom>
struct Rays {
  alignas(64) float members[kRayMembers][kRoom];
};

/// Rays of one sort.
struct Sort {
  /// All that wait, what comes from the batch, and both groups of the other sort, none of whose rays goes on.
  static constexpr uint32_t kRoom = kWaitingRays + (1 + kGroups) * kLanes + kSlack;
  Rays<kSlots> slots;
  Rays<kRoom> waiting;  ///< the last comes first
};

/// What happens on the way, in the order of the steps, and sorted by ray at the end.
struct WalkLog {
  alignas(64) int32_t part_info[kMaxOpenParts + kSlack];  ///< a cell is open: for which ray,
  float part_begin[kMaxOpenParts + kSlack];               ///< and from which t
  float part_end[kMaxOpenParts + kSlack];                 ///< to which,
  int32_t part_heights[kMaxOpenParts + kSlack];           ///< and how high both are
  int32_t end_info[kBatchRays + kSlack];                  ///< a ray is done: RayInfo
  float enter[kBatchRays + kSlack];                       ///< [ray]
  float leave[kBatchRays + kSlack];                       ///< [ray]
  int32_t flags[kBatchRays + kSlack];                     ///< [ray] RayFlags
  int32_t rank[kBatchRays + kSlack];  ///< [ray] among those that the walk leaves open; -1 where it does not
};

/// Lanes of a group, as bits.
struct Lanes {
  uint32_t held = 0;   ///< with a ray
  uint32_t ready = 0;  ///< whose ray goes on here
  uint32_t done = 0;   ///< whose ray is done
};

/// How far a walk is. Kept by itself, so that no store through a pointer can seem to change it.
struct Progress {
  Lanes leaping[kGroups], passing[kGroups];
  uint32_t to_leap = 0, to_pass = 0;  ///< rays that wait
  uint32_t parts = 0, ends = 0;       ///< in the log
  bool full = false;                  ///< the log of open parts
};

/// Rays that the walk leaves open: the first `count` ends of the log are theirs.
struct OpenRays {
  uint32_t count;
  alignas(64) int32_t runs[kBatchRays + kSlack];  ///< how many
  int32_t first[kBatchRays + kSlack];             ///< number of the first in the arrays below
  float begin[kMaxOpenParts], end[kMaxOpenParts];
  int32_t heights[kMaxOpenParts];
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
         Sort& leaping, Sort& passing, WalkLog& log, OpenRays& open, HardRays& hard)
      : field_(field),
        voxels_(reinterpret_cast<const int32_t*>(grid.voxels.data())),
        parts_(reinterpret_cast<const int32_t*>(grid.parts.data())),
        batch_(batch),
        answers_(answers),
        leaping_(leaping),
        passing_(passing),
        log_(log),
        open_(open),
        hard_(hard) {
    const float stride[3] = {1, float(field.voxels[0]), float(field.voxels[0] * field.voxels[1])};
    for (uint32_t octant = 0; octant < 8; ++octant) {
      base_[octant] = 0;
      reach_[octant] = 0;
      for (uint32_t a = 0; a < 3; ++a) {
        const bool negative = (octant >> a) & 1;
        strides_[a][octant] = negative ? -stride[a] : stride[a];
        // Mirrored voxel v is voxel -v - 1.
        if (negative) base_[octant] -= stride[a];
        reach_[octant] |= (negative ? 0x0f : 0xf0) << (8 + 8 * a);
      }
    }
    std::memset(&leaping_.slots, 0, sizeof(leaping_.slots));
    std::memset(&passing_.slots, 0, sizeof(passing_.slots));
    hard_.count = 0;
  }

  /// Answers rays that the walk alone decides, and lists the others. False where there are no more.
  bool walk() {
    if (taken_ >= batch_.count) return false;
    Progress now;
    do {
      leap_all(now);
      pass_all(now);
    } while (now.to_leap + now.to_pass > 0 || any_held(now) || may_take(now));
    collect(now);
    return true;
  }

 private:
  static bool any_held(const Progress& p) {
    uint32_t held = 0;
    for (uint32_t group = 0; group < kGroups; ++group) held |= p.leaping[group].held | p.passing[group].held;
    return held != 0;
  }

  bool may_take(const Progress& p) const { return taken_ < batch_.count && p.parts <= kMaxOpenParts / 2; }

  static HWY_INLINE hn::Vec<Ints> ints(hn::Vec<Floats> v) { return hn::BitCast(Ints(), v); }
  static HWY_INLINE hn::Vec<Floats> floats(hn::Vec<Ints> v) { return hn::BitCast(Floats(), v); }

  /// The words of the voxels that hold some cells, of the given lanes.
  HWY_INLINE hn::Vec<Ints> words_at(const hn::Vec<Floats> (&cell)[3], hn::Vec<Ints> info,
                                    hn::Mask<Floats> lanes) const {
    const Floats d;
    const Ints di;
    const auto octant = hn::And(info, hn::Set(di, kOctant));
    auto place = look_up<8>(d, base_, octant);  // exact: integers below 2^24
    for (uint32_t a = 0; a < 3; ++a) {
      const auto voxel = hn::Floor(hn::Mul(cell[a], hn::Set(d, field_.voxels_per_cell)));
      place = hn::MulAdd(voxel, look_up<8>(d, strides_[a], octant), place);
    }
    // Lanes that are done may have left the grid.
    const auto number = hn::IfThenElseZero(hn::RebindMask(di, lanes), to_ints(place));
    return hn::GatherIndex(di, voxels_, number);
  }

  static HWY_INLINE hn::Mask<Ints> is_kind(hn::Vec<Ints> word, WordKind kind) {
    const Ints di;
    return hn::Eq(hn::And(word, hn::Set(di, 15)), hn::Set(di, int32_t(kind)));
  }

  /// To grid space, clipped; rays that miss the grid are answered here.
  HWY_INLINE void take(uint32_t i, Progress& p) {
    const Floats d;
    const Ints di;
    const auto zero = hn::Zero(d), one = hn::Set(d, 1.0f);
    const auto tmin = hn::Load(d, batch_.tmin + i), tmax = hn::Load(d, batch_.tmax + i);
    const auto present = hn::FirstN(d, batch_.count - i);
    const auto scale = hn::Set(d, field_.cells_per_unit);
    hn::Vec<Floats> origin[3], direction[3], inverse[3], cell[3];

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
    hn::Mask<Floats> negative[3], flat[3];
    for (uint32_t a = 0; a < 3; ++a) {
      flat[a] = hn::Lt(hn::Abs(direction[a]), flat_limit);
      // Crossings along an axis that is not moved along come out as infinite, but not where the origin lies
      // on the grid's far face: no plane may be met there.
      const auto size = hn::Set(d, float(field_.voxels[a] << field_.levels));
      easy = hn::AndNot(hn::And(flat[a], hn::Eq(origin[a], size)), easy);
    }
    auto meets = easy;
    auto enter = tmin, leave = tmax;
    auto flags = hn::Zero(di), info = hn::Iota(di, int32_t(i));
    info = hn::ShiftLeft<kRayShift>(info);
    for (uint32_t a = 0; a < 3; ++a) {
      const auto size = hn::Set(d, float(field_.voxels[a] << field_.levels));
      const auto beside = hn::And(flat[a], hn::Or(hn::Lt(origin[a], zero), hn::Gt(origin[a], size)));
      meets = hn::AndNot(beside, meets);
      negative[a] = hn::AndNot(flat[a], hn::Lt(direction[a], zero));
      origin[a] = hn::IfThenElse(negative[a], hn::Neg(origin[a]), origin[a]);
      direction[a] = hn::IfThenZeroElse(flat[a], hn::Abs(direction[a]));
      inverse[a] = hn::Div(one, direction[a]);
      const auto low = hn::IfThenElseZero(negative[a], hn::Neg(size));
      const auto high = hn::IfThenZeroElse(negative[a], size);
      const auto first = hn::Mul(hn::Sub(low, origin[a]), inverse[a]);
      const auto last = hn::Mul(hn::Sub(high, origin[a]), inverse[a]);
      const auto later = hn::AndNot(flat[a], hn::Gt(first, enter));
      const auto sooner = hn::AndNot(flat[a], hn::Lt(last, leave));
      enter = hn::IfThenElse(later, first, enter);
      leave = hn::IfThenElse(sooner, last, leave);
      info = hn::Or(info, hn::IfThenElseZero(hn::RebindMask(di, negative[a]), hn::Set(di, 1 << a)));
      flags = hn::Or(flags, hn::IfThenElseZero(hn::RebindMask(di, flat[a]), hn::Set(di, kFlatAxis << a)));
      flags = hn::Or(flags, hn::IfThenElseZero(hn::RebindMask(di, later), hn::Set(di, kEntersGrid)));
      flags = hn::Or(flags, hn::IfThenElseZero(hn::RebindMask(di, sooner), hn::Set(di, kLeavesGrid)));
    }
    meets = hn::And(meets, hn::Le(enter, leave));
    const auto clipped = hn::TestBit(flags, hn::Set(di, kEntersGrid));
    const auto clipped_too = hn::TestBit(flags, hn::Set(di, kLeavesGrid));
    info = hn::Or(info, hn::IfThenElseZero(hn::Or(clipped, clipped_too),
                                           hn::Set(di, int32_t(kSeenOutside) << kSeenShift)));
    for (uint32_t a = 0; a < 3; ++a) {
      auto at = hn::Add(origin[a], hn::Mul(enter, direction[a]));
      at = hn::IfThenElse(negative[a], hn::Neg(at), at);
      const auto top = hn::Set(d, float((field_.voxels[a] << field_.levels) - 1));
      const auto index = hn::Trunc(hn::Min(hn::Max(at, zero), top));
      cell[a] = hn::IfThenElse(negative[a], hn::Sub(hn::Set(d, -1.0f), index), index);
    }

    hn::StoreU(hn::Set(di, kCertainLogit), di, answers_.logit + i);
    std::memset(answers_.certain + i, 1, std::min(kLanes, batch_.count - i));
    const uint32_t hard = bits_of(hn::AndNot(easy, present));
    hn::StoreU(gather_lanes(hard, hn::Iota(Words(), i)), Words(), hard_.ray + hard_.count);
    hard_.count += uint32_t(__builtin_popcount(hard));

    hn::StoreU(enter, d, log_.enter + i);
    hn::StoreU(leave, d, log_.leave + i);
    hn::StoreU(flags, di, log_.flags + i);
    hn::StoreU(hn::Set(di, -1), di, log_.rank + i);

    const auto word = words_at(cell, info, meets);
    const auto empty = hn::RebindMask(d, is_kind(word, kEmptyVoxel));
    const auto put = [&](Sort& sort, uint32_t& count, uint32_t lanes) {
      if (lanes == 0) return;
      const LanesTogether together(lanes);
      const auto member = [&](uint32_t m, hn::Vec<Floats> v) {
        hn::StoreU(together(v), d, sort.waiting.members[m] + count);
      };
      for (uint32_t a = 0; a < 3; ++a) {
        member(kOrigin + a, origin[a]);
        member(kDirection + a, direction[a]);
        member(kInverse + a, inverse[a]);
        member(kCell + a, cell[a]);
      }
      member(kNow, enter);
      member(kLeave, leave);
      member(kInfo, floats(info));
      member(kWord, floats(word));
      count += uint32_t(__builtin_popcount(lanes));
    };
    put(leaping_, p.to_leap, bits_of(hn::And(meets, empty)));
    put(passing_, p.to_pass, bits_of(hn::AndNot(empty, meets)));
  }

  /// Moves chosen rays of a group to those that wait for lanes of the other sort.
  static HWY_INLINE void move_out(const Sort& from, uint32_t at, uint32_t lanes, Sort& to, uint32_t& count) {
    const Floats d;
    const LanesTogether together(lanes);
    for (uint32_t m = 0; m < kRayMembers; ++m)
      hn::StoreU(together(hn::Load(d, from.slots.members[m] + at)), d, to.waiting.members[m] + count);
    count += uint32_t(__builtin_popcount(lanes));
  }

  /// Puts waiting rays into the idle lanes of a group, as far as there are any. Returns the lanes filled.
  static HWY_INLINE uint32_t move_in(Sort& sort, uint32_t& count, uint32_t at, uint32_t idle) {
    const Floats d;
    while (uint32_t(__builtin_popcount(idle)) > count) idle &= idle - 1;
    count -= uint32_t(__builtin_popcount(idle));
    const LanesApart apart(idle);
    for (uint32_t m = 0; m < kRayMembers; ++m) {
      float* const slots = sort.slots.members[m] + at;
      hn::Store(apart(hn::Load(d, slots), sort.waiting.members[m] + count), d, slots);
    }
    return idle;
  }

  /// Logs that the chosen rays are done.
  HWY_INLINE void log_ends(const Sort& sort, uint32_t at, uint32_t lanes, Progress& p) {
    const Floats d;
    const Ints di;
    // A ray that ends once the log is full may lack parts.
    auto info = ints(hn::Load(d, sort.slots.members[kInfo] + at));
    if (HWY_UNLIKELY(p.full)) info = hn::Or(info, hn::Set(di, kIncomplete));
    // What is visible without the network has been answered.
    const auto sides = hn::Set(di, kSeenSides);
    const auto blocked = hn::Eq(hn::And(info, sides), sides);
    lanes &= bits_of(hn::Or(blocked, hn::TestBit(info, hn::Set(di, kHasRun))));
    hn::StoreU(gather_lanes(lanes, info), di, log_.end_info + p.ends);
    p.ends += uint32_t(__builtin_popcount(lanes));
  }
  HWY_INLINE void log_open(hn::Vec<Ints> info, hn::Vec<Floats> begin, hn::Vec<Floats> end,
                           hn::Vec<Ints> heights, uint32_t lanes, Progress& p) {
    const Floats d;
    const Ints di;
    hn::StoreU(gather_lanes(lanes, info), di, log_.part_info + p.parts);
    hn::StoreU(gather_lanes(lanes, begin), d, log_.part_begin + p.parts);
    hn::StoreU(gather_lanes(lanes, end), d, log_.part_end + p.parts);
    hn::StoreU(gather_lanes(lanes, heights), di, log_.part_heights + p.parts);
    p.parts += uint32_t(__builtin_popcount(lanes));
    if (HWY_UNLIKELY(p.parts > kMaxOpenParts)) {
      p.parts = kMaxOpenParts;
      p.full = true;
    }
  }

  /// Fills idle lanes with rays that leap, and takes more from the batch where there are few.
  HWY_INLINE void exchange_leaping(uint32_t group, Progress& p) {
    Lanes& lanes = p.leaping[group];
    const uint32_t at = group * kLanes;
    if (lanes.done != 0) log_ends(leaping_, at, lanes.done, p);
    // The last few of a batch go on with those that pass cells.
    if (p.to_leap == 0 && !may_take(p) && uint32_t(__builtin_popcount(lanes.ready)) <= kLanes / 2)
      lanes.ready = 0;
    const uint32_t leaving = lanes.held & ~(lanes.done | lanes.ready);
    if (leaving != 0) move_out(leaping_, at, leaving, passing_, p.to_pass);
    while (p.to_leap < kLanes && p.to_pass < kWaitingRays && may_take(p)) {
      take(taken_, p);
      taken_ += kLanes;
    }
    if (p.to_leap > 0) lanes.ready |= move_in(leaping_, p.to_leap, at, ~lanes.ready & kAllLanes);
    lanes.held = lanes.ready;
    lanes.done = 0;
  }

  /// The same with rays that pass cells. Those that are in empty voxels meanwhile leave, unless nobody is
  /// there to take their lanes.
  HWY_INLINE void exchange_passing(uint32_t group, Progress& p) {
    Lanes& lanes = p.passing[group];
    const uint32_t at = group * kLanes;
    if (lanes.done != 0) log_ends(passing_, at, lanes.done, p);
    const auto word = ints(hn::Load(Floats(), passing_.slots.members[kWord] + at));
    uint32_t leaving = lanes.ready & bits_of(is_kind(word, kEmptyVoxel));
    if (p.to_pass < kLanes && !may_take(p)) leaving = 0;
    if (leaving != 0) {
      move_out(passing_, at, leaving, leaping_, p.to_leap);
      lanes.ready &= ~leaving;
    }
    while (p.to_pass < kLanes && p.to_leap < kWaitingRays && may_take(p)) {
      take(taken_, p);
      taken_ += kLanes;
    }
    if (p.to_pass > 0) lanes.ready |= move_in(passing_, p.to_pass, at, ~lanes.ready & kAllLanes);
    lanes.held = lanes.ready;
    lanes.done = 0;
  }

  /// Leaps until so many rays wait for cells that those come first, or none leaps any more.
  HWY_INLINE void leap_all(Progress& p) {
    for (bool any = true; any && p.to_pass < kWaitingRays;) {
      any = false;
      for (uint32_t group = 0; group < kGroups; ++group) {
        Lanes& lanes = p.leaping[group];
        if (uint32_t(__builtin_popcount(lanes.ready)) <= kLanes - kIdleToLeap) exchange_leaping(group, p);
        if (lanes.ready == 0) continue;
        any = true;
        leap(group, p);
        look(leaping_, group * kLanes, lanes);
        lanes.ready &= bits_of(
            is_kind(ints(hn::Load(Floats(), leaping_.slots.members[kWord] + group * kLanes)), kEmptyVoxel));
      }
    }
  }

  HWY_INLINE void pass_all(Progress& p) {
    for (bool any = true; any && p.to_leap < kWaitingRays;) {
      any = false;
      for (uint32_t group = 0; group < kGroups; ++group) {
        Lanes& lanes = p.passing[group];
        if (uint32_t(__builtin_popcount(lanes.ready)) <= kLanes - kIdleToPass) exchange_passing(group, p);
        if (lanes.ready == 0) continue;
        any = true;
        pass(group, p);
        look(passing_, group * kLanes, lanes);
      }
    }
  }

  /// Fetches the words of a group's voxels. The step that needs them comes after another group's.
  HWY_INLINE void look(Sort& sort, uint32_t at, const Lanes& lanes) const {
    const Floats d;
    hn::Vec<Floats> cell[3];
    for (uint32_t a = 0; a < 3; ++a) cell[a] = hn::Load(d, sort.slots.members[kCell + a] + at);
    const auto info = ints(hn::Load(d, sort.slots.members[kInfo] + at));
    const auto word = words_at(cell, info, mask_of(lanes.held & ~lanes.done));
    hn::Store(floats(word), d, sort.slots.members[kWord] + at);
  }

  /// Rays of a group, as steps need them.
  struct Group {
    hn::Vec<Floats> origin[3], direction[3], inverse[3], cell[3], now;
    hn::Vec<Ints> info, word;

    HWY_INLINE Group(const Sort& sort, uint32_t at) {
      const Floats d;
      for (uint32_t a = 0; a < 3; ++a) {
        origin[a] = hn::Load(d, sort.slots.members[kOrigin + a] + at);
        direction[a] = hn::Load(d, sort.slots.members[kDirection + a] + at);
        inverse[a] = hn::Load(d, sort.slots.members[kInverse + a] + at);
        cell[a] = hn::Load(d, sort.slots.members[kCell + a] + at);
      }
      now = hn::Load(d, sort.slots.members[kNow] + at);
      info = ints(hn::Load(d, sort.slots.members[kInfo] + at));
      word = ints(hn::Load(d, sort.slots.members[kWord] + at));
    }
  };

  /// How far boxes reach along the three axes, in the order of bytes 1 to 3 and in their place.
  HWY_INLINE hn::Vec<Ints> reach_of(const Group& rays) const {
    const Ints di;
    const Words dw;
    const auto octant = hn::And(rays.info, hn::Set(di, kOctant));
    const auto reach = hn::BitCast(dw, hn::And(rays.word, look_up<8>(di, reach_, octant)));
    return hn::BitCast(di, hn::Or(reach, hn::ShiftRight<4>(reach)));
  }
  template <uint32_t kAxis>
  HWY_INLINE hn::Vec<Floats> extended(hn::Vec<Ints> reach, hn::Vec<Floats> plane) const {
    const Floats d;
    const auto voxels = hn::And(reach, hn::Set(Ints(), 15 << (8 + 8 * kAxis)));
    const float cells = static_cast<float>(1u << field_.levels) / static_cast<float>(1u << (8 + 8 * kAxis));
    return hn::MulAdd(hn::ConvertTo(d, voxels), hn::Set(d, cells), plane);  // exact
  }

  /// Moves rays to the cell beyond the nearest of their exits; those for which `t` lies before anything stay.
  static HWY_INLINE void move_on(Sort& sort, uint32_t at, const Group& rays, const hn::Vec<Floats> (&exit)[3],
                                 hn::Vec<Floats> t) {
    const Floats d;
    const auto along_0 = hn::Eq(exit[0], t);
    const auto below_2 = hn::Or(along_0, hn::Eq(exit[1], t));
    for (uint32_t a = 0; a < 3; ++a) {
      const auto reached = hn::MulAdd(t, rays.direction[a], rays.origin[a]);
      const auto estimate = hn::Floor(hn::Sub(reached, hn::Set(d, kEstimateSlack)));
      const auto before = hn::Max(estimate, rays.cell[a]);
      const auto plane = hn::Add(before, hn::Set(d, 1.0f));
      const auto crossing = hn::Mul(hn::Sub(plane, rays.origin[a]), rays.inverse[a]);
      // In the reference's order the crossing of a lower axis at the same t comes first.
      auto crossed = hn::Le(crossing, t);
      if (a > 0) crossed = hn::AndNot(hn::And(a == 1 ? along_0 : below_2, hn::Eq(crossing, t)), crossed);
      hn::Store(hn::IfThenElse(crossed, plane, before), d, sort.slots.members[kCell + a] + at);
    }
  }

  /// One leap of every lane of a group.
  HWY_INLINE void leap(uint32_t group, Progress& p) {
    const Floats d;
    const Ints di;
    const uint32_t at = group * kLanes;
    Lanes& lanes = p.leaping[group];
    const Group rays(leaping_, at);
    const auto ready = mask_of(lanes.ready);

    const auto reach = reach_of(rays);
    const auto side = hn::Set(d, static_cast<float>(1u << field_.levels));
    hn::Vec<Floats> exit[3];
    for (uint32_t a = 0; a < 3; ++a) {
      const auto voxel = hn::Floor(hn::Mul(rays.cell[a], hn::Set(d, field_.voxels_per_cell)));
      const auto next = hn::MulAdd(voxel, side, side);  // exact
      const auto plane = a == 0   ? extended<0>(reach, next)
                         : a == 1 ? extended<1>(reach, next)
                                  : extended<2>(reach, next);
      exit[a] = hn::Mul(hn::Sub(plane, rays.origin[a]), rays.inverse[a]);
    }
    const auto nearest = hn::Min(hn::Min(exit[0], exit[1]), exit[2]);

    const auto sides = hn::Set(di, kSeenSides);
    const auto seen = hn::And(hn::ShiftRight<4 - kSeenShift>(rays.word), sides);
    const auto info = hn::Or(rays.info, hn::IfThenElseZero(hn::RebindMask(di, ready), seen));
    const auto blocked = hn::RebindMask(d, hn::Eq(hn::And(info, sides), sides));
    const auto leave = hn::Load(d, leaping_.slots.members[kLeave] + at);
    const uint32_t goes_on = bits_of(hn::AndNot(blocked, hn::Lt(nearest, leave))) & lanes.ready;

    const auto t = hn::IfThenElse(ready, nearest, hn::Set(d, -kNever));
    move_on(leaping_, at, rays, exit, t);
    hn::Store(hn::Max(t, rays.now), d, leaping_.slots.members[kNow] + at);
    hn::Store(floats(info), d, leaping_.slots.members[kInfo] + at);
    lanes.done |= lanes.ready & ~goes_on;
    lanes.ready = goes_on;
  }

  /// Goes from cells that are cut to the parts that hold the rays, down to one that is not.
  HWY_INLINE void follow_links(Group& rays, hn::Mask<Floats> ready, hn::Vec<Floats>& size) const {
    const Floats d;
    const Ints di;
    const Words dw;
    auto link = hn::And(is_kind(rays.word, kLink), hn::RebindMask(di, ready));
    if (hn::AllFalse(di, link)) return;
    const auto one = hn::Set(di, 1);
    hn::Vec<Ints> cell[3];
    for (uint32_t a = 0; a < 3; ++a) cell[a] = to_ints(rays.cell[a]);
    const auto octant = hn::And(rays.info, hn::Set(di, kOctant));
    for (uint32_t level = field_.levels; level-- > 0;) {
      // Mirrored cell c is cell -c - 1, whose bits are the other ones.
      const auto half = hn::Set(di, 1 << level);
      auto part = octant;
      for (uint32_t a = 0; a < 3; ++a)
        part = hn::Xor(part, hn::IfThenElseZero(hn::TestBit(cell[a], half), hn::Set(di, 1 << a)));
      const auto mask = hn::ShiftRight<4>(rays.word);
      const auto bit = hn::Shl(one, part);
      const auto there = hn::And(hn::TestBit(mask, bit), link);
      const auto before = hn::PopulationCount(hn::BitCast(dw, hn::And(mask, hn::Sub(bit, one))));
      const auto first = hn::ShiftRight<12>(hn::BitCast(dw, rays.word));
      const auto index = hn::IfThenElseZero(there, hn::BitCast(di, hn::Add(first, before)));
      const auto word =
          hn::IfThenElse(there, hn::GatherIndex(di, parts_, index), hn::Set(di, int32_t(kEmptyPart)));
      rays.word = hn::IfThenElse(link, word, rays.word);
      size = hn::IfThenElse(hn::RebindMask(d, link), hn::Set(d, static_cast<float>(1u << level)), size);
      link = hn::And(is_kind(rays.word, kLink), link);
      if (hn::AllFalse(di, link)) return;
    }
  }

  /// One piece of every lane of a group: cells, and empty voxels, too.
  HWY_INLINE void pass(uint32_t group, Progress& p) {
    const Floats d;
    const Ints di;
    const Words dw;
    const uint32_t at = group * kLanes;
    Lanes& lanes = p.passing[group];
    Group rays(passing_, at);
    const auto ready = mask_of(lanes.ready);
    auto size = hn::Set(d, static_cast<float>(1u << field_.levels));
    follow_links(rays, ready, size);
    const auto empty = is_kind(rays.word, kEmptyVoxel);

    // Exits; a part that is not there has no box beyond itself.
    const auto reach = hn::IfThenElseZero(empty, reach_of(rays));
    const auto inverse_size = floats(hn::Sub(hn::Set(di, 0x7f000000), ints(size)));
    hn::Vec<Floats> low[3], exit[3];
    for (uint32_t a = 0; a < 3; ++a) {
      low[a] = hn::Mul(hn::Floor(hn::Mul(rays.cell[a], inverse_size)), size);
      const auto high = hn::Add(low[a], size);
      const auto plane = a == 0   ? extended<0>(reach, high)
                         : a == 1 ? extended<1>(reach, high)
                                  : extended<2>(reach, high);
      exit[a] = hn::Mul(hn::Sub(plane, rays.origin[a]), rays.inverse[a]);
    }
    const auto nearest = hn::Min(hn::Min(exit[0], exit[1]), exit[2]);
    const auto leave = hn::Load(d, passing_.slots.members[kLeave] + at);
    const auto leaves_piece = hn::Lt(nearest, leave);
    const auto left = hn::Max(hn::IfThenElse(leaves_piece, nearest, leave), rays.now);

    // Heights, as pass_cell() has them, with mirrored normals.
    const auto bits_6 = hn::Set(di, 63);
    const auto half_sum = hn::Set(d, static_cast<float>(kNormalHalf));
    const auto u = hn::Sub(hn::ConvertTo(d, hn::And(hn::ShiftRight<4>(rays.word), bits_6)), half_sum);
    const auto v = hn::Sub(hn::ConvertTo(d, hn::And(hn::ShiftRight<10>(rays.word), bits_6)), half_sum);
    const auto width = hn::Max(hn::Abs(u), hn::Abs(v));
    const hn::Vec<Floats> upright[3] = {
        hn::Add(u, v), hn::Sub(u, v),
        hn::Sub(hn::Set(d, static_cast<float>(kNormalSum)), hn::Add(width, width))};
    hn::Vec<Floats> enters[3], leaves[3];
    const auto half_size = hn::Mul(size, hn::Set(d, 0.5f));
    for (uint32_t a = 0; a < 3; ++a) {
      const auto sign = hn::And(hn::ShiftLeftSame(rays.info, int(31 - a)), hn::Set(di, INT32_MIN));
      const auto normal = floats(hn::Xor(ints(upright[a]), sign));
      const auto from = hn::Sub(rays.origin[a], hn::Add(low[a], half_size));
      enters[a] = hn::Mul(normal, hn::Add(from, hn::Mul(rays.now, rays.direction[a])));
      leaves[a] = hn::Mul(normal, hn::Add(from, hn::Mul(left, rays.direction[a])));
    }
    const auto enter_height = hn::Add(hn::Add(enters[0], enters[1]), enters[2]);
    const auto leave_height = hn::Add(hn::Add(leaves[0], leaves[1]), leaves[2]);
    // All of this is exact, fused or not.
    const auto word = hn::BitCast(dw, rays.word);
    const auto half_span = hn::MulAdd(size, half_sum, hn::Set(d, 1.0f));
    const auto step = hn::Mul(half_span, hn::Set(d, 1.0f / (kPlanePlaces / 2)));
    const auto lower_place = hn::BitCast(di, hn::And(hn::ShiftRight<16>(word), hn::Set(dw, 255)));
    const auto upper_place = hn::BitCast(di, hn::ShiftRight<24>(word));
    const auto lower = hn::MulSub(hn::ConvertTo(d, lower_place), step, half_span);
    const auto upper = hn::MulSub(hn::ConvertTo(d, upper_place), step, hn::Sub(half_span, step));

    const auto enters_above = hn::Gt(enter_height, upper), enters_below = hn::Lt(enter_height, lower);
    const auto leaves_above = hn::Gt(leave_height, upper), leaves_below = hn::Lt(leave_height, lower);
    const auto misses = hn::Or(hn::And(enters_above, leaves_above), hn::And(enters_below, leaves_below));
    const auto crosses = hn::Or(hn::And(enters_above, leaves_below), hn::And(enters_below, leaves_above));
    const auto cells = hn::AndNot(hn::RebindMask(d, empty), ready);
    const auto open = hn::AndNot(misses, cells);

    // Kinds from kPlaneKinds on have no bits in these.
    const auto kind = hn::And(word, hn::Set(dw, 15));
    const auto twice = hn::Add(kind, kind);
    const auto wall = hn::TestBit(hn::Shr(hn::Set(dw, kWallKinds), kind), hn::Set(dw, 1));
    const auto above = hn::BitCast(di, hn::Shr(hn::Set(dw, kSidesAbove), twice));
    const auto below = hn::BitCast(di, hn::Shr(hn::Set(dw, kSidesBelow), twice));
    const auto is_above = hn::RebindMask(di, hn::Or(enters_above, leaves_above));
    const auto is_below = hn::RebindMask(di, hn::Or(enters_below, leaves_below));
    const auto beside = hn::Or(hn::IfThenElseZero(is_above, above), hn::IfThenElseZero(is_below, below));
    const auto seen = hn::IfThenElse(empty, hn::ShiftRight<4>(rays.word), beside);
    const auto sides = hn::Set(di, kSeenSides);
    const auto through_wall = hn::And(hn::RebindMask(di, crosses), hn::RebindMask(di, wall));
    const auto new_sides =
        hn::Or(hn::And(hn::ShiftLeft<kSeenShift>(seen), sides), hn::IfThenElseZero(through_wall, sides));

    if (const uint32_t open_lanes = bits_of(open); open_lanes != 0) {
      const auto rate = hn::Div(hn::Sub(left, rays.now), hn::Sub(leave_height, enter_height));
      const auto first = hn::Sub(hn::IfThenElse(enters_above, upper, lower), enter_height);
      const auto last = hn::Sub(hn::IfThenElse(leaves_above, upper, lower), enter_height);
      const auto from = hn::Min(hn::Max(hn::Add(rays.now, hn::Mul(first, rate)), rays.now), left);
      const auto begin = hn::IfThenElse(hn::Or(enters_above, enters_below), from, rays.now);
      const auto to = hn::Min(hn::Max(hn::Add(rays.now, hn::Mul(last, rate)), begin), left);
      const auto end = hn::IfThenElse(hn::Or(leaves_above, leaves_below), to, left);
      const auto top = hn::Set(d, static_cast<float>(kTopHeight));
      const auto scale = hn::Div(top, hn::Sub(upper, lower));
      const auto height = [&](hn::Vec<Floats> h) HWY_ATTR {
        const auto scaled = hn::Add(hn::Mul(hn::Sub(h, lower), scale), hn::Set(d, 0.5f));
        return to_ints(hn::Min(hn::Max(scaled, hn::Zero(d)), top));
      };
      const auto heights = hn::Or(height(enter_height), hn::ShiftLeft<8>(height(leave_height)));
      log_open(rays.info, begin, end, heights, open_lanes, p);
    }
    const auto run_bit = hn::IfThenElseZero(hn::RebindMask(di, open), hn::Set(di, int32_t(kHasRun)));
    const auto info = hn::Or(hn::Or(rays.info, new_sides), run_bit);
    const auto blocked = hn::RebindMask(d, hn::Eq(hn::And(info, sides), sides));
    const uint32_t goes_on = bits_of(hn::AndNot(blocked, leaves_piece)) & lanes.ready;

    move_on(passing_, at, rays, exit, hn::IfThenElse(ready, nearest, hn::Set(d, -kNever)));
    hn::Store(hn::IfThenElse(ready, left, rays.now), d, passing_.slots.members[kNow] + at);
    hn::Store(floats(hn::IfThenElse(hn::RebindMask(di, ready), info, rays.info)), d,
              passing_.slots.members[kInfo] + at);
    lanes.done |= lanes.ready & ~goes_on;
    lanes.ready = goes_on;
  }

  /// Hands out the answers that there are, and sorts the log of the rays left open by ray.
  HWY_INLINE void collect(const Progress& p) {
    const Floats d;
    const Ints di;
    open_.count = 0;
    const auto sides = hn::Set(di, kSeenSides);
    for (uint32_t i = 0; i < p.ends; i += kLanes) {
      const auto present = hn::RebindMask(di, hn::FirstN(d, p.ends - i));
      const auto info = hn::Load(di, log_.end_info + i);
      const auto blocked = hn::And(present, hn::Eq(hn::And(info, sides), sides));
      const auto incomplete =
          hn::AndNot(blocked, hn::And(present, hn::TestBit(info, hn::Set(di, kIncomplete))));
      const uint32_t open = bits_of(hn::AndNot(hn::Or(incomplete, blocked), present));
      alignas(64) int32_t rays[kLanes];
      hn::Store(hn::ShiftRight<kRayShift>(info), di, rays);
      for (uint32_t lanes = bits_of(blocked); lanes != 0; lanes &= lanes - 1)
        answers_.logit[rays[__builtin_ctz(lanes)]] = -kCertainLogit;
      for (uint32_t lanes = bits_of(incomplete); HWY_UNLIKELY(lanes != 0); lanes &= lanes - 1)
        hard_.ray[hard_.count++] = uint32_t(rays[__builtin_ctz(lanes)]);
      // No more than have been read.
      hn::StoreU(gather_lanes(open, info), di, log_.end_info + open_.count);
      open_.count += uint32_t(__builtin_popcount(open));
    }
    for (uint32_t k = 0; k < open_.count; ++k) log_.rank[log_.end_info[k] >> kRayShift] = int32_t(k);

    uint32_t parts = 0;
    for (uint32_t i = 0; i < p.parts; i += kLanes) {
      const auto ray = hn::ShiftRight<kRayShift>(hn::Load(di, log_.part_info + i));
      const auto present = hn::RebindMask(di, hn::FirstN(d, p.parts - i));
      const auto rank = hn::GatherIndex(di, log_.rank, hn::IfThenElseZero(present, ray));
      const uint32_t open = bits_of(hn::And(present, hn::Gt(rank, hn::Set(di, -1))));
      const auto begin = hn::Load(d, log_.part_begin + i), end = hn::Load(d, log_.part_end + i);
      const auto heights = hn::Load(di, log_.part_heights + i);
      hn::StoreU(gather_lanes(open, rank), di, log_.part_info + parts);
      hn::StoreU(gather_lanes(open, begin), d, log_.part_begin + parts);
      hn::StoreU(gather_lanes(open, end), d, log_.part_end + parts);
      hn::StoreU(gather_lanes(open, heights), di, log_.part_heights + parts);
      parts += uint32_t(__builtin_popcount(open));
    }
    std::memset(open_.runs, 0, open_.count * sizeof(open_.runs[0]));
    for (uint32_t i = 0; i < parts; ++i) ++open_.runs[log_.part_info[i]];
    int32_t sum = 0;
    for (uint32_t k = 0; k < open_.count; ++k) {
      open_.first[k] = sum;
      sum += open_.runs[k];
      open_.runs[k] = 0;
    }
    for (uint32_t i = 0; i < parts; ++i) {
      const int32_t k = log_.part_info[i];
      const int32_t next = open_.first[k] + open_.runs[k]++;
      open_.begin[next] = log_.part_begin[i];
      open_.end[next] = log_.part_end[i];
      open_.heights[next] = log_.part_heights[i];
    }
  }

  const SegmentField& field_;
  const int32_t* voxels_;
  const int32_t* parts_;
  const SegmentBatch& batch_;
  AnswerBatch& answers_;
  Sort& leaping_;
  Sort& passing_;
  WalkLog& log_;
  OpenRays& open_;
  HardRays& hard_;
  // By octant: strides of voxels along each axis, the number of the voxel at 0, which extents of boxes count.
  alignas(64) float strides_[3][kLanes > 8 ? kLanes : 8];
  alignas(64) float base_[kLanes > 8 ? kLanes : 8];
  alignas(64) int32_t reach_[kLanes > 8 ? kLanes : 8];
  uint32_t taken_ = 0;  ///< rays of the batch so far
};

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
