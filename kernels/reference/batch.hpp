// Reads and writes single segments and hits of a batch, for scalar code.
#pragma once

#include <algorithm>

#include "kernels/reference/hit.hpp"
#include "kernels/reference/object_kernel.hpp"
#include "kernels/reference/ray.hpp"

namespace nif::kernels {

/// Requires i < batch.count.
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

/// Requires i < kBatchRays. Does not change `count`.
inline void set_segment(SegmentBatch& batch, uint32_t i, const Segment& segment) {
  for (int a = 0; a < 3; ++a) {
    batch.origin[a][i] = segment.origin[a];
    batch.direction[a][i] = segment.direction[a];
  }
  batch.tmin[i] = segment.tmin;
  batch.tmax[i] = segment.tmax;
}

inline Hit hit_of(const HitBatch& hits, uint32_t i) {
  return {.t = hits.t[i],
          .low = hits.low[i],
          .high = hits.high[i],
          .normal = {hits.normal[0][i], hits.normal[1][i], hits.normal[2][i]},
          .triangle = hits.triangle[i],
          .u = hits.u[i],
          .v = hits.v[i]};
}

inline void set_hit(HitBatch& hits, uint32_t i, const Hit& hit) {
  hits.t[i] = hit.t;
  hits.low[i] = hit.low;
  hits.high[i] = hit.high;
  for (int a = 0; a < 3; ++a) hits.normal[a][i] = hit.normal[a];
  hits.triangle[i] = hit.triangle;
  hits.u[i] = hit.u;
  hits.v[i] = hit.v;
}

/// Writes the same hit for the first `count` segments, column by column.
inline void fill_hits(HitBatch& hits, uint32_t count, const Hit& hit) {
  std::fill_n(hits.t, count, hit.t);
  std::fill_n(hits.low, count, hit.low);
  std::fill_n(hits.high, count, hit.high);
  for (int a = 0; a < 3; ++a) std::fill_n(hits.normal[a], count, hit.normal[a]);
  std::fill_n(hits.triangle, count, hit.triangle);
  std::fill_n(hits.u, count, hit.u);
  std::fill_n(hits.v, count, hit.v);
}

/// Finds each hit with `intersect_one(segment, limit)`.
template <class IntersectOne>
void intersect_each(const SegmentBatch& batch, const float* limit, HitBatch& hits,
                    const IntersectOne& intersect_one) {
  for (uint32_t i = 0; i < batch.count; ++i) set_hit(hits, i, intersect_one(segment_of(batch, i), limit[i]));
}

}  // namespace nif::kernels
