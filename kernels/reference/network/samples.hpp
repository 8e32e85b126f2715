// Turns a traversed segment into the network's integer inputs: sample points, interpolation weights, inputs.
#pragma once

#include "kernels/reference/network/network_field.hpp"
#include "kernels/reference/planes/grid_traversal.hpp"

namespace nif::kernels {

/// One point along the segment: its voxel, and how far it lies along each axis in 1/128 of the voxel. 128 is
/// the voxel's far end.
struct SamplePoint {
  uint16_t voxel[3];
  uint8_t fraction[3];
  uint8_t height;  ///< between the planes of its cell, 0..kTopHeight
};

inline constexpr int32_t kFractionOne = 128;

/// The global inputs, which belong to no point, 0..127 each. A segment and its reverse are equally blocked,
/// so both are presented alike: from the end that makes the direction point into the upper half space.
enum GlobalInput : uint32_t {
  kInputDirectionX,
  kInputDirectionY,
  kInputDirectionZ,
  kInputLength,      ///< total length of the intervals, times length_scale
  kInputSawOutside,  ///< 0 or 127, like the next three
  kInputSawInside,
  kInputStarts,  ///< the segment starts in an interval
  kInputEnds,    ///< it ends in an interval
};
static_assert(kInputEnds + 1 == kGlobalInputs);

struct Placement {
  SamplePoint points[kMaxSamples];  ///< [SegmentField::samples]
  uint8_t globals[kGlobalInputs];
};

/// Is the segment presented starting from its end?
NIF_HOST_DEVICE inline bool presented_reversed(const TraversalResult& traversal) {
  const float* d = traversal.direction;
  return d[2] < 0 || (d[2] == 0 && (d[1] < 0 || (d[1] == 0 && d[0] < 0)));
}

/// Height of a point of an interval between the planes there; 0 for an interval without length.
NIF_HOST_DEVICE inline uint8_t height_at(const Interval& interval, float t) {
  const float from = static_cast<float>(begin_height(interval.heights)),
              to = static_cast<float>(end_height(interval.heights));
  const float share = (t - interval.begin) / (interval.end - interval.begin);
  return uint8_t(to_index(from + (to - from) * share + 0.5f, kTopHeight));
}

/// Spreads K points evenly by arc length over consecutive intervals.
struct PointSpread {
  uint32_t count;            ///< K
  float spacing;             ///< arc length between points
  bool reversed;             ///< points are numbered from the segment's end
  float interval_start = 0;  ///< arc length at the start of the current interval
  uint32_t placed = 0;

  /// Calls put(number, t, height) for each point in the interval.
  template <class Put>
  NIF_HOST_DEVICE void place(const Interval& interval, bool last, const Put& put) {
    for (; placed < count; ++placed) {
      const float s = (static_cast<float>(placed) + 0.5f) * spacing;
      if (!last && s > interval_start + (interval.end - interval.begin)) {
        interval_start += interval.end - interval.begin;
        return;
      }
      const float t = min_of(interval.begin + (s - interval_start), interval.end);
      put(reversed ? count - 1 - placed : placed, t, height_at(interval, t));
    }
  }
};

/// Starts at the first interval of an open traversal.
NIF_HOST_DEVICE inline PointSpread start_spread(uint32_t samples, const TraversalResult& traversal) {
  return {samples, traversal.open_t / static_cast<float>(samples), presented_reversed(traversal)};
}

/// Places the sample points of an open traversal.
class SamplePlacer {
 public:
  /// The result of the traversal must outlive this; its intervals are not needed.
  NIF_HOST_DEVICE SamplePlacer(const SegmentField& field, const TraversalResult& traversal)
      : field_(field), traversal_(traversal), spread_(start_spread(field.samples, traversal)) {}

  /// Calls put(number, t, height) for each point in the interval.
  template <class Put>
  NIF_HOST_DEVICE void place(const Interval& interval, bool last, const Put& put) {
    spread_.place(interval, last, put);
  }

  NIF_HOST_DEVICE SamplePoint point_at(float t, uint8_t height) const {
    SamplePoint point;
    point.height = height;
    NIF_UNROLL
    for (int a = 0; a < 3; ++a) {
      const float at = (traversal_.origin[a] + t * traversal_.direction[a]) * field_.voxels_per_cell;
      const int32_t voxel = to_index(at, int32_t(field_.voxels[a]) - 1);
      point.voxel[a] = uint16_t(voxel);
      const float scaled = (at - static_cast<float>(voxel)) * static_cast<float>(kFractionOne) + 0.5f;
      point.fraction[a] = uint8_t(to_index(scaled, kFractionOne));
    }
    return point;
  }

  /// Calls put(number, point) for each point in the interval.
  template <class Put>
  NIF_HOST_DEVICE void add(const Interval& interval, bool last, const Put& put) {
    place(interval, last,
          [&](uint32_t number, float t, uint8_t height) { put(number, point_at(t, height)); });
  }

  /// The same, into a placement.
  NIF_HOST_DEVICE void add(const Interval& interval, bool last, Placement& placement) {
    add(interval, last, [&](uint32_t number, const SamplePoint& point) { placement.points[number] = point; });
  }

 private:
  const SegmentField& field_;
  const TraversalResult& traversal_;
  PointSpread spread_;
};

/// The global inputs [kGlobalInputs] of an open traversal.
NIF_HOST_DEVICE inline void place_globals(const SegmentField& field, const TraversalResult& traversal,
                                          uint8_t* globals) {
  const float* d = traversal.direction;
  const bool reversed = presented_reversed(traversal);
  const float length = square_root(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  for (int a = 0; a < 3; ++a) {
    const float unit = d[a] / length;
    globals[a] = uint8_t(to_index(64.0f + 63.5f * (reversed ? -unit : unit), 127));
  }
  globals[kInputLength] = uint8_t(to_index(traversal.open_t * length * field.length_scale + 0.5f, 127));
  globals[kInputSawOutside] = traversal.saw_outside ? 127 : 0;
  globals[kInputSawInside] = traversal.saw_inside ? 127 : 0;
  const bool starts = reversed ? traversal.ends_open : traversal.starts_open;
  const bool ends = reversed ? traversal.starts_open : traversal.ends_open;
  globals[kInputStarts] = starts ? 127 : 0;
  globals[kInputEnds] = ends ? 127 : 0;
}

NIF_HOST_DEVICE inline void place_samples(const SegmentField& field, const FullTraversal& traversal,
                                          Placement& placement) {
  SamplePlacer placer(field, traversal);
  for (uint32_t r = 0; r < traversal.interval_count; ++r)
    placer.add(traversal.intervals[r], r + 1 == traversal.interval_count, placement);
  place_globals(field, traversal, placement.globals);
}

inline constexpr uint32_t kNoCorner = 0xffffffffu;

/// Index of the corner (x,y,z) among those that have features, or kNoCorner.
NIF_HOST_DEVICE inline uint32_t corner_index(const SegmentField& field, uint32_t x, uint32_t y, uint32_t z) {
  const uint32_t brick = (x >> 2) + field.bricks[0] * ((y >> 2) + field.bricks[1] * (z >> 2));
  const uint16_t entry = field.brick_table[brick];
  if (entry < kFirstMixedBrick) return kNoCorner;
  const uint64_t corners = field.brick_corners[entry - kFirstMixedBrick];
  const uint32_t bit = (x & 3) + 4 * (y & 3) + 16 * (z & 3);
  if (!((corners >> bit) & 1)) return kNoCorner;
  const uint64_t below = corners & ((uint64_t{1} << bit) - 1);
  return field.corner_base[entry - kFirstMixedBrick] + count_bits(below);
}

/// Weight of corner c (bit 0: x, bit 1: y, bit 2: z) of a point's voxel; the eight sum to 2^21.
NIF_HOST_DEVICE constexpr int32_t corner_weight(const uint8_t fraction[3], int c) {
  int32_t weight = 1;
  for (int a = 0; a < 3; ++a)
    weight *= (c >> a) & 1 ? int32_t(fraction[a]) : kFractionOne - int32_t(fraction[a]);
  return weight;
}

/// Rounds a trilinear sum of features (-127..127 times 2^21) to an input 0..127; 64 if no corner has a
/// feature.
NIF_HOST_DEVICE constexpr uint8_t feature_input(int32_t sum) {
  return uint8_t((sum + (127 << 21) + (1 << 21)) >> 22);
}

/// Calls add(corner, weight) for each corner of a point's voxel that has features.
template <class Add>
NIF_HOST_DEVICE void for_each_corner(const SegmentField& field, const SamplePoint& point, const Add& add) {
  NIF_UNROLL
  for (int c = 0; c < 8; ++c) {
    const uint32_t corner = corner_index(field, point.voxel[0] + (c & 1), point.voxel[1] + ((c >> 1) & 1),
                                         point.voxel[2] + (c >> 2));
    if (corner != kNoCorner) add(corner, corner_weight(point.fraction, c));
  }
}

/// The inputs [features_per_corner] of one point.
NIF_HOST_DEVICE inline void interpolate_features(const SegmentField& field, const SamplePoint& point,
                                                 uint8_t* inputs) {
  const uint32_t features = field.features_per_corner;
  int32_t sums[kMaxFeatures] = {};
  for_each_corner(field, point, [&](uint32_t corner, int32_t weight) {
    for (uint32_t f = 0; f < features; ++f) sums[f] += weight * field.features[corner * features + f];
  });
  for (uint32_t f = 0; f < features; ++f) inputs[f] = feature_input(sums[f]);
}

/// All inputs of the network: K points x F features, point by point, then the K heights, then the global
/// inputs.
template <class Field>
void gather_inputs(const Field& field, const Placement& placement, uint8_t* inputs) {
  const uint32_t features = field.features_per_corner;
  uint8_t* const heights = inputs + field.samples * features;
  for (uint32_t j = 0; j < field.samples; ++j) {
    interpolate_features(field, placement.points[j], inputs + j * features);
    heights[j] = placement.points[j].height;
  }
  for (uint32_t g = 0; g < kGlobalInputs; ++g) heights[field.samples + g] = placement.globals[g];
}

}  // namespace nif::kernels
