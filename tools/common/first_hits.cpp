#include "tools/common/first_hits.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <optional>
#include <utility>

#include "formats/base/vector.hpp"
#include "tools/common/runtime_handles.hpp"
#include "tools/common/segment_query.hpp"

namespace nif::tools {
namespace {

using bake::Oracle;
using bake::Segment;

/// Rays that a thread takes at a time.
constexpr size_t kHitChunk = 4096;

/// The answers to some rays, of which there are some.
struct FirstHits {
  std::vector<uint8_t> hit, certain;
  std::vector<float> t, u, v, low, high;
  std::vector<std::array<float, 3>> normal, color;
  std::vector<uint32_t> instance, object, triangle;

  FirstHits(NifScene scene, std::span<const Segment> segments)
      : hit(segments.size()),
        certain(segments.size()),
        t(segments.size()),
        u(segments.size()),
        v(segments.size()),
        low(segments.size()),
        high(segments.size()),
        normal(segments.size()),
        color(segments.size()),
        instance(segments.size()),
        object(segments.size()),
        triangle(segments.size()) {
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
    const NifQuery query = query_of(segments);
    check(nifIntersect(scene, &query, &hits));
  }

  /// Whether ray i has the same bits.
  bool same(const FirstHits& other, size_t i) const {
    const auto equal = [&](const auto& a, const auto& b) { return !std::memcmp(&a[i], &b[i], sizeof(a[i])); };
    return equal(hit, other.hit) && equal(certain, other.certain) && equal(t, other.t) && equal(u, other.u) &&
           equal(v, other.v) && equal(low, other.low) && equal(high, other.high) &&
           equal(normal, other.normal) && equal(color, other.color) && equal(instance, other.instance) &&
           equal(object, other.object) && equal(triangle, other.triangle);
  }
};

/// Degrees between a normal towards the ray's origin and a triangle's, which may face either way.
double degrees_between(const Double3& normal, const Double3& triangle, const Double3& direction) {
  const Double3 truth = triangle * (dot(triangle, direction) > 0 ? -1 : 1);
  return std::atan2(length(cross(normal, truth)), dot(normal, truth)) * 180 / std::numbers::pi;
}

/// Compares one ray after the other and adds up what is found.
class HitComparison {
 public:
  HitComparison(const FirstHits& ours, const Oracle& oracle, const ObjectScale& scale,
                const SourceMesh* source)
      : ours_(ours), oracle_(oracle), scale_(scale), source_(source) {}

  void add(const Segment& segment, size_t i) {
    const std::optional<Oracle::Hit> truth = oracle_.first_hit(segment);
    const bool hit = ours_.hit[i] != 0;
    ++sums_.rays;
    sums_.missed += truth && !hit;
    sums_.false_hits += !truth && hit;
    sums_.certain += ours_.certain[i] != 0;
    const Double3 direction = to_double(std::to_array(segment.direction));
    sums_.bounds_wrong +=
        !bounds_hold(segment, truth, i, kBoundsTolerance * scale_.diagonal / length(direction));
    if (truth && hit) add_errors(segment, *truth, direction, i);
  }

  HitAccuracy& sums() { return sums_; }

 private:
  /// Also of rays whose hit is not certain: one of their bounds may be proven. Where the bounds do not hold
  /// for the ray itself, but rays a millionth beside it are met within them, or before and after, then
  /// rounding decides where the ray is met.
  bool bounds_hold(const Segment& segment, const std::optional<Oracle::Hit>& truth, size_t i,
                   double tolerance) const {
    const auto place = [](const std::optional<Oracle::Hit>& hit) { return hit ? double(hit->t) : kInfinity; };
    double first = place(truth), last = first;
    const auto overlap = [&] {
      return last >= double(ours_.low[i]) - tolerance && first <= double(ours_.high[i]) + tolerance;
    };
    if (overlap()) return true;
    for (const Segment& other : oracle_.beside(segment)) {
      if (other.tmin > other.tmax) return true;
      const double t = place(oracle_.first_hit(other));
      first = std::min(first, t), last = std::max(last, t);
    }
    return overlap();
  }

  void add_errors(const Segment& segment, const Oracle::Hit& truth, const Double3& direction, size_t i) {
    const double off = std::abs(double(ours_.t[i]) - double(truth.t)) * length(direction);
    sums_.place.push_back(static_cast<float>(off / scale_.diagonal));
    if (scale_.voxels_per_unit > 0) sums_.voxels.push_back(static_cast<float>(off * scale_.voxels_per_unit));
    sums_.angle.push_back(
        static_cast<float>(degrees_between(to_double(ours_.normal[i]), truth.normal, direction)));
    if (ours_.triangle[i] == NIF_NONE) return;
    ++sums_.triangles;
    sums_.displaced += off > kDisplaced * scale_.diagonal;
    if (!source_) return;
    const Double3 point = to_double(std::to_array(segment.origin)) + direction * double(ours_.t[i]);
    ++sums_.named;
    sums_.otherwise += ours_.triangle[i] != source_->numbers[truth.triangle];
    sums_.misnamed += !is_named_well(point, i);
  }

  /// Whether the named triangle of the source mesh has the hit where u and v say.
  bool is_named_well(const Double3& point, size_t i) const {
    if (ours_.triangle[i] >= source_->mesh.triangles.size()) return false;
    const mesh::Triangle& corners = source_->mesh.triangles[ours_.triangle[i]];
    const double u = double(ours_.u[i]), v = double(ours_.v[i]), weights[3] = {1 - u - v, u, v};
    Double3 named{};
    for (size_t k = 0; k < 3; ++k)
      named = named + to_double(source_->mesh.positions[corners[k]]) * weights[k];
    return length(named - point) <= kDisplaced * scale_.diagonal;
  }

  const FirstHits& ours_;
  const Oracle& oracle_;
  const ObjectScale& scale_;
  const SourceMesh* source_;
  HitAccuracy sums_;
};

/// The result of each run of rays, in order.
template <class Result, class Work>
std::vector<Result> by_chunk(std::span<const Segment> segments, const Work& work) {
  std::vector<Result> results((segments.size() + kHitChunk - 1) / kHitChunk);
  tbb::parallel_for(size_t{0}, results.size(), [&](size_t b) {
    const size_t first = b * kHitChunk;
    results[b] = work(segments.subspan(first, std::min(kHitChunk, segments.size() - first)));
  });
  return results;
}

}  // namespace

HitAccuracy& HitAccuracy::operator+=(const HitAccuracy& other) {
  rays += other.rays;
  missed += other.missed;
  false_hits += other.false_hits;
  certain += other.certain;
  bounds_wrong += other.bounds_wrong;
  triangles += other.triangles;
  displaced += other.displaced;
  named += other.named;
  otherwise += other.otherwise;
  misnamed += other.misnamed;
  place.insert(place.end(), other.place.begin(), other.place.end());
  voxels.insert(voxels.end(), other.voxels.begin(), other.voxels.end());
  angle.insert(angle.end(), other.angle.begin(), other.angle.end());
  return *this;
}

HitAccuracy evaluate_hits(std::span<const Segment> segments, NifScene scene, const Oracle& oracle,
                          const ObjectScale& scale, const SourceMesh* source) {
  HitAccuracy all;
  for (const HitAccuracy& part : by_chunk<HitAccuracy>(segments, [&](std::span<const Segment> chunk) {
         const FirstHits ours(scene, chunk);
         HitComparison comparison(ours, oracle, scale, source);
         for (size_t i = 0; i < chunk.size(); ++i) comparison.add(chunk[i], i);
         return std::move(comparison.sums());
       }))
    all += part;
  return all;
}

uint64_t different_hits(std::span<const Segment> segments, NifScene scene, NifScene reference) {
  uint64_t all = 0;
  for (const uint64_t part : by_chunk<uint64_t>(segments, [&](std::span<const Segment> chunk) {
         const FirstHits ours(scene, chunk), theirs(reference, chunk);
         uint64_t different = 0;
         for (size_t i = 0; i < chunk.size(); ++i) different += !ours.same(theirs, i);
         return different;
       }))
    all += part;
  return all;
}

Percentiles percentiles_of(std::vector<float> values) {
  Percentiles found{};
  auto from = values.begin();
  for (size_t p = 0; p < found.size(); ++p) {
    const auto rank = ptrdiff_t(std::ceil(kPercentiles[p] * double(values.size()))) - 1;
    const auto at = values.begin() + std::max<ptrdiff_t>(0, rank);
    std::nth_element(from, at, values.end());
    found[p] = double(*at);
    from = at;
  }
  return found;
}

}  // namespace nif::tools
