// Compares logits and certain bits one by one, and they must be equal. A way is left out where the
// encoding makes it the same as another: the emulator is slow.
#include "tests/gpu/emulator/compare_sets.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>

#include "tests/support/query_object.hpp"

namespace nif::test {

/// Rays that are asked at once; not a multiple of a block's threads.
constexpr size_t kRaysOfBatch = 20'011;

std::vector<EmulatedWay> ways_for(const format::ObjectView& object) {
  if (object.is<kernels::SegmentField>()) return all_ways();
  std::vector<EmulatedWay> ways;
  for (const MatrixKind kind : {MatrixKind::dot32, MatrixKind::dot64}) {
    ways.push_back({kind, runtime::GpuWay::one_kernel});
    if (object.is<kernels::SphericalField>()) ways.push_back({kind});
  }
  return ways;
}

uint64_t count_different(const format::ObjectView& object, std::span<const kernels::Segment> segments,
                         const EmulatedWay& way) {
  const ObjectOnGpu gpu(format::field_of(object), way);
  std::atomic<uint64_t> different{0};
  tbb::parallel_for(size_t{0}, (segments.size() + kRaysOfBatch - 1) / kRaysOfBatch, [&](size_t b) {
    const auto part =
        segments.subspan(b * kRaysOfBatch, std::min(kRaysOfBatch, segments.size() - b * kRaysOfBatch));
    const ObjectAnswers answers = gpu.ask(part);
    uint64_t count = 0;
    for (size_t i = 0; i < part.size(); ++i) {
      const kernels::Answer answer = query_object(object, part[i]);
      count += answers.logit[i] != answer.logit || answers.certain[i] != uint8_t(answer.certain);
    }
    different += count;
  });
  return different;
}

}  // namespace nif::test
