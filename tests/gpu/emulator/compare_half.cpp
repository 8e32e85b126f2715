// Compares logits: the reference in single precision against each matrix instruction in halves. What
// differs by more than half_bound(), which must never happen, is counted apart from what may differ.
#include "tests/gpu/emulator/compare_half.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <memory>

#include "tests/gpu/half_bound.hpp"

namespace nif::test {
namespace {

/// Rays that are emulated as one batch; not a multiple of a block's threads.
constexpr size_t kRaysOfPart = 20'011;

/// One result for each kind, with sums in place of means.
using Comparisons = std::vector<HalfComparison>;

Comparisons compare_batch(const kernels::SphericalField& field, std::span<const kernels::Segment> segments,
                          std::span<const uint8_t> visible,
                          std::span<const std::unique_ptr<ObjectOnGpu>> gpus) {
  std::vector<kernels::Answer> expected;
  std::vector<double> bounds;
  for (const kernels::Segment& segment : segments) {
    expected.push_back(kernels::query(field, segment));
    bounds.push_back(half_bound(field, segment));
  }
  Comparisons results;
  for (const std::unique_ptr<ObjectOnGpu>& gpu : gpus) {
    HalfComparison& result = results.emplace_back();
    const ObjectAnswers answers = gpu->ask(segments);
    for (size_t i = 0; i < segments.size(); ++i) {
      const int32_t logit = expected[i].logit;
      const bool seen = answers.logit[i] >= 0, truth = visible[i] != 0;
      result.different += seen != expected[i].visible;
      result.wrong_single += expected[i].visible != truth;
      result.wrong_half += seen != truth;
      const double moved =
          std::fabs(double(answers.logit[i]) - double(logit)) * double(kernels::kSphericalLogitScale);
      result.beyond += moved > bounds[i] || answers.certain[i] != uint8_t(expected[i].certain);
      if (logit == kernels::kCertainLogit) continue;
      ++result.asked;
      const double probability = std::fabs(probability_of(answers.logit[i]) - probability_of(logit));
      result.mean_moved += probability;
      result.most_moved = std::max(result.most_moved, probability);
      result.most_log_odds = std::max(result.most_log_odds, moved);
    }
  }
  return results;
}

}  // namespace

std::vector<HalfComparison> compare_half(const kernels::SphericalField& field,
                                         std::span<const kernels::Segment> segments,
                                         std::span<const uint8_t> visible,
                                         std::span<const MatrixKind> kinds) {
  std::vector<std::unique_ptr<ObjectOnGpu>> gpus;
  for (const MatrixKind kind : kinds)
    gpus.push_back(std::make_unique<ObjectOnGpu>(field, EmulatedWay{kind, runtime::GpuWay::automatic, true}));
  std::vector<Comparisons> parts((segments.size() + kRaysOfPart - 1) / kRaysOfPart);
  tbb::parallel_for(size_t{0}, parts.size(), [&](size_t b) {
    const size_t first = b * kRaysOfPart, count = std::min(kRaysOfPart, segments.size() - first);
    parts[b] = compare_batch(field, segments.subspan(first, count), visible.subspan(first, count), gpus);
  });
  Comparisons all(kinds.size());
  for (size_t k = 0; k < kinds.size(); ++k) {
    for (const Comparisons& part : parts) {
      all[k].asked += part[k].asked;
      all[k].different += part[k].different;
      all[k].beyond += part[k].beyond;
      all[k].wrong_single += part[k].wrong_single;
      all[k].wrong_half += part[k].wrong_half;
      all[k].mean_moved += part[k].mean_moved;
      all[k].most_moved = std::max(all[k].most_moved, part[k].most_moved);
      all[k].most_log_odds = std::max(all[k].most_log_odds, part[k].most_log_odds);
    }
    if (all[k].asked > 0) all[k].mean_moved /= double(all[k].asked);
  }
  return all;
}

}  // namespace nif::test
