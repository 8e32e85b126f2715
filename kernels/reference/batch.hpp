// One segment of a batch, as the scalar code has it.
#pragma once

#include "kernels/reference/object_kernel.hpp"
#include "kernels/reference/ray.hpp"

namespace nif::kernels {

/// i < batch.count.
inline Segment segment_of(const SegmentBatch& batch, uint32_t i) {
  Segment segment;
  for (int a = 0; a < 3; ++a) {
    segment.origin[a] = batch.origin[a][i];
    segment.direction[a] = batch.direction[a][i];
  }
  segment.tmin = batch.tmin[i];
  segment.tmax = batch.tmax[i];
  return segment;
}

/// i < kBatchRays. `count` stays as it is.
inline void set_segment(SegmentBatch& batch, uint32_t i, const Segment& segment) {
  for (int a = 0; a < 3; ++a) {
    batch.origin[a][i] = segment.origin[a];
    batch.direction[a][i] = segment.direction[a];
  }
  batch.tmin[i] = segment.tmin;
  batch.tmax[i] = segment.tmax;
}

}  // namespace nif::kernels
