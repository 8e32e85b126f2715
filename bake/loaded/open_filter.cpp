// Finds open segments with the fastest CPU kernel and a tiny network of zeros. An answer that is not certain
// means that the network was evaluated, so the segment is open. If there is no such kernel, the reference
// traverses instead.
#include "bake/loaded/open_filter.hpp"

#include <algorithm>

#include "kernels/cpu/encodings/cpu_segment.hpp"
#include "kernels/cpu/shared_copies.hpp"
#include "kernels/reference/batch.hpp"
#include "kernels/reference/object_kernel.hpp"
#include "kernels/reference/planes/grid_traversal.hpp"

namespace nif::bake {

using kernels::Segment;

/// The smallest network that takes the field's inputs: it only matters whether it is evaluated.
struct OpenFilter::BlankNetwork {
  std::vector<int8_t> weights;
  std::vector<int32_t> biases = std::vector<int32_t>(1);
};

struct OpenFilter::FastKernel {
  kernels::cpu::SharedCopies copies;
  kernels::KernelPointer kernel;
};

OpenFilter::OpenFilter(const kernels::SegmentField& field)
    : field_(field), network_(std::make_unique<BlankNetwork>()) {
  const uint32_t inputs = kernels::input_count(field.samples, field.features_per_corner);
  network_->weights.resize(inputs);
  field_.network = {};
  field_.network.layer_count = 1;
  field_.network.layers[0] = {inputs, 1, 0, network_->weights.data(), network_->biases.data()};
  using kernels::cpu::Isa;
  for (const Isa isa : {Isa::avx512, Isa::avx2, Isa::sse4, Isa::neon}) {
    if (!kernels::cpu::available(isa)) continue;
    fast_ = std::make_unique<FastKernel>();
    fast_->kernel = kernels::cpu::make_kernel(field_, {isa, std::pmr::new_delete_resource(), fast_->copies});
    break;
  }
}

OpenFilter::~OpenFilter() = default;

void OpenFilter::select(std::span<const Segment> segments, std::vector<uint32_t>& open) const {
  if (!fast_) {
    kernels::FullTraversal traversal;
    for (uint32_t i = 0; i < segments.size(); ++i) {
      kernels::traverse_segment(field_, segments[i], traversal);
      if (traversal.verdict == kernels::Verdict::open) open.push_back(i);
    }
    return;
  }
  struct Work {
    kernels::SegmentBatch batch;
    kernels::AnswerBatch answers;
    alignas(64) std::byte scratch[kernels::kKernelScratchBytes];
  };
  const auto work = std::make_unique_for_overwrite<Work>();
  for (size_t first = 0; first < segments.size(); first += kernels::kBatchRays) {
    const std::span<const Segment> part =
        segments.subspan(first, std::min<size_t>(kernels::kBatchRays, segments.size() - first));
    work->batch.count = uint32_t(part.size());
    for (uint32_t i = 0; i < part.size(); ++i) kernels::set_segment(work->batch, i, part[i]);
    fast_->kernel->answer(work->batch, work->answers, work->scratch);
    for (uint32_t i = 0; i < part.size(); ++i) {
      const int32_t logit = work->answers.logit[i];
      if (logit != kernels::kCertainLogit && logit != -kernels::kCertainLogit)
        open.push_back(uint32_t(first) + i);
    }
  }
}

}  // namespace nif::bake
