// The rays of a SIMD traversal, one per lane: what is stored of each, and the queue of those that wait for a
// lane.
//
// Each axis is mirrored if the direction is negative: (k - o) * inv keeps its bits when all three change
// sign, and heights keep theirs when normals do. Every ray then moves upward.
//
// Compiled once for each target, so the include guard toggles.
#if defined(NIF_PLANES_RAY_LANES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_PLANES_RAY_LANES_INL
#undef NIF_PLANES_RAY_LANES_INL
#else
#define NIF_PLANES_RAY_LANES_INL
#endif

#include "kernels/cpu/lanes-inl.hpp"
#include "kernels/reference/object_kernel.hpp"
#include "kernels/reference/planes/grid_traversal.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

/// Groups of lanes that take turns. Three or four gain nothing (docs/results/cpu-kernels.md).
constexpr uint32_t kRayGroups = 2;
constexpr uint32_t kSlots = kRayGroups * kLanes;

/// Vectors are always read and written whole, even if the last entries are fewer.
inline constexpr uint32_t kSlack = 16;

/// Flags of a ray of the batch.
enum RayFlags : int32_t { kFlatAxis = 1, kEntersGrid = 8, kLeavesGrid = 16 };

/// What is known about a ray in traversal, in one word.
enum RayInfo : int32_t {
  kOctant = 7,     ///< axes whose direction is negative
  kSeenShift = 3,  ///< of the SeenBits
  kSeenSides = kSeenBoth << kSeenShift,
  kHasOpenCell = 1 << 5,  ///< some cell was open
  kIncomplete = 1 << 6,   ///< its open cells are not all in the log
  kEndsOutside = 1 << 7,  ///< for in-order traversal: the ray leaves the grid
  kRayShift = 8           ///< its number in the batch
};

HWY_INLINE hn::Vec<Ints> bits_if(hn::Mask<Floats> lanes, hn::Vec<Ints> bits) {
  return hn::IfThenElseZero(hn::RebindMask(Ints(), lanes), bits);
}

/// Rays that have been in proven outside and in proven inside, or have passed a wall: they are blocked.
HWY_INLINE hn::Mask<Ints> is_blocked(hn::Vec<Ints> info) {
  const auto sides = hn::Set(Ints(), kSeenSides);
  return hn::Eq(hn::And(info, sides), sides);
}

/// Adds what is known about the segment's end for rays that reach it, which are those that do not leave
/// their cube.
template <bool kInOrder>
HWY_INLINE hn::Vec<Ints> with_end(hn::Vec<Ints> info, hn::Mask<Floats> leaves_cube) {
  if constexpr (!kInOrder) return info;
  const Ints di;
  const auto outside = hn::IfThenElseZero(hn::TestBit(info, hn::Set(di, kEndsOutside)),
                                          hn::Set(di, int32_t(kSeenOutside) << kSeenShift));
  return hn::Or(info, hn::IfThenZeroElse(hn::RebindMask(di, leaves_cube), outside));
}

/// A ray in traversal, word by word, in mirrored finest cells.
enum RayMember : uint32_t {
  kOrigin = 0,
  kDirection = 3,
  kInverse = 6,
  kCell = 9,  ///< that the ray is in
  kNow = 12,  ///< the t at which it entered the cell
  kLeave,     ///< the t at which it ends
  kInfo,      ///< RayInfo
  kWord,      ///< of its voxel
  kRayMembers
};
template <uint32_t kRoom>
struct Rays {
  alignas(64) float members[kRayMembers][kRoom];
};

/// A vector of rays.
struct LaneRays {
  hn::Vec<Floats> origin[3], direction[3], inverse[3], cell[3], now, leave;
  hn::Vec<Ints> info, word;

  // An implicit constructor would be compiled for a generic processor, and NEON's vectors cannot be inlined
  // into that.
  HWY_INLINE LaneRays() {}
  HWY_INLINE LaneRays(const Rays<kSlots>& slots, uint32_t at) {
    const Floats d;
    for (uint32_t a = 0; a < 3; ++a) {
      origin[a] = hn::Load(d, slots.members[kOrigin + a] + at);
      direction[a] = hn::Load(d, slots.members[kDirection + a] + at);
      inverse[a] = hn::Load(d, slots.members[kInverse + a] + at);
      cell[a] = hn::Load(d, slots.members[kCell + a] + at);
    }
    now = hn::Load(d, slots.members[kNow] + at);
    leave = hn::Load(d, slots.members[kLeave] + at);
    info = ints(hn::Load(d, slots.members[kInfo] + at));
    word = ints(hn::Load(d, slots.members[kWord] + at));
  }
};

/// Rays that wait for a lane. Few wait, so that they stay in the nearest cache. The last is taken first.
/// Callers keep `count` in a local variable, so that no store through a pointer can appear to change it.
struct WaitingRays : Rays<2 * kLanes + kSlack> {
  /// Adds the chosen rays.
  HWY_INLINE void push(const LaneRays& rays, uint32_t lanes, uint32_t& count) {
    const LanesTogether together(lanes);
    // In the order of RayMember.
    const hn::Vec<Floats> from[kRayMembers] = {
        rays.origin[0],    rays.origin[1],    rays.origin[2],    rays.direction[0],
        rays.direction[1], rays.direction[2], rays.inverse[0],   rays.inverse[1],
        rays.inverse[2],   rays.cell[0],      rays.cell[1],      rays.cell[2],
        rays.now,          rays.leave,        floats(rays.info), floats(rays.word)};
    for (uint32_t m = 0; m < kRayMembers; ++m) hn::StoreU(together(from[m]), Floats(), members[m] + count);
    count += uint32_t(__builtin_popcount(lanes));
  }

  /// Moves rays to idle lanes of the group at `at`, as many as there are. Returns the lanes.
  HWY_INLINE uint32_t pop(Rays<kSlots>& slots, uint32_t at, uint32_t idle, uint32_t& count) const {
    const Floats d;
    while (uint32_t(__builtin_popcount(idle)) > count) idle &= idle - 1;
    count -= uint32_t(__builtin_popcount(idle));
    const LanesApart apart(idle);
    for (uint32_t m = 0; m < kRayMembers; ++m) {
      float* const to = slots.members[m] + at;
      hn::Store(apart(hn::Load(d, to), members[m] + count), d, to);
    }
    return idle;
  }
};

/// All rays of a traversal.
struct RayTable {
  Rays<kSlots> slots;  ///< in traversal, one per lane
  WaitingRays waiting;
};

/// Rays for the reference: not finite, far away, or with more intervals than there is room for.
struct HardRays {
  uint32_t count;
  uint32_t ray[kBatchRays + kSlack];
};

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
