// The DDA traversal in SIMD: one ray per lane. In the order in which data flows:
//
// - rays of a batch are set up (ray_setup-inl.hpp), skip empty space (empty_space-inl.hpp), and wait for a
//   lane (ray_lanes-inl.hpp);
// - then they go from cube to cube (dda_step-inl.hpp), which words of the grid describe
//   (lane_grid-inl.hpp), past the planes of cells (cell_planes-inl.hpp);
// - a log (traversal_log-inl.hpp) keeps what is left open.
//
// A step has phases: refill lanes whose ray is done, follow links down to the cube that holds the ray, pass
// the cube, and move on to the word of the next voxel. All groups of lanes finish a phase before any group
// starts the next, so that the loads of one hide behind the arithmetic of another. Skips over empty voxels
// and passages through cells use the same instructions, and nothing within a phase branches on what rays do,
// because neither can be predicted. Only the first skips happen before rays get a lane.
//
// Compiled once for each target, so the include guard toggles.
#if defined(NIF_PLANES_GRID_TRAVERSAL_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_PLANES_GRID_TRAVERSAL_INL
#undef NIF_PLANES_GRID_TRAVERSAL_INL
#else
#define NIF_PLANES_GRID_TRAVERSAL_INL
#endif

#include <algorithm>
#include <cstring>

#include "kernels/cpu/planes/cell_logs-inl.hpp"
#include "kernels/cpu/planes/empty_space-inl.hpp"
#include "kernels/cpu/planes/range_logs-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

/// For this few rays, which do not fill the lanes, the reference is faster than setting up a traversal.
constexpr uint32_t kFewForTraversal = 2;

/// Refill a group once this many lanes are idle. 1 to 6 of 16 make no difference
/// (docs/results/cpu-kernels.md).
constexpr uint32_t kIdleToRefill = kLanes > 8 ? kLanes / 8 : 1;

/// Traverses one batch, as far at a time as the log has room.
template <TraversalLog Log>
class GridTraversal {
 public:
  GridTraversal(const PlanesField& field, const TraversalGrid& grid, const SegmentBatch& batch,
                AnswerBatch& answers, RayTable& rays, Log& log, HardRays& hard)
      : field_(field),
        grid_(field, grid),
        batch_(batch),
        answers_(answers),
        rays_(rays),
        log_(log),
        hard_(hard) {
    std::memset(&rays_.slots, 0, sizeof(rays_.slots));
    std::fill_n(size_, kSlots, grid_.voxel_size());
    hard_.count = 0;
  }

  /// Answers rays that the traversal alone decides, and fills the log with the others. Returns false if no
  /// rays are left.
  bool fill_log() {
    if (taken_ >= batch_.count) return false;
    Progress now;
    while (step(now)) continue;
    log_.collect(now.logged, answers_, hard_);
    return true;
  }

 private:
  /// Lanes of a group, as bits.
  struct Lanes {
    uint32_t active = 0;  ///< with a ray in traversal
    uint32_t done = 0;    ///< with a ray that is done but not yet in the log
  };

  /// Progress of the traversal. Kept in a local variable, so that no store through a pointer can appear to
  /// change it.
  struct Progress {
    Lanes lanes[kRayGroups];
    uint32_t waiting = 0;  ///< rays
    LogCounts logged;
  };

  /// Advances every group by a step. Returns false if no ray is left.
  HWY_INLINE bool step(Progress& p) {
    for (uint32_t group = 0; group < kRayGroups; ++group) refill(group, p);
    for (uint32_t level = grid_.link_levels(); level-- > 0;)
      for (uint32_t group = 0; group < kRayGroups; ++group) follow_links(group, level, p);
    uint32_t any = 0;
    for (uint32_t group = 0; group < kRayGroups; ++group) {
      any |= p.lanes[group].active;
      pass(group, p);
    }
    for (uint32_t group = 0; group < kRayGroups; ++group) move_on(group, p);
    return any != 0;
  }

  /// Refills the idle lanes of a group.
  HWY_INLINE void refill(uint32_t group, Progress& p) {
    Lanes& lanes = p.lanes[group];
    if (uint32_t(__builtin_popcount(lanes.active)) > kLanes - kIdleToRefill) return;
    const uint32_t at = group * kLanes;
    finish(at, lanes.done, p);
    lanes.done = 0;
    while (p.waiting < kLanes && taken_ < batch_.count && p.logged.has_room()) {
      take(taken_, p);
      taken_ += kLanes;
    }
    lanes.active |= rays_.waiting.pop(rays_.slots, at, ~lanes.active & kAllLanes, p.waiting);
  }

  /// Logs that the chosen rays are done.
  HWY_INLINE void finish(uint32_t at, uint32_t lanes, Progress& p) {
    const Ints di;
    const auto info = ints(hn::Load(Floats(), rays_.slots.members[kInfo] + at));
    // Rays that are visible without the network have been answered.
    lanes &= bits_of(hn::Or(is_blocked(info), hn::TestBit(info, hn::Set(di, kHasOpenCell))));
    log_.finish(LanesTogether(lanes), info, at, p.logged);
    p.logged.ends += uint32_t(__builtin_popcount(lanes));
  }

  /// Takes a vector of rays from the batch: answers those that miss the grid or meet only empty voxels, and
  /// lets the others wait for a lane.
  HWY_INLINE void take(uint32_t first, Progress& p) {
    const Ints di;
    RaySetup<Log::kInOrder> setup(field_, batch_, first);
    hn::StoreU(hn::Set(di, kCertainLogit), di, answers_.logit + first);
    std::memset(answers_.certain + first, 1, std::min(kLanes, batch_.count - first));
    const uint32_t hard = bits_of(hn::AndNot(setup.easy, setup.present));
    hn::StoreU(gather_lanes(hard, hn::Iota(Words(), first)), Words(), hard_.ray + hard_.count);
    hard_.count += uint32_t(__builtin_popcount(hard));
    log_.start(setup, first);

    LaneRays& rays = setup.rays;
    rays.word = grid_.words_at(rays.cell, rays.info, setup.meets);
    rays_.waiting.push(rays, skip_empty_space<Log::kInOrder>(grid_, rays, setup.meets), p.waiting);
  }

  /// Descends from a group's cells that are cut into children of 2^level finest cells to the child that holds
  /// the ray.
  HWY_INLINE void follow_links(uint32_t group, uint32_t level, const Progress& p) {
    const Floats d;
    const uint32_t at = group * kLanes;
    const LaneRays rays(rays_.slots, at);
    const auto links =
        hn::And(is_kind(rays.word, kLink), hn::RebindMask(Ints(), mask_of(p.lanes[group].active)));
    const auto word =
        hn::IfThenElse(links, grid_.children_at(rays.word, level, rays.cell, rays.info, links), rays.word);
    hn::Store(floats(word), d, rays_.slots.members[kWord] + at);
    const auto part_size = hn::Set(d, static_cast<float>(1u << level));
    hn::Store(hn::IfThenElse(hn::RebindMask(d, links), part_size, hn::Load(d, size_ + at)), d, size_ + at);
  }

  /// Passes one cube with every ray of a group: a cell, or a skip over empty voxels.
  HWY_INLINE void pass(uint32_t group, Progress& p) {
    const Floats d;
    const Ints di;
    const uint32_t at = group * kLanes;
    Lanes& lanes = p.lanes[group];
    const LaneRays rays(rays_.slots, at);
    const auto active = mask_of(lanes.active);
    const auto size = grid_.sizes_of(rays.word, hn::Load(d, size_ + at));
    hn::Store(hn::Set(d, grid_.voxel_size()), d, size_ + at);  // of the next cube
    const auto empty = is_kind(rays.word, kEmptyVoxel);
    const auto is_empty = hn::RebindMask(d, empty);

    // A missing child has no box beyond itself.
    const auto reach = hn::IfThenElseZero(empty, grid_.reach_of(rays.word, rays.info));
    const Exits exits(rays, size, reach, grid_.voxel_size());
    const auto leaves_cube = hn::Lt(exits.nearest, rays.leave);
    const auto left = hn::Max(hn::IfThenElse(leaves_cube, exits.nearest, rays.leave), rays.now);

    const PassageHeights heights(rays, exits.low, size, left);
    const SlabSides sides(Slabs(rays.word, size), heights.enter, heights.leave);
    const auto open = hn::AndNot(sides.misses(), hn::AndNot(is_empty, active));
    const Passage passage{.rays = rays,
                          .left = left,
                          .size = size,
                          .heights = heights,
                          .active = active,
                          .empty = is_empty,
                          .open = open};
    log_.pass(passage, at, p.logged);

    const auto seen = hn::IfThenElse(empty, hn::ShiftRight<4>(rays.word), facts_.seen(rays.word, sides));
    const auto before_end =
        hn::Or(hn::Or(rays.info, hn::And(hn::ShiftLeft<kSeenShift>(seen), hn::Set(di, kSeenSides))),
               bits_if(open, hn::Set(di, int32_t(kHasOpenCell))));
    const auto info = with_end<Log::kInOrder>(before_end, leaves_cube);
    const auto blocked = hn::RebindMask(d, is_blocked(info));
    if constexpr (Log::kInOrder)
      log_.block({.passage = passage, .by_cube = hn::RebindMask(d, is_blocked(before_end)), .rays = blocked},
                 at);
    const uint32_t goes_on = bits_of(hn::AndNot(blocked, leaves_cube)) & lanes.active;

    for (uint32_t a = 0; a < 3; ++a) hn::Store(exits.t[a], d, exit_[a] + at);
    hn::Store(hn::IfThenElse(active, exits.nearest, hn::Set(d, -kNever)), d, nearest_exit_ + at);
    hn::Store(hn::IfThenElse(active, left, rays.now), d, rays_.slots.members[kNow] + at);
    hn::Store(floats(hn::IfThenElse(hn::RebindMask(di, active), info, rays.info)), d,
              rays_.slots.members[kInfo] + at);
    lanes.done |= lanes.active & ~goes_on;
    lanes.active = goes_on;
  }

  /// Moves a group's rays to the cells beyond their nearest exits, and fetches the words of the voxels there.
  HWY_INLINE void move_on(uint32_t group, const Progress& p) {
    const Floats d;
    const uint32_t at = group * kLanes;
    const LaneRays rays(rays_.slots, at);
    const hn::Vec<Floats> exits[3] = {hn::Load(d, exit_[0] + at), hn::Load(d, exit_[1] + at),
                                      hn::Load(d, exit_[2] + at)};
    const NextCells next(rays, exits, hn::Load(d, nearest_exit_ + at));
    for (uint32_t a = 0; a < 3; ++a) hn::Store(next.cell[a], d, rays_.slots.members[kCell + a] + at);
    const auto word = grid_.words_at(next.cell, rays.info, mask_of(p.lanes[group].active));
    hn::Store(floats(word), d, rays_.slots.members[kWord] + at);
  }

  const PlanesField& field_;
  const LaneGrid grid_;
  const KindFacts facts_;
  const SegmentBatch& batch_;
  AnswerBatch& answers_;
  RayTable& rays_;
  Log& log_;
  HardRays& hard_;
  // What a phase leaves to the next ones, by slot.
  alignas(64) float size_[kSlots];          ///< of the cube that holds the ray, in finest cells
  alignas(64) float exit_[3][kSlots];       ///< t at which the ray leaves its cube along each axis
  alignas(64) float nearest_exit_[kSlots];  ///< the least of those
  uint32_t taken_ = 0;                      ///< rays of the batch so far
};

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
