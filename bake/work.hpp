// Counts the work per ray, by which encodings are compared: the same on every machine and for any number of
// threads.
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <span>
#include <vector>

#include "bake/ground_truth/ray_sets.hpp"

namespace nif::bake {

/// Calls `count(segment, counts)` for each segment, in parallel. It adds the segment's work to `Counts`,
/// which consists of integers, so that the order of adding does not matter, and has an operator+.
template <class Counts, class Count>
Counts count_all(std::span<const Segment> segments, const Count& count) {
  return tbb::parallel_reduce(
      tbb::blocked_range<size_t>(0, segments.size(), 256), Counts{},
      [&](const tbb::blocked_range<size_t>& range, Counts part) {
        for (size_t i = range.begin(); i < range.end(); ++i) count(segments[i], part);
        return part;
      },
      [](const Counts& a, const Counts& b) { return a + b; });
}

/// The mean work per ray over `outer-lines` and `inner-surface`, from some of their rays. `count(segments)`
/// counts the work of all of these rays; its result has nanoseconds().
template <class Count>
double mean_work(const RaySource& source, uint64_t seed, const Count& count) {
  constexpr size_t kWorkRays = 10'000;
  double work = 0;
  for (RaySet set : {RaySet::outer_lines, RaySet::inner_surface}) {
    const std::vector<Segment> rays = draw_ray_set(source, set, kWorkRays, seed).segments;
    if (!rays.empty()) work += count(std::span(rays)).nanoseconds() / double(rays.size()) / 2;
  }
  return work;
}

}  // namespace nif::bake
