#include "tests/gpu/compare_half.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "tests/gpu/half_bound.hpp"

namespace nif::test {
namespace {

/// Rays that are emulated as one batch; not a multiple of a block's threads.
constexpr size_t kRaysOfBatch = 20'011;

/// With sums in place of means.
HalfComparison compare_batch(const kernels::SphericalField& field, std::span<const kernels::Segment> segments,
                             std::span<const uint8_t> visible, HalfKind kind, const EmulatedLaunch& launch) {
  HalfComparison result;
  EmulatedBatch batch({segments.begin(), segments.end()});
  const HalfCounts counts = answer_spherical_half(field, batch, kind, launch);
  result.asked = counts.outer + counts.inner;
  for (uint32_t i = 0; i < batch.count(); ++i) {
    const kernels::Answer expected = kernels::query_spherical(field, segments[i]);
    const bool seen = batch.logit[i] >= 0;
    const double moved =
        std::fabs(double(batch.logit[i]) - double(expected.logit)) * double(kernels::kSphericalLogitScale);
    result.different += seen != expected.visible;
    result.beyond += moved > half_bound(field, segments[i]) || batch.certain[i] != uint8_t(expected.certain);
    result.wrong_single += expected.visible != (visible[i] != 0);
    result.wrong_half += seen != (visible[i] != 0);
    if (expected.logit == kernels::kCertainLogit) continue;
    const double probability = std::fabs(probability_of(batch.logit[i]) - probability_of(expected.logit));
    result.mean_moved += probability;
    result.most_moved = std::max(result.most_moved, probability);
    result.most_log_odds = std::max(result.most_log_odds, moved);
  }
  return result;
}

}  // namespace

HalfComparison compare_half(const kernels::SphericalField& field, std::span<const kernels::Segment> segments,
                            std::span<const uint8_t> visible, HalfKind kind) {
  std::vector<HalfComparison> parts((segments.size() + kRaysOfBatch - 1) / kRaysOfBatch);
  tbb::parallel_for(size_t{0}, parts.size(), [&](size_t b) {
    const size_t first = b * kRaysOfBatch, count = std::min(kRaysOfBatch, segments.size() - first);
    parts[b] = compare_batch(field, segments.subspan(first, count), visible.subspan(first, count), kind,
                             {.order = b, .most_blocks = 1 + uint32_t(b % 50)});
  });
  HalfComparison all;
  for (const HalfComparison& part : parts) {
    all.asked += part.asked;
    all.different += part.different;
    all.beyond += part.beyond;
    all.wrong_single += part.wrong_single;
    all.wrong_half += part.wrong_half;
    all.mean_moved += part.mean_moved;
    all.most_moved = std::max(all.most_moved, part.most_moved);
    all.most_log_odds = std::max(all.most_log_odds, part.most_log_odds);
  }
  if (all.asked > 0) all.mean_moved /= double(all.asked);
  return all;
}

}  // namespace nif::test
