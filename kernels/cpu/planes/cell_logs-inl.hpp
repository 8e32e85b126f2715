// Logs of the open cells of each ray: for the network's sample points, and for first hits in cells.
//
// Open cells are appended to one list in the order of steps, without a branch, and sorted by ray at the end.
// The divisions that an interval takes wait until then: only rays that are left open need them.
//
// Compiled once for each target, so the include guard toggles.
#if defined(NIF_PLANES_CELL_LOGS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_PLANES_CELL_LOGS_INL
#undef NIF_PLANES_CELL_LOGS_INL
#else
#define NIF_PLANES_CELL_LOGS_INL
#endif

#include <cstring>

#include "kernels/cpu/planes/range_logs-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

/// Open cells that rays have passed, in the order of steps.
struct OpenCellList {
  alignas(64) int32_t info[kMaxOpenCells + kSlack];  ///< RayInfo of the ray
  float enter[kMaxOpenCells + kSlack], leave[kMaxOpenCells + kSlack];
  float enter_height[kMaxOpenCells + kSlack], leave_height[kMaxOpenCells + kSlack];
  int32_t word[kMaxOpenCells + kSlack];
  float size[kMaxOpenCells + kSlack];

  HWY_INLINE void add(const Passage& passage, LogCounts& counts) {
    const Floats d;
    const Ints di;
    const uint32_t lanes = bits_of(passage.open);
    const LanesTogether together(lanes);
    hn::StoreU(together(passage.rays.info), di, info + counts.cells);
    hn::StoreU(together(passage.rays.now), d, enter + counts.cells);
    hn::StoreU(together(passage.left), d, leave + counts.cells);
    hn::StoreU(together(passage.heights.enter), d, enter_height + counts.cells);
    hn::StoreU(together(passage.heights.leave), d, leave_height + counts.cells);
    hn::StoreU(together(passage.rays.word), di, word + counts.cells);
    hn::StoreU(together(passage.size), d, size + counts.cells);
    counts.cells += uint32_t(__builtin_popcount(lanes));
    if (HWY_UNLIKELY(counts.cells > kMaxOpenCells)) {
      counts.cells = kMaxOpenCells;
      counts.full = true;
    }
  }

  HWY_INLINE SlabIntervals intervals(uint32_t i) const {
    const Floats d;
    return {Slabs(hn::Load(Ints(), word + i), hn::Load(d, size + i)), hn::Load(d, enter + i),
            hn::Load(d, leave + i), hn::Load(d, enter_height + i), hn::Load(d, leave_height + i)};
  }
};

/// A ray that ends while the list of open cells is full may lack some.
HWY_INLINE hn::Vec<Ints> with_room(hn::Vec<Ints> info, const LogCounts& counts) {
  return HWY_UNLIKELY(counts.full) ? hn::Or(info, hn::Set(Ints(), kIncomplete)) : info;
}

/// Entries sorted by ray: those of ray k are first[k], first[k] + 1 and so on, `cells[k]` of them.
struct CellsByRay {
  alignas(64) int32_t cells[kBatchRays + kSlack];
  int32_t first[kBatchRays + kSlack];

  /// Sorts entries for `rays` rays. `ray_of(i)`: the ray of entry i, or -1 to leave it out.
  /// `place(i, at)`: puts entry i at its place.
  template <class RayOf, class Place>
  HWY_INLINE void sort(uint32_t rays, uint32_t entries, const RayOf& ray_of, const Place& place) {
    std::memset(cells, 0, rays * sizeof(cells[0]));
    for (uint32_t i = 0; i < entries; ++i)
      if (const int32_t k = ray_of(i); k >= 0) ++cells[k];
    int32_t sum = 0;
    for (uint32_t k = 0; k < rays; ++k) {
      first[k] = sum;
      sum += cells[k];
      cells[k] = 0;
    }
    for (uint32_t i = 0; i < entries; ++i)
      if (const int32_t k = ray_of(i); k >= 0) place(i, first[k] + cells[k]++);
  }
};

/// The intervals in the open cells of each ray that is kept.
struct OpenIntervals : CellsByRay {
  float begin[kMaxOpenCells], end[kMaxOpenCells];
  int32_t heights[kMaxOpenCells];
};

/// Keeps the rays that are left open.
struct IntervalLog : EndedRays {
  static constexpr bool kInOrder = false;

  OpenCellList cells;
  float enter[kBatchRays + kSlack];    ///< [ray]
  float leave[kBatchRays + kSlack];    ///< [ray]
  int32_t flags[kBatchRays + kSlack];  ///< [ray] RayFlags
  int32_t rank[kBatchRays + kSlack];   ///< [ray] among the rays that are kept, or -1
  OpenIntervals open;                  ///< after collect()

  HWY_INLINE void start(const RaySetup<kInOrder>& setup, uint32_t first) {
    const Floats d;
    const Ints di;
    hn::StoreU(setup.rays.now, d, enter + first);
    hn::StoreU(setup.rays.leave, d, leave + first);
    hn::StoreU(setup.flags, di, flags + first);
    hn::StoreU(hn::Set(di, -1), di, rank + first);
  }
  HWY_INLINE void pass(const Passage& passage, uint32_t, LogCounts& counts) { cells.add(passage, counts); }
  HWY_INLINE void finish(const LanesTogether& together, hn::Vec<Ints> info, uint32_t,
                         const LogCounts& counts) {
    hn::StoreU(together(with_room(info, counts)), Ints(), end_info + counts.ends);
  }

  HWY_INLINE void collect(const LogCounts& counts, AnswerBatch& answers, HardRays& hard) {
    keep_open_rays(counts.ends, answers, hard);
    const uint32_t kept = keep_their_intervals(counts.cells);
    open.sort(
        count, kept, [&](uint32_t i) { return cells.info[i]; },
        [&](uint32_t i, int32_t at) {
          open.begin[at] = cells.enter[i];
          open.end[at] = cells.leave[i];
          open.heights[at] = cells.word[i];
        });
  }

 private:
  HWY_INLINE void keep_open_rays(uint32_t ends, AnswerBatch& answers, HardRays& hard) {
    const Ints di;
    uint32_t kept = 0;
    for (uint32_t i = 0; i < ends; i += kLanes) {
      const auto present = hn::RebindMask(di, hn::FirstN(Floats(), ends - i));
      const auto info = hn::Load(di, end_info + i);
      const auto blocked = hn::And(present, is_blocked(info));
      const auto incomplete =
          hn::AndNot(blocked, hn::And(present, hn::TestBit(info, hn::Set(di, kIncomplete))));
      for_rays(info, blocked, [&](uint32_t ray) { answers.logit[ray] = -kCertainLogit; });
      for_rays(info, incomplete, [&](uint32_t ray) { hard.ray[hard.count++] = ray; });
      const uint32_t lanes = bits_of(hn::AndNot(hn::Or(incomplete, blocked), present));
      // Not beyond what has been read.
      hn::StoreU(gather_lanes(lanes, info), di, end_info + kept);
      kept += uint32_t(__builtin_popcount(lanes));
    }
    count = kept;
    for (uint32_t k = 0; k < count; ++k) rank[ray(k)] = int32_t(k);
  }

  /// Puts ranks, ends and heights of the intervals of kept rays in place of the cells. Returns their number.
  HWY_INLINE uint32_t keep_their_intervals(uint32_t entries) {
    const Floats d;
    const Ints di;
    uint32_t kept = 0;
    for (uint32_t i = 0; i < entries; i += kLanes) {
      const auto number = hn::ShiftRight<kRayShift>(hn::Load(di, cells.info + i));
      const auto present = hn::RebindMask(di, hn::FirstN(d, entries - i));
      const auto ranks = gather(di, rank, hn::IfThenElseZero(present, number));
      const uint32_t lanes = bits_of(hn::And(present, hn::Gt(ranks, hn::Set(di, -1))));
      if (lanes == 0) continue;
      const SlabIntervals intervals = cells.intervals(i);
      // Not beyond what has been read.
      hn::StoreU(gather_lanes(lanes, ranks), di, cells.info + kept);
      hn::StoreU(gather_lanes(lanes, intervals.begin), d, cells.enter + kept);
      hn::StoreU(gather_lanes(lanes, intervals.end), d, cells.leave + kept);
      hn::StoreU(gather_lanes(lanes, intervals.heights), di, cells.word + kept);
      kept += uint32_t(__builtin_popcount(lanes));
    }
    return kept;
  }
};

/// Keeps the rays that are blocked or left open. The range of a ray is that of the cube in which it became
/// known that the ray is blocked.
struct FirstHitCellLog : RangeLog {
  static constexpr bool kInOrder = true;

  OpenCellList cells;
  int32_t rank[kBatchRays + kSlack];  ///< [ray] among the rays that are kept, or -1
  CellsByRay by_ray;                  ///< after collect()
  int32_t cell[kMaxOpenCells];        ///< by ray and in order: an index in `cells`

  HWY_INLINE void start(const RaySetup<kInOrder>&, uint32_t first) {
    hn::StoreU(hn::Set(Ints(), -1), Ints(), rank + first);
  }
  HWY_INLINE void pass(const Passage& passage, uint32_t, LogCounts& counts) { cells.add(passage, counts); }
  HWY_INLINE void block(const Blocked& blocked, uint32_t at) {
    const auto& active = blocked.passage.active;
    keep(blocked.last_enter(), blocked.last_leave(), active, active, at);
  }
  HWY_INLINE void finish(const LanesTogether& together, hn::Vec<Ints> info, uint32_t at,
                         const LogCounts& counts) {
    RangeLog::finish(together, with_room(info, counts), at, counts);
  }

  HWY_INLINE void collect(const LogCounts& counts, AnswerBatch&, HardRays& hard) {
    count = 0;
    for (uint32_t i = 0; i < counts.ends; ++i) {
      const int32_t info = end_info[i];
      if (info & kIncomplete) {
        hard.ray[hard.count++] = ray(i);
        continue;
      }
      const uint32_t k = count++;
      end_info[k] = info;
      begin[k] = begin[i];
      end[k] = end[i];
      rank[info >> kRayShift] = int32_t(k);
    }
    by_ray.sort(
        count, counts.cells, [&](uint32_t i) { return rank[cells.info[i] >> kRayShift]; },
        [&](uint32_t i, int32_t at) { cell[at] = int32_t(i); });
  }
};

static_assert(TraversalLog<IntervalLog> && TraversalLog<FirstHitCellLog>);

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
