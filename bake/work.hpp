// Counted work of a ray, by which encodings are compared: the same on every machine and for any number of
// threads.
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include "bake/oracle/ray_sets.hpp"

namespace nif::bake {

/// The mean work of a ray over `outer-lines` and `inner-surface`, a part of them drawn for this.
/// `count(segment, counts)` adds what a ray takes to `Counts`, which has integers, so that the order of
/// adding does not matter, an operator+, and nanoseconds() for all of it.
template <class Counts, class Count>
double mean_work(const RaySource& source, uint64_t seed, const Count& count) {
  constexpr size_t kWorkRays = 10'000;
  double work = 0;
  for (RaySet set : {RaySet::outer_lines, RaySet::inner_surface}) {
    const LabelledRays rays = make_ray_set(source, set, kWorkRays, seed);
    if (rays.segments.empty()) continue;
    const Counts sum = tbb::parallel_reduce(
        tbb::blocked_range<size_t>(0, rays.segments.size(), 256), Counts{},
        [&](const tbb::blocked_range<size_t>& range, Counts part) {
          for (size_t i = range.begin(); i < range.end(); ++i) count(rays.segments[i], part);
          return part;
        },
        [](const Counts& a, const Counts& b) { return a + b; });
    work += sum.nanoseconds() / double(rays.segments.size()) / 2;
  }
  return work;
}

}  // namespace nif::bake
