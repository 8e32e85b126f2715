// DDA traversal of the occupancy grid and the cells in it: gives exact answers, or the intervals in which the
// surface may be.
//
// This header defines the answer. All of it is IEEE single precision in the order written, without
// contraction; other kernels may skip empty space but must arrive at the same crossings
// (docs/encodings/segment.md, "Traversal").
#pragma once

#include "kernels/reference/arithmetic.hpp"
#include "kernels/reference/planes/cells.hpp"
#include "kernels/reference/ray.hpp"

namespace nif::kernels {

enum class Verdict : uint8_t {
  visible,   ///< no cell on the way is open
  occluded,  ///< through a wall, or both in proven outside and in proven inside
  open,      ///< the network decides
};

enum class VoxelState : uint8_t { outside, inside, unknown, surface };

/// An interval: the part of a segment that lies between the planes of an open cell.
struct Interval {
  float begin, end;  ///< as t
  uint32_t heights;  ///< of both ends, see make_heights()
};

/// Each cell has at most one, and a traversal never turns back along an axis.
inline constexpr uint32_t kMaxIntervals = 3 * kMaxCells + 1;

/// Result of a traversal, without its intervals.
struct TraversalResult {
  Verdict verdict = Verdict::visible;
  bool certain = true;  ///< false if open, or if rounding may exceed the padding of voxels

  // For an in-order traversal whose verdict is occluded: the interval of t in which that became known. For a
  // cell, where it is entered and left. A voxel without surface counts from its entry on, and the end of the
  // segment is a single t.
  float last_enter = 0, last_leave = 0;

  // The rest is set if the verdict is open.
  bool saw_outside = false, saw_inside = false;
  bool starts_open =
      false;  ///< the first interval begins at the segment's start, not at its entry into the grid
  bool ends_open = false;                   ///< the last interval ends at the segment's own end
  float origin[3] = {}, direction[3] = {};  ///< in grid space, whose unit is a finest cell
  float open_t = 0;                         ///< total length of the intervals, in t
  uint32_t interval_count = 0;
};

struct FullTraversal : TraversalResult {
  Interval intervals[kMaxIntervals];
};

/// A component below this fraction of the largest moves less than the padding across the whole grid, so it
/// counts as 0.
inline constexpr float kFlatDirection = 0x1p-40f;

/// Later than any crossing.
inline constexpr float kNever = 3.402823466e+38f;

/// Where to find a voxel's bits.
struct VoxelAddress {
  uint32_t entry;  ///< of brick_table
  uint32_t bit;
};
NIF_HOST_DEVICE inline VoxelAddress voxel_address(const PlanesField& field, const int32_t voxel[3]) {
  const uint32_t x = uint32_t(voxel[0]), y = uint32_t(voxel[1]), z = uint32_t(voxel[2]);
  const uint32_t brick = (x >> 2) + field.bricks[0] * ((y >> 2) + field.bricks[1] * (z >> 2));
  return {field.brick_table[brick], (x & 3) + 4 * (y & 3) + 16 * (z & 3)};
}
NIF_HOST_DEVICE inline VoxelState state_in(const BrickStates& states, uint32_t bit) {
  const uint32_t surface = uint32_t(states.surface >> bit) & 1, aux = uint32_t(states.aux >> bit) & 1;
  if (surface) return aux ? VoxelState::unknown : VoxelState::surface;
  return aux ? VoxelState::inside : VoxelState::outside;
}
NIF_HOST_DEVICE inline VoxelState voxel_state(const PlanesField& field, const int32_t voxel[3]) {
  const VoxelAddress at = voxel_address(field, voxel);
  if (at.entry < kFirstMixedBrick) return static_cast<VoxelState>(at.entry);
  return state_in(field.brick_states[at.entry - kFirstMixedBrick], at.bit);
}

/// SeenBits of a voxel without surface.
NIF_HOST_DEVICE constexpr uint32_t seen_in(VoxelState state) {
  return state == VoxelState::outside  ? uint32_t(kSeenOutside)
         : state == VoxelState::inside ? uint32_t(kSeenInside)
                                       : 0u;
}

/// A voxel's record if it is a surface voxel; else make_empty().
NIF_HOST_DEVICE inline uint32_t voxel_word(const PlanesField& field, const int32_t voxel[3]) {
  const VoxelAddress at = voxel_address(field, voxel);
  if (at.entry < kFirstMixedBrick) return make_empty(seen_in(static_cast<VoxelState>(at.entry)));
  const BrickStates& states = field.brick_states[at.entry - kFirstMixedBrick];
  const VoxelState state = state_in(states, at.bit);
  if (state != VoxelState::surface) return make_empty(seen_in(state));
  const uint64_t below = states.surface & ~states.aux & ((uint64_t{1} << at.bit) - 1);
  return field.voxel_records[field.voxel_base[at.entry - kFirstMixedBrick] + count_bits(below)];
}

/// A cube of the grid that a traversal tests at once: a voxel without surface, a cell with planes, or a child
/// that no triangle touches.
struct Cube {
  int32_t low[3];  ///< its first finest cell
  int32_t size;    ///< in finest cells: a power of two
  uint32_t word;   ///< planes, make_empty(), or kEmptyChild
};
inline constexpr uint32_t kEmptyChild = make_empty(0);

/// The cube that holds a finest cell. Links are no deeper than field.levels.
template <class Field>
NIF_HOST_DEVICE Cube find_cube(const Field& field, const int32_t (&cell)[3]) {
  Cube cube;
  const int32_t voxel[3] = {cell[0] >> field.levels, cell[1] >> field.levels, cell[2] >> field.levels};
  cube.word = voxel_word(field, voxel);
  cube.size = 1 << field.levels;
  while (word_kind(cube.word) == kLink) {
    cube.size >>= 1;
    uint32_t child = 0;
    NIF_UNROLL
    for (int a = 0; a < 3; ++a) child |= (cell[a] & cube.size) != 0 ? 1u << a : 0u;
    cube.word =
        link_mask(cube.word) >> child & 1 ? field.children[link_child(cube.word, child)] : kEmptyChild;
  }
  NIF_UNROLL
  for (int a = 0; a < 3; ++a) cube.low[a] = cell[a] & ~(cube.size - 1);
  return cube;
}

/// Does nothing.
struct NoVisit {
  NIF_HOST_DEVICE void operator()(const Cube&) const {}
};

/// Transforms a segment's origin and direction to grid space and sets components of the direction that move
/// nothing to 0. Returns false if the segment is invalid: a number is not finite, or the direction is zero or
/// too small or too large to compute with.
template <class Field>
NIF_HOST_DEVICE bool to_grid_space(const Field& field, const Segment& segment, TraversalResult& traversal,
                                   float& reach) {
  bool finite = true;
  float steepest = 0;
  reach = 0;
  NIF_UNROLL
  for (int a = 0; a < 3; ++a) {
    traversal.origin[a] = (segment.origin[a] - field.origin[a]) * field.cells_per_unit;
    traversal.direction[a] = segment.direction[a] * field.cells_per_unit;
    finite = finite && is_finite(traversal.origin[a]) && is_finite(traversal.direction[a]);
    reach = max_of(magnitude(traversal.origin[a]), reach);
    steepest = max_of(magnitude(traversal.direction[a]), steepest);
  }
  NIF_UNROLL
  for (int a = 0; a < 3; ++a)
    if (magnitude(traversal.direction[a]) < steepest * kFlatDirection) traversal.direction[a] = 0;
  return finite && steepest >= kMinDirection && steepest <= kMaxDirection;
}

/// Where a segment passes the grid.
struct GridPassage {
  float inverse[3];  ///< 1 / direction; infinite along an axis without movement
  float enter, leave;
  bool enters_grid, leaves_grid;  ///< the segment is clipped at that end
  int32_t cell[3];                ///< the first one
  uint32_t seen;                  ///< SeenBits; everything beyond the grid is outside
};

/// The start of any traversal. Returns false if it meets no cell; `traversal` is then its result.
template <class Field>
NIF_HOST_DEVICE bool enter_grid(const Field& field, const Segment& segment, TraversalResult& traversal,
                                GridPassage& passage) {
  traversal.verdict = Verdict::visible;
  traversal.certain = true;
  traversal.interval_count = 0;

  // To grid space. An invalid segment (NaN, no direction, tmin > tmax) meets nothing, which is certain only
  // if it is empty by definition.
  float reach;
  const bool valid = to_grid_space(field, segment, traversal, reach);
  if (!(segment.tmin <= segment.tmax)) {
    traversal.certain = segment.tmin > segment.tmax;
    return false;
  }
  if (!valid) {
    traversal.certain = false;
    return false;
  }
  traversal.certain = reach <= kCertainReach;

  // Clips to the grid.
  float enter = segment.tmin, leave = segment.tmax;
  bool enters_grid = false, leaves_grid = false;
  NIF_UNROLL
  for (int a = 0; a < 3; ++a) {
    const float size = static_cast<float>(field.voxels[a] << field.levels);
    const float inverse = passage.inverse[a] = 1.0f / traversal.direction[a];
    if (traversal.direction[a] == 0) {
      if (!(traversal.origin[a] >= 0 && traversal.origin[a] <= size)) return false;
      continue;
    }
    const bool up = traversal.direction[a] > 0;
    const float low = (0 - traversal.origin[a]) * inverse, high = (size - traversal.origin[a]) * inverse;
    const float first = up ? low : high, last = up ? high : low;
    if (first > enter) enter = first, enters_grid = true;
    if (last < leave) leave = last, leaves_grid = true;
  }
  // If a number so large divides one so small that every crossing overflows, the segment gets nowhere.
  if (!(enter <= leave && enter <= kNever)) return false;

  NIF_UNROLL
  for (int a = 0; a < 3; ++a) {
    const float at = traversal.origin[a] + enter * traversal.direction[a];
    passage.cell[a] = to_index(at, int32_t(field.voxels[a] << field.levels) - 1);
  }
  passage.seen = enters_grid || leaves_grid ? uint32_t(kSeenOutside) : 0u;
  passage.enter = enter;
  passage.leave = leave;
  passage.enters_grid = enters_grid;
  passage.leaves_grid = leaves_grid;
  return true;
}

/// An interval, and the cell that it lies in.
struct OpenCell : Interval {
  float enter, leave;  ///< where the segment enters and leaves the cell, as t
  uint32_t word;       ///< its planes
};

/// The intervals so far, summed up during a traversal.
struct IntervalRecord {
  float open_t = 0;
  bool starts_open = false, ends_open = false;

  /// Adds the next open cell, passed from `enter` to `leave`.
  template <class AddInterval>
  NIF_HOST_DEVICE void add(const CellPassage& passed, uint32_t word, float enter, float leave,
                           const GridPassage& passage, TraversalResult& traversal,
                           const AddInterval& add_interval) {
    // Makes zeros positive, whichever crossing they come from.
    const OpenCell interval{
        {passed.begin + 0.0f, passed.end + 0.0f, passed.heights}, enter + 0.0f, leave + 0.0f, word};
    if (traversal.interval_count == 0) starts_open = interval.begin == passage.enter && !passage.enters_grid;
    ends_open = interval.end == passage.leave && !passage.leaves_grid;
    open_t += interval.end - interval.begin;
    add_interval(traversal.interval_count++, interval);
  }
};

/// The end of any traversal that is not blocked. `seen`: the sides that it has been on.
NIF_HOST_DEVICE inline void end_traversal(const IntervalRecord& intervals, uint32_t seen,
                                          TraversalResult& traversal) {
  if (traversal.interval_count == 0) return;
  traversal.verdict = Verdict::open;
  traversal.certain = false;
  traversal.saw_outside = (seen & kSeenOutside) != 0;
  traversal.saw_inside = (seen & kSeenInside) != 0;
  traversal.starts_open = intervals.starts_open;
  traversal.ends_open = intervals.ends_open;
  traversal.open_t = intervals.open_t;
}

/// Traverses one segment and overwrites `traversal`. Calls `add_interval` with each interval (an OpenCell)
/// and its number, in order, and `visit` with each cube on the way: the baker counts work with it.
///
/// A blocked traversal ends as soon as that is known. A segment that leaves the grid ends outside, so this
/// may be before it reaches what blocks it. `kInOrder`: it does not end before something is met.
///
/// Here and below, Field is a PlanesField, or derives from one and provides its own voxel_word() and
/// interpolate_features() for its storage.
template <bool kInOrder = false, class Field, class AddInterval, class Visit>
NIF_HOST_DEVICE void follow_segment(const Field& field, const Segment& segment, TraversalResult& traversal,
                                    const AddInterval& add_interval, const Visit& visit) {
  GridPassage passage;
  if (!enter_grid(field, segment, traversal, passage)) return;

  // The t at which each axis crosses its next plane of finest cells.
  int32_t(&cell)[3] = passage.cell;
  int32_t step[3], plane[3];
  float next[3];
  NIF_UNROLL
  for (int a = 0; a < 3; ++a) {
    step[a] = traversal.direction[a] == 0 ? 0 : traversal.direction[a] > 0 ? 1 : -1;
    plane[a] = cell[a] + (step[a] > 0 ? 1 : 0);
    next[a] =
        step[a] == 0 ? kNever : (static_cast<float>(plane[a]) - traversal.origin[a]) * passage.inverse[a];
  }

  IntervalRecord intervals;
  uint32_t seen = !kInOrder ? passage.seen : passage.enters_grid ? uint32_t(kSeenOutside) : 0u;
  float now = passage.enter;
  for (bool ends = false; !ends;) {
    const Cube cube = find_cube(field, cell);
    visit(cube);

    // Cross the nearest plane until it is a face of the cube; the lowest axis if several are equally near.
    const float entered = now;
    for (bool within = true; within;) {
      int nearest = next[1] < next[0] ? 1 : 0;
      float crossing = next[1] < next[0] ? next[1] : next[0];
      if (next[2] < crossing) nearest = 2, crossing = next[2];
      if (!(crossing < passage.leave)) {
        ends = true;
        break;
      }
      now = max_of(crossing, now);
      NIF_UNROLL
      for (int a = 0; a < 3; ++a) {
        if (a != nearest) continue;
        cell[a] += step[a];
        within = cell[a] >= cube.low[a] && cell[a] < cube.low[a] + cube.size;
        plane[a] += step[a];
        next[a] = (static_cast<float>(plane[a]) - traversal.origin[a]) * passage.inverse[a];
      }
    }
    const float left = ends ? max_of(passage.leave, now) : now;

    bool blocked = false;
    const bool empty = word_kind(cube.word) == kEmptyVoxel;
    if (empty) {
      seen |= empty_side(cube.word);
    } else {
      const float size = static_cast<float>(cube.size);
      float middle[3];
      NIF_UNROLL
      for (int a = 0; a < 3; ++a) middle[a] = static_cast<float>(cube.low[a]) + 0.5f * size;
      const CellPassage passed =
          pass_cell(cube.word, middle, size, traversal.origin, traversal.direction, entered, left);
      blocked = passed.blocked;
      seen |= passed.seen;
      if (passed.open) intervals.add(passed, cube.word, entered, left, passage, traversal, add_interval);
    }
    const bool within = blocked || seen == kSeenBoth;
    if (kInOrder && ends && passage.leaves_grid) seen |= kSeenOutside;
    if (within || seen == kSeenBoth) {
      traversal.verdict = Verdict::occluded;
      traversal.last_enter = (within ? entered : left) + 0.0f;
      traversal.last_leave = (within && empty ? entered : left) + 0.0f;
      return;
    }
  }
  end_traversal(intervals, seen, traversal);
}

/// The same, keeping all intervals; entries beyond interval_count are left as they are.
template <class Field, class Visit = NoVisit>
NIF_HOST_DEVICE void traverse_segment(const Field& field, const Segment& segment, FullTraversal& traversal,
                                      const Visit& visit = Visit()) {
  follow_segment(
      field, segment, traversal,
      [&](uint32_t i, const Interval& interval) { traversal.intervals[i] = interval; }, visit);
}

}  // namespace nif::kernels
