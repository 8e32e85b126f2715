// Requests every output of nifIntersect, so that comparing two scenes misses no bit.
#include "tools/common/hit_finders.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstring>
#include <vector>

#include "tools/common/runtime_handles.hpp"
#include "tools/common/segment_query.hpp"

namespace nif::tools {
namespace {

using bake::Segment;

/// All outputs of the runtime for one or more rays.
struct RuntimeHits : bake::FirstHits {
  std::vector<std::array<float, 3>> color;
  std::vector<uint32_t> instance, object;

  RuntimeHits(NifScene scene, std::span<const Segment> segments)
      : FirstHits(segments.size()),
        color(segments.size()),
        instance(segments.size()),
        object(segments.size()) {
    NifHits hits{};
    hits.struct_size = sizeof(hits);
    hits.hit = hit.data();
    hits.t = t.data();
    hits.normal = normal.front().data();
    hits.instance = instance.data();
    hits.object = object.data();
    hits.triangle = triangle.data();
    hits.u = u.data();
    hits.v = v.data();
    hits.certain = certain.data();
    hits.t_low = low.data();
    hits.t_high = high.data();
    hits.color = color.front().data();
    const NifRays rays = rays_of(segments);
    check(nifIntersect(scene, &rays, &hits));
  }

  /// Whether all outputs of ray i have the same bits.
  bool same(const RuntimeHits& other, size_t i) const {
    const auto equal = [&](const auto& a, const auto& b) { return !std::memcmp(&a[i], &b[i], sizeof(a[i])); };
    return equal(hit, other.hit) && equal(certain, other.certain) && equal(t, other.t) && equal(u, other.u) &&
           equal(v, other.v) && equal(low, other.low) && equal(high, other.high) &&
           equal(normal, other.normal) && equal(color, other.color) && equal(instance, other.instance) &&
           equal(object, other.object) && equal(triangle, other.triangle);
  }
};

}  // namespace

bake::HitFinder runtime_finder(NifScene scene) {
  return
      [scene](std::span<const Segment> segments) -> bake::FirstHits { return RuntimeHits(scene, segments); };
}

uint64_t different_hits(std::span<const Segment> segments, NifScene scene, NifScene reference) {
  constexpr size_t kChunk = 4096;  // rays that a thread processes at a time
  std::vector<uint64_t> parts((segments.size() + kChunk - 1) / kChunk);
  tbb::parallel_for(size_t{0}, parts.size(), [&](size_t b) {
    const auto chunk = segments.subspan(b * kChunk, std::min(kChunk, segments.size() - b * kChunk));
    const RuntimeHits ours(scene, chunk), theirs(reference, chunk);
    for (size_t i = 0; i < chunk.size(); ++i) parts[b] += !ours.same(theirs, i);
  });
  uint64_t all = 0;
  for (const uint64_t part : parts) all += part;
  return all;
}

}  // namespace nif::tools
