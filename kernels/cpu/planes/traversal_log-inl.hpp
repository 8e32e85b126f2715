// What a traversal keeps of its rays. The log's type decides that, and how far rays are followed:
//
// - IntervalLog (cell_logs-inl.hpp): the intervals in the open cells of each ray that is left open;
// - OpenRangeLog (range_logs-inl.hpp): of each such ray, the range of t that holds all open cells;
// - FirstHitRangeLog (range_logs-inl.hpp): of each ray that may meet something, the range that holds its
//   first hit;
// - FirstHitCellLog (cell_logs-inl.hpp): of each such ray, the open cells that may hold its first hit.
//
// Compiled once for each target, so the include guard toggles.
#if defined(NIF_PLANES_TRAVERSAL_LOG_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_PLANES_TRAVERSAL_LOG_INL
#undef NIF_PLANES_TRAVERSAL_LOG_INL
#else
#define NIF_PLANES_TRAVERSAL_LOG_INL
#endif

#include <concepts>

#include "kernels/cpu/planes/cell_planes-inl.hpp"
#include "kernels/cpu/planes/ray_setup-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

/// Open cells that are logged before answers are collected. If the open cells of a few rays exceed this, the
/// reference answers those rays. A smaller log is no faster (docs/results/cpu-kernels.md).
inline constexpr uint32_t kMaxOpenCells = 3 * kBatchRays;

/// The entries of a log. Callers keep them in a local variable, so that no store through a pointer can appear
/// to change them.
struct LogCounts {
  uint32_t cells = 0, ends = 0;
  bool full = false;  ///< there was no room for some open cells

  bool has_room() const { return cells <= kMaxOpenCells / 2; }
};

/// The passage of a group's rays through a cube each.
struct Passage {
  const LaneRays& rays;     ///< as they entered it
  hn::Vec<Floats> left;     ///< the t at which they leave it
  hn::Vec<Floats> size;     ///< of the cube, in finest cells
  PassageHeights heights;   ///< if the cube is a cell
  hn::Mask<Floats> active;  ///< lanes with a ray
  hn::Mask<Floats> empty;   ///< cubes that are empty voxels
  hn::Mask<Floats> open;    ///< cubes that are open cells

  /// Rays without an open cell so far.
  HWY_INLINE hn::Mask<Floats> first_open() const {
    const Ints di;
    const auto opened = hn::And(rays.info, hn::Set(di, int32_t(kHasOpenCell)));
    return hn::RebindMask(Floats(), hn::Eq(opened, hn::Zero(di)));
  }
};

/// Which rays a passage blocks.
struct Blocked {
  const Passage& passage;
  hn::Mask<Floats> by_cube;
  hn::Mask<Floats> rays;  ///< by the cube, or because the ray ends there

  // As TraversalResult::last_enter and last_leave: the range of t in which that became known.
  HWY_INLINE hn::Vec<Floats> last_enter() const {
    return hn::IfThenElse(by_cube, passage.rays.now, passage.left);
  }
  HWY_INLINE hn::Vec<Floats> last_leave() const {
    return hn::IfThenElse(hn::And(by_cube, passage.empty), passage.rays.now, passage.left);
  }
};

/// What a traversal requires of its log.
///
/// - kInOrder: follow rays until they meet something, as follow_segment<true>() does. If false, a ray ends as
///   soon as it is known that it is blocked, maybe by its end outside of the grid;
/// - start(setup, first): the rays of the batch from `first` on have been set up;
/// - pass(passage, at, counts): the group at slot `at` has passed a cube each. This comes before it is known
///   which rays that blocks: what a log stores must not wait for it;
/// - block(blocked, at), only in order: these rays of the group are blocked;
/// - finish(together, info, at, counts): rays of the group at slot `at` are done. `together` moves them to the
///   front, and the caller counts them. Rays that met no open cell and are not blocked are left out;
/// - collect(counts, answers, hard): the traversal pauses or ends. Answers the rays that the log does not
///   keep, and adds those that it has no room for to the hard rays.
template <class Log>
concept TraversalLog = requires(Log log, const RaySetup<Log::kInOrder>& setup, const Passage& passage,
                                const Blocked& blocked, const LanesTogether& together, hn::Vec<Ints> info,
                                uint32_t at, LogCounts& counts, AnswerBatch& answers, HardRays& hard) {
  { Log::kInOrder } -> std::convertible_to<bool>;
  log.start(setup, at);
  log.pass(passage, at, counts);
  requires !Log::kInOrder || requires { log.block(blocked, at); };
  log.finish(together, info, at, counts);
  log.collect(counts, answers, hard);
};

/// Calls `f` with the number of each chosen ray.
template <class F>
HWY_INLINE void for_rays(hn::Vec<Ints> info, hn::Mask<Ints> chosen, const F& f) {
  alignas(64) int32_t rays[kLanes];
  hn::Store(hn::ShiftRight<kRayShift>(info), Ints(), rays);
  for (uint32_t lanes = bits_of(chosen); lanes != 0; lanes &= lanes - 1)
    f(uint32_t(rays[__builtin_ctz(lanes)]));
}

/// Part of each log: the rays that are done, and after collect() those that it keeps.
struct EndedRays {
  uint32_t count;                                     ///< after collect()
  alignas(64) int32_t end_info[kBatchRays + kSlack];  ///< RayInfo

  uint32_t ray(uint32_t k) const { return uint32_t(end_info[k] >> kRayShift); }
  bool blocked(uint32_t k) const { return (uint32_t(end_info[k]) & kSeenSides) == uint32_t(kSeenSides); }
};

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
