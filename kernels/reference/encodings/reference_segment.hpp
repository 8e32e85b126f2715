// The `segment` encoding: planes prove most answers, and a network decides the rest
// (docs/encodings/segment.md). A scene treats such an object like its planes.
#pragma once

#include "kernels/reference/encoding.hpp"
#include "kernels/reference/encodings/reference_proof.hpp"
#include "kernels/reference/network/evaluate_network.hpp"
#include "kernels/reference/network/samples.hpp"

namespace nif::kernels {

inline Calibration calibration(const SegmentField& field) { return field.network.calibration; }

// What query_as() does with intervals. These are structures because GPU compilers must know that a device may
// call a lambda.
struct KeepIntervals {
  Interval* kept;
  uint32_t room;
  NIF_HOST_DEVICE void operator()(uint32_t i, const Interval& interval) const {
    if (i < room) kept[i] = interval;
  }
};
struct PlaceIntervals {
  SamplePlacer& placer;
  Placement& placement;
  uint32_t count;
  NIF_HOST_DEVICE void operator()(uint32_t i, const Interval& interval) const {
    placer.add(interval, i + 1 == count, placement);
  }
};

/// Like query(), for a field in another layout that has its own voxel_word() and interpolate_features().
template <class Field>
Answer query_as(const Field& field, const Segment& segment) {
  // More intervals are rare, and threads may have small stacks.
  constexpr uint32_t kKeptIntervals = 64;
  Interval kept[kKeptIntervals];
  TraversalResult traversal;
  follow_segment(field, segment, traversal, KeepIntervals{kept, kKeptIntervals}, NoVisit());
  if (traversal.verdict != Verdict::open) {
    const bool visible = traversal.verdict == Verdict::visible;
    return {visible, traversal.certain, visible ? kCertainLogit : -kCertainLogit};
  }
  Placement placement;
  SamplePlacer placer(field, traversal);
  const PlaceIntervals add{placer, placement, traversal.interval_count};
  if (traversal.interval_count <= kKeptIntervals) {
    for (uint32_t i = 0; i < traversal.interval_count; ++i) add(i, kept[i]);
  } else {
    TraversalResult again;
    follow_segment(field, segment, again, add, NoVisit());
  }
  place_globals(field, traversal, placement.globals);
  uint8_t inputs[kMaxInputs];
  gather_inputs(field, placement, inputs);
  const int32_t logit = evaluate_network(field.network, inputs);
  return {logit >= 0, false, logit};
}
inline Answer query(const SegmentField& field, const Segment& segment) { return query_as(field, segment); }

/// Like intersect(), for a field in another layout that has its own voxel_word() and interpolate_features().
template <class Field>
Hit intersect_as(const Field& field, const Segment& segment, float limit) {
  return hit_by_planes(field, segment, limit,
                       [&](const Segment& part) { return !query_as(field, part).visible; });
}
inline Hit intersect(const SegmentField& field, const Segment& segment, float limit = kNoHit) {
  return intersect_as(field, segment, limit);
}

template <>
struct EncodingOf<SegmentField> : MadeOf<PlanesField, NetworkField> {
  static constexpr EncodingName kName{1, "segment"};
};

}  // namespace nif::kernels
