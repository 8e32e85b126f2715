#include "tests/gpu/compare_sets.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>

#include "tests/support/query_object.hpp"

namespace nif::test {

/// Rays that are emulated as one batch; not a multiple of a block's threads.
constexpr size_t kRaysOfBatch = 20'011;

std::vector<KernelVariant> all_variants() {
  std::vector<KernelVariant> variants{{true, MatrixKind::dot32}};
  for (const MatrixKind kind : kMatrixKinds) variants.push_back({false, kind});
  return variants;
}

Comparison compare(const format::ObjectView& object, std::span<const kernels::Segment> segments,
                   const KernelVariant& variant) {
  std::atomic<uint64_t> different{0}, open{0}, hard{0};
  const size_t batches = (segments.size() + kRaysOfBatch - 1) / kRaysOfBatch;
  tbb::parallel_for(size_t{0}, batches, [&](size_t b) {
    const auto part =
        segments.subspan(b * kRaysOfBatch, std::min(kRaysOfBatch, segments.size() - b * kRaysOfBatch));
    EmulatedBatch batch({part.begin(), part.end()});
    const EmulatedLaunch launch{.order = b, .most_blocks = 1 + uint32_t(b % 50)};
    PipelineCounts counts{};
    if (object.encoding == format::kBvh)
      answer_bvh(object.bvh, batch, wave_of(variant.kind), launch);
    else if (object.encoding == format::kSpherical)
      answer_spherical(*object.spherical, batch, wave_of(variant.kind), launch);
    else if (variant.whole)
      answer_whole(object.field, batch, {}, wave_of(variant.kind), launch);
    else
      counts = answer_by_pipeline(object.field, batch, variant.kind, launch);
    open += counts.open;
    hard += counts.hard;
    uint64_t count = 0;
    for (uint32_t i = 0; i < batch.count(); ++i) {
      const kernels::Answer answer = query_object(object, part[i]);
      count += batch.logit[i] != answer.logit || batch.certain[i] != uint8_t(answer.certain);
    }
    different += count;
  });
  return {different, open, hard};
}

}  // namespace nif::test
