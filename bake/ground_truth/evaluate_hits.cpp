// Compares hits ray by ray. Before bounds are called wrong, rays a millionth beside this one are tested, too,
// because rounding may decide where a ray meets the surface.
#include "bake/ground_truth/evaluate_hits.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "formats/base/vector.hpp"

namespace nif::bake {
namespace {

/// Degrees between a normal towards the ray's origin and a triangle's, which may face either way.
double degrees_between(const Double3& normal, const Double3& triangle, const Double3& direction) {
  const Double3 truth = triangle * (dot(triangle, direction) > 0 ? -1 : 1);
  return std::atan2(length(cross(normal, truth)), dot(normal, truth)) * 180 / std::numbers::pi;
}

/// Compares one ray after the other and sums up the results.
class HitComparison {
 public:
  HitComparison(const FirstHits& ours, const EmbreeTruth& embree, const ObjectScale& scale,
                const SourceMesh* source)
      : ours_(ours), embree_(embree), scale_(scale), source_(source) {}

  void add(const Segment& segment, size_t i) {
    const std::optional<EmbreeTruth::Hit> truth = embree_.first_hit(segment);
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
  /// Also for rays whose hit is not certain: one of their bounds may be proven. If the bounds do not hold for
  /// the ray itself, but rays a millionth beside it have hits within them, or both before and after, then
  /// rounding decides where the hit is.
  bool bounds_hold(const Segment& segment, const std::optional<EmbreeTruth::Hit>& truth, size_t i,
                   double tolerance) const {
    const auto place = [](const std::optional<EmbreeTruth::Hit>& hit) {
      return hit ? double(hit->t) : kInfinity;
    };
    double first = place(truth), last = first;
    const auto overlap = [&] {
      return last >= double(ours_.low[i]) - tolerance && first <= double(ours_.high[i]) + tolerance;
    };
    if (overlap()) return true;
    for (const Segment& other : embree_.beside(segment)) {
      if (other.tmin > other.tmax) return true;
      const double t = place(embree_.first_hit(other));
      first = std::min(first, t), last = std::max(last, t);
    }
    return overlap();
  }

  void add_errors(const Segment& segment, const EmbreeTruth::Hit& truth, const Double3& direction, size_t i) {
    const double off = std::abs(double(ours_.t[i]) - double(truth.t)) * length(direction);
    sums_.place.push_back(static_cast<float>(off / scale_.diagonal));
    if (scale_.voxels_per_unit > 0) sums_.voxels.push_back(static_cast<float>(off * scale_.voxels_per_unit));
    sums_.angle.push_back(
        static_cast<float>(degrees_between(to_double(ours_.normal[i]), truth.normal, direction)));
    if (ours_.triangle[i] == FirstHits::kNoTriangle) return;
    ++sums_.triangles;
    sums_.displaced += off > kDisplaced * scale_.diagonal;
    if (!source_) return;
    const Double3 point = to_double(std::to_array(segment.origin)) + direction * double(ours_.t[i]);
    ++sums_.named;
    sums_.otherwise += ours_.triangle[i] != source_->numbers[truth.triangle];
    sums_.misnamed += !is_named_well(point, i);
  }

  /// Whether u and v place the hit correctly on the named triangle of the source mesh.
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
  const EmbreeTruth& embree_;
  const ObjectScale& scale_;
  const SourceMesh* source_;
  HitAccuracy sums_;
};

std::optional<Percentiles> percentiles_or_none(const std::vector<float>& values) {
  if (values.empty()) return std::nullopt;
  return percentiles_of(values);
}

}  // namespace

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

HitFigures HitAccuracy::figures() const {
  return {*this, place.size(), percentiles_or_none(place), percentiles_or_none(voxels),
          percentiles_or_none(angle)};
}

SetHitFigures figures_of(const SetHits& sets) {
  SetHitFigures figures;
  for (size_t s = 0; s < sets.size(); ++s) figures[s] = sets[s].figures();
  return figures;
}

HitAccuracy evaluate_hits(std::span<const Segment> segments, const HitFinder& find, const EmbreeTruth& embree,
                          const ObjectScale& scale, const SourceMesh* source) {
  constexpr size_t kHitChunk = 4096;  // rays that a thread takes at a time
  std::vector<HitAccuracy> parts((segments.size() + kHitChunk - 1) / kHitChunk);
  tbb::parallel_for(size_t{0}, parts.size(), [&](size_t b) {
    const size_t first = b * kHitChunk;
    const auto chunk = segments.subspan(first, std::min(kHitChunk, segments.size() - first));
    const FirstHits ours = find(chunk);
    HitComparison comparison(ours, embree, scale, source);
    for (size_t i = 0; i < chunk.size(); ++i) comparison.add(chunk[i], i);
    parts[b] = std::move(comparison.sums());
  });
  HitAccuracy all;
  for (const HitAccuracy& part : parts) all += part;
  return all;
}

}  // namespace nif::bake
