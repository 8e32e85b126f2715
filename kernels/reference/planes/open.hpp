// Where a traversal leaves a segment open, and what proofs alone answer about it.
#pragma once

#include "kernels/reference/planes/grid_traversal.hpp"

namespace nif::kernels {

/// From where a traversal enters its first open cell to where it leaves the last one, as t.
struct OpenInterval {
  float begin = 0, end = 0;
};
/// Called with each open cell in turn. A structure, because GPU compilers must know that a device may call a
/// lambda.
struct KeepOpen {
  OpenInterval& open;
  NIF_HOST_DEVICE void operator()(uint32_t number, const OpenCell& cell) const {
    if (number == 0) open.begin = cell.enter;
    open.end = cell.leave;
  }
};

/// For rays that start at most this far away, in finest cells, the ends are accurate enough that no triangle
/// lies beyond them. Rays from farther away are tested as a whole.
inline constexpr float kCullingReach = kCertainReach / 4;

NIF_HOST_DEVICE inline bool is_culled(const PlanesField& field, const Segment& segment) {
  bool near = true;
  NIF_UNROLL
  for (int a = 0; a < 3; ++a)
    near = near && magnitude(segment.origin[a] - field.origin[a]) * field.cells_per_unit <= kCullingReach;
  return near;
}

/// The logit of a ray that is left open: it counts as occluded.
inline constexpr int32_t kOpenLogit = -1;

NIF_HOST_DEVICE inline OpenInterval all_of(const Segment& segment) { return {segment.tmin, segment.tmax}; }

/// The part of a segment in which a caller's own triangles can decide what a traversal left open: `open`,
/// longer by a voxel at each end, but within the segment. The whole segment if rounding could exceed that.
NIF_HOST_DEVICE inline OpenInterval widen(const PlanesField& field, const Segment& segment,
                                          const TraversalResult& traversal, const OpenInterval& open) {
  if (!is_culled(field, segment)) return all_of(segment);
  float steepest = 0;
  NIF_UNROLL
  for (int a = 0; a < 3; ++a) steepest = max_of(magnitude(traversal.direction[a]), steepest);
  const float voxel = static_cast<float>(1u << field.levels) / steepest;
  return {max_of(open.begin - voxel, segment.tmin), min_of(open.end + voxel, segment.tmax)};
}

/// The outcome of a traversal: its answer if that is proven; else an answer that is not certain, and in
/// `open` the part of the segment that must still be tested. `open` comes from the traversal's intervals.
NIF_HOST_DEVICE inline Answer answer_of(const PlanesField& field, const Segment& segment,
                                        const TraversalResult& traversal, OpenInterval& open) {
  if (traversal.verdict == Verdict::open) {
    open = widen(field, segment, traversal, open);
    return {false, false, kOpenLogit};
  }
  open = all_of(segment);
  const bool visible = traversal.verdict == Verdict::visible;
  return {visible, traversal.certain, visible ? kCertainLogit : -kCertainLogit};
}

/// `open` is defined only if the answer is not certain. Field: as for follow_segment().
template <class Field>
Answer prove(const Field& field, const Segment& segment, OpenInterval& open) {
  TraversalResult traversal;
  follow_segment(field, segment, traversal, KeepOpen{open}, NoVisit());
  return answer_of(field, segment, traversal, open);
}

}  // namespace nif::kernels
