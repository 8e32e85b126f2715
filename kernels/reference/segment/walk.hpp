// The walk of a segment through the occupancy grid: exact answers first, and where the surface may be.
//
// This header defines the answer. All of it is IEEE single precision in the order written, without
// contraction; other kernels may leap over voxels but must arrive at the same crossings
// (docs/encodings/segment.md, "The walk").
#pragma once

#include "kernels/reference/arithmetic.hpp"
#include "kernels/reference/ray.hpp"
#include "kernels/reference/segment/field.hpp"

namespace nif::kernels {

enum class Verdict : uint8_t {
  visible,    ///< no surface voxel on the way
  occluded,   ///< both a proven outside and a proven inside voxel on the way
  ambiguous,  ///< the network has to say
};

enum class VoxelState : uint8_t { outside, inside, unknown, surface };

/// A maximal run of consecutive surface voxels, as the t of its ends.
struct Run {
  float begin, end;
};

/// Each run but the last is followed by a voxel that is none, and no axis is walked twice.
inline constexpr uint32_t kMaxRuns = 3 * kMaxVoxels / 2 + 1;

/// What a walk finds out, but for the runs themselves.
struct WalkResult {
  Verdict verdict = Verdict::visible;
  bool certain = true;  ///< false where ambiguous, or where rounding may exceed what the voxels are padded by

  // The rest is set where the verdict is ambiguous.
  bool saw_outside = false, saw_inside = false;
  bool starts_in_surface =
      false;  ///< the segment's own start (not its entry into the grid) lies in a surface voxel
  bool ends_in_surface = false;
  float origin[3] = {}, direction[3] = {};  ///< in grid space: voxel (i,j,k) is [i,i+1] x [j,j+1] x [k,k+1]
  float surface_t = 0;                      ///< sum of the runs' lengths, in t
  uint32_t run_count = 0;
};

struct Walk : WalkResult {
  Run runs[kMaxRuns];
};

/// Padding of voxels when the baker marks them as surface, in voxels.
inline constexpr double kSurfacePadding = 1.0 / 64;

/// A component below this fraction of the largest moves less than the padding across the whole grid: taken as
/// 0.
inline constexpr float kFlatDirection = 0x1p-40f;

/// Later than any crossing.
inline constexpr float kNever = 3.402823466e+38f;

NIF_HOST_DEVICE inline VoxelState voxel_state(const SegmentField& field, const int32_t voxel[3]) {
  const uint32_t x = uint32_t(voxel[0]), y = uint32_t(voxel[1]), z = uint32_t(voxel[2]);
  const uint32_t brick = (x >> 2) + field.bricks[0] * ((y >> 2) + field.bricks[1] * (z >> 2));
  const uint16_t entry = field.brick_table[brick];
  if (entry < kFirstMixedBrick) return static_cast<VoxelState>(entry);
  const BrickStates& states = field.brick_states[entry - kFirstMixedBrick];
  const uint32_t bit = (x & 3) + 4 * (y & 3) + 16 * (z & 3);
  const uint32_t surface = uint32_t(states.surface >> bit) & 1, aux = uint32_t(states.aux >> bit) & 1;
  if (surface) return aux ? VoxelState::unknown : VoxelState::surface;
  return aux ? VoxelState::inside : VoxelState::outside;
}

/// Looks at no voxel.
struct NoVisit {
  NIF_HOST_DEVICE void operator()(const int32_t (&)[3]) const {}
};

/// Takes a segment's origin and direction to grid space, where components of the direction that move nothing
/// are 0. False where the segment is none: a number that is not finite, no direction, or one smaller or
/// larger than can be computed with.
template <class Field>
NIF_HOST_DEVICE bool to_grid_space(const Field& field, const Segment& segment, WalkResult& walk,
                                   float& reach) {
  bool finite = true;
  float steepest = 0;
  reach = 0;
  NIF_UNROLL
  for (int a = 0; a < 3; ++a) {
    walk.origin[a] = (segment.origin[a] - field.origin[a]) * field.voxels_per_unit;
    walk.direction[a] = segment.direction[a] * field.voxels_per_unit;
    finite = finite && is_finite(walk.origin[a]) && is_finite(walk.direction[a]);
    reach = max_of(magnitude(walk.origin[a]), reach);
    steepest = max_of(magnitude(walk.direction[a]), steepest);
  }
  NIF_UNROLL
  for (int a = 0; a < 3; ++a)
    if (magnitude(walk.direction[a]) < steepest * kFlatDirection) walk.direction[a] = 0;
  return finite && steepest >= kMinDirection && steepest <= kMaxDirection;
}

/// Where a segment passes the grid.
struct GridPassage {
  float inverse[3];  ///< of the direction; infinite along an axis that is not moved along
  float enter, leave;
  bool enters_grid, leaves_grid;  ///< the segment is clipped at that end
  int32_t voxel[3];               ///< the first
};

/// The start of any walk. False where it meets no voxel; `walk` then is what comes of it.
template <class Field>
NIF_HOST_DEVICE bool enter_grid(const Field& field, const Segment& segment, WalkResult& walk,
                                GridPassage& passage) {
  walk.verdict = Verdict::visible;
  walk.certain = true;
  walk.run_count = 0;

  // To grid space. A segment that is not one (NaN, no direction, tmin > tmax) meets nothing; it is certain of
  // that only where it is empty by definition.
  float reach;
  const bool valid = to_grid_space(field, segment, walk, reach);
  if (!(segment.tmin <= segment.tmax)) {
    walk.certain = segment.tmin > segment.tmax;
    return false;
  }
  if (!valid) {
    walk.certain = false;
    return false;
  }
  walk.certain = reach <= kCertainReach;

  // Clip to the grid.
  float enter = segment.tmin, leave = segment.tmax;
  bool enters_grid = false, leaves_grid = false;
  NIF_UNROLL
  for (int a = 0; a < 3; ++a) {
    const float size = static_cast<float>(field.voxels[a]);
    const float inverse = passage.inverse[a] = 1.0f / walk.direction[a];
    if (walk.direction[a] == 0) {
      if (!(walk.origin[a] >= 0 && walk.origin[a] <= size)) return false;
      continue;
    }
    const bool up = walk.direction[a] > 0;
    const float low = (0 - walk.origin[a]) * inverse, high = (size - walk.origin[a]) * inverse;
    const float first = up ? low : high, last = up ? high : low;
    if (first > enter) enter = first, enters_grid = true;
    if (last < leave) leave = last, leaves_grid = true;
  }
  // Where a number so large divides one so small that every crossing overflows, the segment comes nowhere.
  if (!(enter <= leave && enter <= kNever)) return false;

  NIF_UNROLL
  for (int a = 0; a < 3; ++a) {
    const float at = walk.origin[a] + enter * walk.direction[a];
    passage.voxel[a] = to_index(at, int32_t(field.voxels[a]) - 1);
  }
  passage.enter = enter;
  passage.leave = leave;
  passage.enters_grid = enters_grid;
  passage.leaves_grid = leaves_grid;
  return true;
}

/// The run that a walk is in, and the length of those before.
struct RunRecord {
  float begin = 0, surface_t = 0;

  NIF_HOST_DEVICE void start(float t) { begin = t + 0.0f; }  // a zero is positive, whichever crossing it is
  template <class AddRun>
  NIF_HOST_DEVICE void end(float t, WalkResult& walk, const AddRun& add_run) {
    t += 0.0f;
    add_run(walk.run_count++, Run{begin, t});
    surface_t += t - begin;
  }
};

/// What a walk has seen once it has come to the segment's end or the grid's.
struct Seen {
  bool outside, inside, first_surface, last_surface;
};

/// The end of any walk that is not blocked. `now` is where the last voxel was entered.
template <class AddRun>
NIF_HOST_DEVICE void end_walk(const GridPassage& passage, float now, const Seen& seen, RunRecord& run,
                              WalkResult& walk, const AddRun& add_run) {
  if (seen.last_surface) run.end(max_of(passage.leave, now), walk, add_run);
  if (walk.run_count == 0) return;
  walk.verdict = Verdict::ambiguous;
  walk.certain = false;
  walk.saw_outside = seen.outside;
  walk.saw_inside = seen.inside;
  walk.starts_in_surface = seen.first_surface && !passage.enters_grid;
  walk.ends_in_surface = seen.last_surface && !passage.leaves_grid;
  walk.surface_t = run.surface_t;
}

/// Walks one segment. `walk` is overwritten. `add_run` is called with each run and its number, in order, and
/// `visit` with each voxel on the way: the baker counts work with it.
///
/// Here and below, Field is a SegmentField, or derives from one and says by a voxel_state() and an
/// interpolate_features() of its own how it stores them.
template <class Field, class AddRun, class Visit>
NIF_HOST_DEVICE void follow_segment(const Field& field, const Segment& segment, WalkResult& walk,
                                    const AddRun& add_run, const Visit& visit) {
  GridPassage passage;
  if (!enter_grid(field, segment, walk, passage)) return;

  // The t at which each axis crosses its next plane.
  int32_t(&voxel)[3] = passage.voxel;
  int32_t step[3], plane[3];
  float next[3];
  NIF_UNROLL
  for (int a = 0; a < 3; ++a) {
    step[a] = walk.direction[a] == 0 ? 0 : walk.direction[a] > 0 ? 1 : -1;
    plane[a] = voxel[a] + (step[a] > 0 ? 1 : 0);
    next[a] = step[a] == 0 ? kNever : (static_cast<float>(plane[a]) - walk.origin[a]) * passage.inverse[a];
  }

  RunRecord run;
  Seen seen{};
  float now = passage.enter;
  for (bool first = true;; first = false) {
    visit(voxel);
    const VoxelState state = voxel_state(field, voxel);
    const bool surface = state == VoxelState::surface;
    seen.outside |= state == VoxelState::outside;
    seen.inside |= state == VoxelState::inside;
    if (seen.outside && seen.inside) {
      walk.verdict = Verdict::occluded;
      return;
    }
    if (first) seen.first_surface = surface;
    if (surface && !seen.last_surface) run.start(now);
    if (!surface && seen.last_surface) run.end(now, walk, add_run);
    seen.last_surface = surface;

    // Cross the nearest plane; the lowest axis where several are equally near.
    int nearest = next[1] < next[0] ? 1 : 0;
    float crossing = next[1] < next[0] ? next[1] : next[0];
    if (next[2] < crossing) nearest = 2, crossing = next[2];
    if (!(crossing < passage.leave)) break;
    now = max_of(crossing, now);
    bool left = false;
    NIF_UNROLL
    for (int a = 0; a < 3; ++a) {
      if (a != nearest) continue;
      voxel[a] += step[a];
      left = voxel[a] < 0 || voxel[a] >= int32_t(field.voxels[a]);
      plane[a] += step[a];
      next[a] = (static_cast<float>(plane[a]) - walk.origin[a]) * passage.inverse[a];
    }
    if (left) {
      passage.leave = now;
      passage.leaves_grid = true;
      break;
    }
  }
  end_walk(passage, now, seen, run, walk, add_run);
}

/// The same with all runs kept; those beyond run_count are left as they are.
template <class Field, class Visit = NoVisit>
NIF_HOST_DEVICE void walk_segment(const Field& field, const Segment& segment, Walk& walk,
                                  const Visit& visit = Visit()) {
  follow_segment(
      field, segment, walk, [&](uint32_t i, const Run& run) { walk.runs[i] = run; }, visit);
}

}  // namespace nif::kernels
