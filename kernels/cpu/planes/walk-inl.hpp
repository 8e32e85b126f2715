// The DDA traversal in SIMD: one ray per lane.
//
// There are several groups of lanes. A step has phases: refill lanes whose ray is done, follow links down to
// the piece that holds the ray, pass the piece, and fetch the word of the next voxel. All groups finish a
// phase before any group starts the next, so that the loads of one hide behind the arithmetic of another.
// Skips over empty voxels and passages through cells use the same instructions, and nothing within a phase
// branches on what rays do, because neither can be predicted. Only the first skips happen before rays get a
// lane, because lines from outside begin with them.
//
// Each axis is mirrored if the direction is negative: (k - o) * inv keeps its bits when all three change
// sign, and heights keep theirs when normals do. Every ray then moves upward. A step goes to the end of the
// piece, or of the box around the voxel: to the crossing (t, axis) at which the segment leaves it. The
// crossings of the other axes then give the finest cell along each of them, counted in the reference's order
// (t, then the lower axis). An estimate from below that is at most one cell too low is corrected by one such
// comparison.
//
// Compiled once for each target, so the include guard toggles.
#if defined(NIF_SEGMENT_WALK_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_SEGMENT_WALK_INL
#undef NIF_SEGMENT_WALK_INL
#else
#define NIF_SEGMENT_WALK_INL
#endif

#include <algorithm>
#include <cstring>

#include "kernels/cpu/planes/walk_log-inl.hpp"
#include "kernels/packed/walk_grid.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

/// Groups of lanes that take turns.
constexpr uint32_t kWalkGroups = 2;
constexpr uint32_t kSlots = kWalkGroups * kLanes;
/// Refill a group once this many lanes are idle.
constexpr uint32_t kIdleToTake = kLanes > 8 ? kLanes / 8 : 1;

/// Skips over empty voxels while rays are being taken, as long as this many lanes skip.
constexpr uint32_t kFirstLeaps = 2;
constexpr uint32_t kLanesToLeap = kLanes / 2;

/// A ray in traversal, word by word, in mirrored finest cells.
enum RayMember : uint32_t {
  kOrigin = 0,
  kDirection = 3,
  kInverse = 6,
  kCell = 9,  ///< that the ray is in
  kNow = 12,  ///< the t at which it entered the cell
  kLeave,
  kInfo,  ///< RayInfo
  kWord,  ///< of its voxel
  kRayMembers
};
template <uint32_t kRoom>
struct Rays {
  alignas(64) float members[kRayMembers][kRoom];
};

/// Rays in traversal, one per lane, and rays that wait for a lane. Few rays wait, so that they stay in the
/// nearest cache.
struct RayTable {
  Rays<kSlots> slots;
  Rays<2 * kLanes + kSlack> waiting;  ///< the last is taken first
  /// By slot: where the ray enters the first open cell and leaves the last one; with a HitLog, where it
  /// passes its piece. Unused with a WalkLog.
  alignas(64) float open_begin[kSlots], open_end[kSlots];
};

/// Lanes of a group, as bits.
struct Lanes {
  uint32_t ready = 0;  ///< with a ray in traversal
  uint32_t done = 0;   ///< with a ray that is done but not yet in the log
};

/// Progress of the traversal. Kept separate, so that no store through a pointer can appear to change it.
struct Progress {
  Lanes lanes[kWalkGroups];
  uint32_t waiting = 0;          ///< rays
  uint32_t parts = 0, ends = 0;  ///< in the log
  bool full = false;             ///< the log of open parts has no room
};

/// Traverses one batch, as far at a time as the log has room: a WalkLog or a HullLog.
template <class Log>
class Walker {
 public:
  Walker(const PlanesField& field, const WalkGrid& grid, const SegmentBatch& batch, AnswerBatch& answers,
         RayTable& rays, Log& log, HardRays& hard)
      : field_(field),
        top_(reinterpret_cast<const int32_t*>(grid.top().data())),
        voxels_(reinterpret_cast<const int32_t*>(grid.voxels.data())),
        parts_(reinterpret_cast<const int32_t*>(grid.parts.data())),
        levels_(grid.parts.empty() ? 0 : field.levels),
        brick_levels_(grid.brick_levels),
        brick_size_(static_cast<float>(1u << (field.levels + grid.brick_levels))),
        cells_to_bricks_(1 / brick_size_),
        batch_(batch),
        answers_(answers),
        rays_(rays),
        log_(log),
        hard_(hard) {
    const float stride[3] = {1, float(grid.size[0]), float(grid.size[0] * grid.size[1])};
    for (uint32_t octant = 0; octant < 8; ++octant) {
      base_[octant] = 0;
      if (kWithBricks) flip_[octant] = 0;
      reach_[octant] = 0;
      for (uint32_t a = 0; a < 3; ++a) {
        const bool negative = (octant >> a) & 1;
        strides_[a][octant] = negative ? -stride[a] : stride[a];
        // Mirrored brick b is brick -b - 1; within it, the bits of a place are inverted.
        if (negative) base_[octant] -= stride[a];
        if (negative && kWithBricks) flip_[octant] |= int32_t((1u << brick_levels_) - 1) << a * brick_levels_;
        reach_[octant] |= (negative ? 0x0f : 0xf0) << (8 + 8 * a);
      }
    }
    for (uint32_t kind = 0; kind < 16; ++kind)
      facts_[kind] = kind < kPlaneKinds ? int32_t(kCellKinds[kind].above | kCellKinds[kind].below << 2 |
                                                  (kCellKinds[kind].wall ? kSeenBoth << 4 : 0u))
                                        : 0;
    std::memset(&rays_.slots, 0, sizeof(rays_.slots));
    std::fill_n(size_, kSlots, voxel_size());
    hard_.count = 0;
  }

  /// Answers rays that the traversal alone decides, and lists the others. Returns false if none are left.
  bool walk() {
    if (taken_ >= batch_.count) return false;
    Progress now;
    while (step(now)) continue;
    collect_answers(log_, now.ends, now.parts, answers_, hard_);
    return true;
  }

 private:
  bool may_take(const Progress& p) const { return taken_ < batch_.count && p.parts <= kMaxOpenParts / 2; }

  float voxel_size() const { return static_cast<float>(1u << field_.levels); }

  static HWY_INLINE hn::Vec<Ints> bits_if(hn::Mask<Floats> lanes, hn::Vec<Ints> bits) {
    return hn::IfThenElseZero(hn::RebindMask(Ints(), lanes), bits);
  }

  /// The words of the voxels, or of the bricks, that hold the given lanes' cells.
  HWY_INLINE hn::Vec<Ints> words_at(const hn::Vec<Floats> (&cell)[3], hn::Vec<Ints> info,
                                    hn::Mask<Floats> lanes) const {
    const Floats d;
    const Ints di;
    const auto octant = hn::And(info, hn::Set(di, kOctant));
    auto number = look_up<8>(d, base_, octant);  // exact: integers below 2^24
    for (uint32_t a = 0; a < 3; ++a) {
      const auto brick = hn::Floor(hn::Mul(cell[a], hn::Set(d, cells_to_bricks_)));
      number = hn::MulAdd(brick, look_up<8>(d, strides_[a], octant), number);
    }
    // Lanes that are done may have left the grid.
    const auto word =
        hn::GatherIndex(di, top_, hn::IfThenElseZero(hn::RebindMask(di, lanes), to_ints(number)));
    if (!kWithBricks || brick_levels_ == 0) return word;
    auto place = look_up<8>(di, flip_, octant);
    const auto in_brick = hn::Set(di, int32_t((1u << brick_levels_) - 1));
    for (uint32_t a = 0; a < 3; ++a) {
      const auto voxel = hn::ShiftRightSame(to_ints(cell[a]), int(field_.levels));
      place = hn::Xor(place, hn::ShiftLeftSame(hn::And(voxel, in_brick), int(a * brick_levels_)));
    }
    const auto mixed = is_kind(word, kLink);
    const auto first = hn::BitCast(di, hn::ShiftRight<4>(hn::BitCast(Words(), word)));
    const auto of_voxel = hn::GatherIndex(di, voxels_, hn::IfThenElseZero(mixed, hn::Add(first, place)));
    return hn::IfThenElse(mixed, of_voxel, word);
  }

  static HWY_INLINE hn::Vec<Floats> inverse_of(hn::Vec<Floats> power_of_two) {
    return floats(hn::Sub(hn::Set(Ints(), 0x7f000000), ints(power_of_two)));
  }
  /// Sizes of the pieces that words stand for: `size`, except for bricks.
  HWY_INLINE hn::Vec<Floats> sizes_of(hn::Vec<Ints> word, hn::Vec<Floats> size) const {
    if (!kWithBricks || brick_levels_ == 0) return size;
    const Ints di;
    const auto brick = hn::Eq(hn::And(word, hn::Set(di, int32_t(kBrickMask))),
                              hn::Set(di, int32_t(kBrickBit | kEmptyVoxel)));
    return hn::IfThenElse(hn::RebindMask(Floats(), brick), hn::Set(Floats(), brick_size_), size);
  }

  static HWY_INLINE hn::Mask<Ints> is_kind(hn::Vec<Ints> word, WordKind kind) {
    const Ints di;
    return hn::Eq(hn::And(word, hn::Set(di, 15)), hn::Set(di, int32_t(kind)));
  }

  /// Rays of a group, as steps need them.
  struct Group {
    hn::Vec<Floats> origin[3], direction[3], inverse[3], cell[3], now;
    hn::Vec<Ints> info, word;

    Group() = default;
    HWY_INLINE Group(const RayTable& rays, uint32_t at) {
      const Floats d;
      for (uint32_t a = 0; a < 3; ++a) {
        origin[a] = hn::Load(d, rays.slots.members[kOrigin + a] + at);
        direction[a] = hn::Load(d, rays.slots.members[kDirection + a] + at);
        inverse[a] = hn::Load(d, rays.slots.members[kInverse + a] + at);
        cell[a] = hn::Load(d, rays.slots.members[kCell + a] + at);
      }
      now = hn::Load(d, rays.slots.members[kNow] + at);
      info = ints(hn::Load(d, rays.slots.members[kInfo] + at));
      word = ints(hn::Load(d, rays.slots.members[kWord] + at));
    }
  };

  /// How far boxes reach along the three axes, in bytes 1 to 3 of each word.
  HWY_INLINE hn::Vec<Ints> reach_of(const Group& rays) const {
    const Ints di;
    const Words dw;
    const auto octant = hn::And(rays.info, hn::Set(di, kOctant));
    const auto reach = hn::BitCast(dw, hn::And(rays.word, look_up<8>(di, reach_, octant)));
    return hn::BitCast(di, hn::Or(reach, hn::ShiftRight<4>(reach)));
  }
  /// The far planes of pieces along an axis, moved to the ends of their boxes.
  template <uint32_t kAxis>
  HWY_INLINE hn::Vec<Floats> extended(hn::Vec<Ints> reach, hn::Vec<Floats> plane) const {
    const Floats d;
    const auto voxels = hn::And(reach, hn::Set(Ints(), 15 << (8 + 8 * kAxis)));
    const float cells = static_cast<float>(1u << field_.levels) / static_cast<float>(1u << (8 + 8 * kAxis));
    return hn::MulAdd(hn::ConvertTo(d, voxels), hn::Set(d, cells), plane);  // exact
  }

  /// The pieces that rays are in, and where they leave them: along each axis, and the nearest exit.
  struct Exits {
    // An implicit one would be compiled for a generic processor, and NEON's vectors cannot be inlined into
    // that.
    HWY_INLINE Exits() {}
    hn::Vec<Floats> low[3], t[3], nearest;
  };
  /// For pieces of the given size; boxes reach beyond voxels and bricks.
  HWY_INLINE Exits exits_of(const Group& rays, hn::Vec<Floats> size, hn::Vec<Floats> inverse_size,
                            hn::Vec<Ints> reach) const {
    Exits exits;
    for (uint32_t a = 0; a < 3; ++a) {
      exits.low[a] = hn::Mul(hn::Floor(hn::Mul(rays.cell[a], inverse_size)), size);
      const auto high = hn::Add(exits.low[a], size);
      const auto plane = a == 0   ? extended<0>(reach, high)
                         : a == 1 ? extended<1>(reach, high)
                                  : extended<2>(reach, high);
      exits.t[a] = hn::Mul(hn::Sub(plane, rays.origin[a]), rays.inverse[a]);
    }
    exits.nearest = hn::Min(hn::Min(exits.t[0], exits.t[1]), exits.t[2]);
    return exits;
  }

  /// The cell along one axis of a ray that has crossed all planes up to `t`, which is its crossing of another
  /// axis, or of a lower axis if `later`.
  static HWY_INLINE hn::Vec<Floats> cell_at(hn::Vec<Floats> t, hn::Mask<Floats> later, hn::Vec<Floats> origin,
                                            hn::Vec<Floats> direction, hn::Vec<Floats> inverse,
                                            hn::Vec<Floats> cell) {
    const Floats d;
    const auto reached = hn::MulAdd(t, direction, origin);
    const auto estimate = hn::Floor(hn::Sub(reached, hn::Set(d, kEstimateSlack)));
    const auto before = hn::Max(estimate, cell);
    const auto plane = hn::Add(before, hn::Set(d, 1.0f));
    const auto crossing = hn::Mul(hn::Sub(plane, origin), inverse);
    // In the reference's order the crossing of a lower axis at the same t comes first.
    const auto crossed = hn::AndNot(hn::And(later, hn::Eq(crossing, t)), hn::Le(crossing, t));
    return hn::IfThenElse(crossed, plane, before);
  }

  /// Adds what is known about the segment's end for rays that reach it, which are those that do not leave
  /// their piece.
  static HWY_INLINE hn::Vec<Ints> with_end(hn::Vec<Ints> info, hn::Mask<Floats> leaves_piece) {
    if constexpr (!Log::kInOrder) return info;
    const Ints di;
    const auto outside = hn::IfThenElseZero(hn::TestBit(info, hn::Set(di, kEndsOutside)),
                                            hn::Set(di, int32_t(kSeenOutside) << kSeenShift));
    return hn::Or(info, hn::IfThenZeroElse(hn::RebindMask(di, leaves_piece), outside));
  }

  /// Advances rays from their entry into the grid over empty voxels, as long as most of them pass such
  /// voxels. Returns the lanes that continue.
  HWY_INLINE uint32_t leap(Group& rays, hn::Vec<Floats> leave, hn::Mask<Floats> lanes) const {
    const Floats d;
    const Ints di;
    const auto sides = hn::Set(di, kSeenSides);
    for (uint32_t i = 0; i < kFirstLeaps; ++i) {
      const auto leaps = hn::And(lanes, hn::RebindMask(d, is_kind(rays.word, kEmptyVoxel)));
      if (uint32_t(__builtin_popcount(bits_of(leaps))) < kLanesToLeap) break;
      const auto size = sizes_of(rays.word, hn::Set(d, voxel_size()));
      const auto inverse_size = kWithBricks ? inverse_of(size) : hn::Set(d, field_.voxels_per_cell);
      const Exits exits = exits_of(rays, size, inverse_size, reach_of(rays));
      const auto seen = hn::And(hn::ShiftRight<4 - kSeenShift>(rays.word), sides);
      rays.info = hn::Or(rays.info, bits_if(leaps, seen));
      const auto leaves_piece = hn::Lt(exits.nearest, leave);
      // A ray that has been on both sides continues, and ends where it is.
      const auto blocked =
          hn::RebindMask(d, hn::Eq(hn::And(with_end(rays.info, leaves_piece), sides), sides));
      lanes = hn::AndNot(hn::AndNot(hn::Or(leaves_piece, blocked), leaps), lanes);
      const auto moves = hn::AndNot(blocked, hn::And(leaves_piece, leaps));
      auto later = hn::FirstN(d, 0);
      for (uint32_t a = 0; a < 3; ++a) {
        const auto cell =
            cell_at(exits.nearest, later, rays.origin[a], rays.direction[a], rays.inverse[a], rays.cell[a]);
        rays.cell[a] = hn::IfThenElse(moves, cell, rays.cell[a]);
        later = hn::Or(later, hn::Eq(exits.t[a], exits.nearest));
      }
      rays.now = hn::IfThenElse(moves, hn::Max(exits.nearest, rays.now), rays.now);
      rays.word = hn::IfThenElse(hn::RebindMask(di, moves), words_at(rays.cell, rays.info, lanes), rays.word);
    }
    return bits_of(lanes);
  }

  /// Transforms to grid space and clips; answers rays that miss the grid.
  HWY_INLINE void take(uint32_t i, Progress& p) {
    const Floats d;
    const Ints di;
    const auto zero = hn::Zero(d), one = hn::Set(d, 1.0f);
    const auto tmin = hn::Load(d, batch_.tmin + i), tmax = hn::Load(d, batch_.tmax + i);
    const auto present = hn::FirstN(d, batch_.count - i);
    const auto scale = hn::Set(d, field_.cells_per_unit);
    Group rays;
    auto &origin = rays.origin, &direction = rays.direction, &inverse = rays.inverse, &cell = rays.cell;

    // Everything that is not finite, or far away, fails one of these.
    auto easy = hn::And(present, hn::Le(tmin, tmax));
    auto steepest = zero, steepest_outside = zero;
    for (uint32_t a = 0; a < 3; ++a) {
      origin[a] = hn::Mul(hn::Sub(hn::Load(d, batch_.origin[a] + i), hn::Set(d, field_.origin[a])), scale);
      const auto outside = hn::Load(d, batch_.direction[a] + i);
      direction[a] = hn::Mul(outside, scale);
      steepest_outside = hn::Max(steepest_outside, hn::Abs(outside));
      easy = hn::And(easy, hn::Le(hn::Abs(origin[a]), hn::Set(d, kCertainReach)));
      easy = hn::And(easy, hn::Le(hn::Abs(direction[a]), hn::Set(d, kMaxDirection)));
      steepest = hn::Max(steepest, hn::Abs(direction[a]));
    }
    easy = hn::And(easy, hn::Ge(hn::Min(steepest, steepest_outside), hn::Set(d, kMinDirection)));
    // In object space, too, because other parts of an object compute there.
    easy = hn::And(easy, hn::Le(steepest_outside, hn::Set(d, kMaxDirection)));

    const auto flat_limit = hn::Mul(steepest, hn::Set(d, kFlatDirection));
    hn::Mask<Floats> negative[3], flat[3];
    for (uint32_t a = 0; a < 3; ++a) {
      flat[a] = hn::Lt(hn::Abs(direction[a]), flat_limit);
      // Crossings along an axis without movement become infinite, except if the origin lies on the grid's far
      // face: the ray must not meet a plane there.
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
    // In order, the end counts when a ray reaches it.
    const auto outside = Log::kInOrder ? clipped : hn::Or(clipped, clipped_too);
    info = hn::Or(info, hn::IfThenElseZero(outside, hn::Set(di, int32_t(kSeenOutside) << kSeenShift)));
    if constexpr (Log::kInOrder)
      info = hn::Or(info, hn::IfThenElseZero(clipped_too, hn::Set(di, kEndsOutside)));
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

    if constexpr (Log::kHasRuns) {
      hn::StoreU(enter, d, log_.enter + i);
      hn::StoreU(leave, d, log_.leave + i);
      hn::StoreU(flags, di, log_.flags + i);
      hn::StoreU(hn::Set(di, -1), di, log_.rank + i);
    }

    rays.now = enter;
    rays.info = info;
    rays.word = words_at(cell, info, meets);
    const uint32_t lanes = leap(rays, leave, meets);
    const LanesTogether together(lanes);
    // In the order of RayMember.
    const hn::Vec<Floats> members[kRayMembers] = {
        origin[0],  origin[1],  origin[2],         direction[0],     direction[1], direction[2],
        inverse[0], inverse[1], inverse[2],        cell[0],          cell[1],      cell[2],
        rays.now,   leave,      floats(rays.info), floats(rays.word)};
    for (uint32_t m = 0; m < kRayMembers; ++m)
      hn::StoreU(together(members[m]), d, rays_.waiting.members[m] + p.waiting);
    p.waiting += uint32_t(__builtin_popcount(lanes));
  }

  /// Moves waiting rays to idle lanes of a group, as many as there are. Returns the lanes.
  HWY_INLINE uint32_t move_in(uint32_t at, uint32_t idle, Progress& p) {
    const Floats d;
    while (uint32_t(__builtin_popcount(idle)) > p.waiting) idle &= idle - 1;
    p.waiting -= uint32_t(__builtin_popcount(idle));
    const LanesApart apart(idle);
    for (uint32_t m = 0; m < kRayMembers; ++m) {
      float* const slots = rays_.slots.members[m] + at;
      hn::Store(apart(hn::Load(d, slots), rays_.waiting.members[m] + p.waiting), d, slots);
    }
    return idle;
  }

  /// Logs that the chosen rays are done.
  HWY_INLINE void log_ends(uint32_t at, uint32_t lanes, Progress& p) {
    const Floats d;
    const Ints di;
    auto info = ints(hn::Load(d, rays_.slots.members[kInfo] + at));
    // A ray that ends while the log is full may lack parts.
    if (Log::kHasRuns && HWY_UNLIKELY(p.full)) info = hn::Or(info, hn::Set(di, kIncomplete));
    // Rays that are visible without the network have been answered.
    const auto sides = hn::Set(di, kSeenSides);
    const auto blocked = hn::Eq(hn::And(info, sides), sides);
    lanes &= bits_of(hn::Or(blocked, hn::TestBit(info, hn::Set(di, kHasRun))));
    const LanesTogether together(lanes);
    hn::StoreU(together(info), di, log_.end_info + p.ends);
    if constexpr (!Log::kHasRuns || Log::kInOrder) {
      hn::StoreU(together(hn::Load(d, rays_.open_begin + at)), d, log_.begin + p.ends);
      hn::StoreU(together(hn::Load(d, rays_.open_end + at)), d, log_.end + p.ends);
    }
    p.ends += uint32_t(__builtin_popcount(lanes));
  }

  /// Refills the idle lanes of a group.
  HWY_INLINE void exchange(uint32_t group, Progress& p) {
    Lanes& lanes = p.lanes[group];
    if (uint32_t(__builtin_popcount(lanes.ready)) > kLanes - kIdleToTake) return;
    const uint32_t at = group * kLanes;
    log_ends(at, lanes.done, p);
    lanes.done = 0;
    while (p.waiting < kLanes && may_take(p)) {
      take(taken_, p);
      taken_ += kLanes;
    }
    lanes.ready |= move_in(at, ~lanes.ready & kAllLanes, p);
  }

  /// Advances every group by a step. Returns false if no ray is left.
  HWY_INLINE bool step(Progress& p) {
    for (uint32_t group = 0; group < kWalkGroups; ++group) exchange(group, p);
    for (uint32_t level = levels_; level-- > 0;)
      for (uint32_t group = 0; group < kWalkGroups; ++group) follow_links(group, level, p);
    uint32_t any = 0;
    for (uint32_t group = 0; group < kWalkGroups; ++group) {
      any |= p.lanes[group].ready;
      pass(group, p);
    }
    for (uint32_t group = 0; group < kWalkGroups; ++group) move_on(group, p);
    return any != 0;
  }

  /// Moves a group's rays to the cells beyond their nearest exits, and fetches the words of the voxels there.
  HWY_INLINE void move_on(uint32_t group, const Progress& p) {
    const Floats d;
    const uint32_t at = group * kLanes;
    const auto member = [&](uint32_t m) HWY_ATTR { return hn::Load(d, rays_.slots.members[m] + at); };
    const auto t = hn::Load(d, reached_ + at);
    hn::Vec<Floats> cell[3];
    auto later = hn::FirstN(d, 0);
    for (uint32_t a = 0; a < 3; ++a) {
      cell[a] = cell_at(t, later, member(kOrigin + a), member(kDirection + a), member(kInverse + a),
                        member(kCell + a));
      hn::Store(cell[a], d, rays_.slots.members[kCell + a] + at);
      if (a < 2) later = hn::Or(later, hn::Eq(hn::Load(d, exit_[a] + at), t));
    }
    const auto word = words_at(cell, ints(member(kInfo)), mask_of(p.lanes[group].ready));
    hn::Store(floats(word), d, rays_.slots.members[kWord] + at);
  }

  /// Descends from a group's cells that are cut in parts of 2^level finest cells to the part that holds the
  /// ray.
  HWY_INLINE void follow_links(uint32_t group, uint32_t level, const Progress& p) {
    const Floats d;
    const Ints di;
    const Words dw;
    const uint32_t at = group * kLanes;
    const auto from = ints(hn::Load(d, rays_.slots.members[kWord] + at));
    const auto octant = hn::And(ints(hn::Load(d, rays_.slots.members[kInfo] + at)), hn::Set(di, kOctant));
    const auto link = hn::And(is_kind(from, kLink), hn::RebindMask(di, mask_of(p.lanes[group].ready)));
    const auto one = hn::Set(di, 1);
    // Mirrored cell c is cell -c - 1, whose bits are inverted.
    const auto half = hn::Set(di, 1 << level);
    auto part = octant;
    for (uint32_t a = 0; a < 3; ++a) {
      const auto cell = to_ints(hn::Load(d, rays_.slots.members[kCell + a] + at));
      part = hn::Xor(part, hn::IfThenElseZero(hn::TestBit(cell, half), hn::Set(di, 1 << a)));
    }
    const auto mask = hn::ShiftRight<4>(from);
    const auto bit = shifted(1, part);
    const auto there = hn::And(hn::TestBit(mask, bit), link);
    const auto before = count_bits(hn::And(mask, hn::Sub(bit, one)));
    const auto first = hn::BitCast(di, hn::ShiftRight<12>(hn::BitCast(dw, from)));
    const auto index = hn::IfThenElseZero(there, hn::Add(first, before));
    const auto word =
        hn::IfThenElse(there, hn::GatherIndex(di, parts_, index), hn::Set(di, int32_t(kEmptyPart)));
    hn::Store(floats(hn::IfThenElse(link, word, from)), d, rays_.slots.members[kWord] + at);
    hn::Store(hn::IfThenElse(hn::RebindMask(d, link), hn::Set(d, static_cast<float>(1u << level)),
                             hn::Load(d, size_ + at)),
              d, size_ + at);
  }

  /// Passes one piece with every ray of a group: a cell, or a skip over empty voxels. Then fetches the words
  /// of the next voxels.
  HWY_INLINE void pass(uint32_t group, Progress& p) {
    const Floats d;
    const Ints di;
    const uint32_t at = group * kLanes;
    Lanes& lanes = p.lanes[group];
    const Group rays(rays_, at);
    const auto ready = mask_of(lanes.ready);
    const auto size = sizes_of(rays.word, hn::Load(d, size_ + at));
    hn::Store(hn::Set(d, voxel_size()), d, size_ + at);
    const auto empty = is_kind(rays.word, kEmptyVoxel);

    // Exits; a missing part has no box beyond itself.
    const auto reach = hn::IfThenElseZero(empty, reach_of(rays));
    const Exits exits = exits_of(rays, size, inverse_of(size), reach);
    const auto leave = hn::Load(d, rays_.slots.members[kLeave] + at);
    const auto leaves_piece = hn::Lt(exits.nearest, leave);
    const auto left = hn::Max(hn::IfThenElse(leaves_piece, exits.nearest, leave), rays.now);
    // Heights, as in pass_cell(), with mirrored normals.
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
      const auto from = hn::Sub(rays.origin[a], hn::Add(exits.low[a], half_size));
      enters[a] = hn::Mul(normal, hn::Add(from, hn::Mul(rays.now, rays.direction[a])));
      leaves[a] = hn::Mul(normal, hn::Add(from, hn::Mul(left, rays.direction[a])));
    }
    const auto enter_height = hn::Add(hn::Add(enters[0], enters[1]), enters[2]);
    const auto leave_height = hn::Add(hn::Add(leaves[0], leaves[1]), leaves[2]);
    const Planes planes(rays.word, size);
    const auto enters_above = hn::Gt(enter_height, planes.upper),
               enters_below = hn::Lt(enter_height, planes.lower),
               leaves_above = hn::Gt(leave_height, planes.upper),
               leaves_below = hn::Lt(leave_height, planes.lower);
    const auto misses = hn::Or(hn::And(enters_above, leaves_above), hn::And(enters_below, leaves_below));
    const auto crosses = hn::Or(hn::And(enters_above, leaves_below), hn::And(enters_below, leaves_above));
    const auto empty_lanes = hn::RebindMask(d, empty);
    const auto cells = hn::AndNot(empty_lanes, ready);
    const auto open = hn::AndNot(misses, cells);
    if constexpr (Log::kHasRuns)
      log_open(rays, left, enter_height, leave_height, size, bits_of(open), p);
    else if constexpr (!Log::kInOrder)
      keep(rays.now, left, hn::And(open, without_run(rays.info)), open, at);

    const auto facts = look_up<16>(di, facts_, hn::And(rays.word, hn::Set(di, 15)));
    const auto sides = hn::Set(di, kSeenSides);
    const auto beside = hn::Or(hn::Or(bits_if(hn::Or(enters_above, leaves_above), facts),
                                      bits_if(hn::Or(enters_below, leaves_below), hn::ShiftRight<2>(facts))),
                               bits_if(crosses, hn::ShiftRight<4>(facts)));
    const auto seen = hn::IfThenElse(empty, hn::ShiftRight<4>(rays.word), beside);
    const auto before_end = hn::Or(hn::Or(rays.info, hn::And(hn::ShiftLeft<kSeenShift>(seen), sides)),
                                   bits_if(open, hn::Set(di, int32_t(kHasRun))));
    const auto info = with_end(before_end, leaves_piece);
    const auto blocked = hn::RebindMask(d, hn::Eq(hn::And(info, sides), sides));
    if constexpr (Log::kInOrder) {
      // Like WalkResult::last_enter and last_leave.
      const auto within = hn::RebindMask(d, hn::Eq(hn::And(before_end, sides), sides));
      const auto last_enter = hn::IfThenElse(within, rays.now, left);
      const auto last_leave = hn::IfThenElse(hn::And(within, empty_lanes), rays.now, left);
      const auto counts = hn::Or(open, hn::And(blocked, ready));
      if constexpr (Log::kHasRuns)
        keep(last_enter, last_leave, ready, ready, at);
      else
        keep(hn::IfThenElse(open, rays.now, last_enter), hn::IfThenElse(open, left, last_leave),
             hn::And(counts, without_run(rays.info)), counts, at);
    }
    const uint32_t goes_on = bits_of(hn::AndNot(blocked, leaves_piece)) & lanes.ready;

    for (uint32_t a = 0; a < 3; ++a) hn::Store(exits.t[a], d, exit_[a] + at);
    hn::Store(hn::IfThenElse(ready, exits.nearest, hn::Set(d, -kNever)), d, reached_ + at);
    hn::Store(hn::IfThenElse(ready, left, rays.now), d, rays_.slots.members[kNow] + at);
    hn::Store(floats(hn::IfThenElse(hn::RebindMask(di, ready), info, rays.info)), d,
              rays_.slots.members[kInfo] + at);
    lanes.done |= lanes.ready & ~goes_on;
    lanes.ready = goes_on;
  }

  /// Rays without an open piece so far.
  static HWY_INLINE hn::Mask<Floats> without_run(hn::Vec<Ints> info) {
    const Ints di;
    return hn::RebindMask(Floats(), hn::Eq(hn::And(info, hn::Set(di, int32_t(kHasRun))), hn::Zero(di)));
  }

  /// Records where the relevant part of a ray begins and ends, each for the chosen rays.
  HWY_INLINE void keep(hn::Vec<Floats> begin, hn::Vec<Floats> end, hn::Mask<Floats> begins,
                       hn::Mask<Floats> ends, uint32_t at) {
    const Floats d;
    float *const open_begin = rays_.open_begin + at, *const open_end = rays_.open_end + at;
    hn::Store(hn::IfThenElse(begins, begin, hn::Load(d, open_begin)), d, open_begin);
    hn::Store(hn::IfThenElse(ends, end, hn::Load(d, open_end)), d, open_end);
  }

  /// Logs that the chosen rays pass open cells. The part between the planes is computed only for rays that
  /// the traversal leaves open.
  HWY_INLINE void log_open(const Group& rays, hn::Vec<Floats> left, hn::Vec<Floats> enter_height,
                           hn::Vec<Floats> leave_height, hn::Vec<Floats> size, uint32_t lanes, Progress& p) {
    const Floats d;
    const Ints di;
    const LanesTogether together(lanes);
    hn::StoreU(together(rays.info), di, log_.part_info + p.parts);
    hn::StoreU(together(rays.now), d, log_.part_begin + p.parts);
    hn::StoreU(together(left), d, log_.part_end + p.parts);
    hn::StoreU(together(enter_height), d, log_.enter_height + p.parts);
    hn::StoreU(together(leave_height), d, log_.leave_height + p.parts);
    hn::StoreU(together(rays.word), di, log_.part_word + p.parts);
    hn::StoreU(together(size), d, log_.part_size + p.parts);
    p.parts += uint32_t(__builtin_popcount(lanes));
    if (HWY_UNLIKELY(p.parts > kMaxOpenParts)) {
      p.parts = kMaxOpenParts;
      p.full = true;
    }
  }

  const PlanesField& field_;
  const int32_t* top_;  ///< words of bricks, or of voxels if there are none
  const int32_t* voxels_;
  const int32_t* parts_;
  uint32_t levels_;  ///< of links
  uint32_t brick_levels_;
  float brick_size_;  ///< in finest cells
  float cells_to_bricks_;
  const SegmentBatch& batch_;
  AnswerBatch& answers_;
  RayTable& rays_;
  Log& log_;
  HardRays& hard_;
  // By octant: strides of bricks along each axis, the number of the brick at 0, the bits that are inverted in
  // places within bricks, and the box extents that count.
  alignas(64) float strides_[3][kLanes > 8 ? kLanes : 8];
  alignas(64) float base_[kLanes > 8 ? kLanes : 8];
  alignas(64) int32_t flip_[kLanes > 8 ? kLanes : 8];
  alignas(64) int32_t reach_[kLanes > 8 ? kLanes : 8];
  alignas(64) int32_t facts_[16];      ///< by kind: SeenBits above, then below, then both if it is a wall
  alignas(64) float exit_[3][kSlots];  ///< t at which the ray leaves its piece along each axis
  alignas(64) float reached_[kSlots];  ///< the least of those
  alignas(64) float size_[kSlots];     ///< of the piece that holds the ray, in finest cells
  uint32_t taken_ = 0;                 ///< rays of the batch so far
};

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
