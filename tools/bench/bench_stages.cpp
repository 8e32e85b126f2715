// Calls the kernels directly, because a query of the runtime cannot time its stages. The answers are compared
// with the ground truth, so that the timed answers are those that the stated error is for.
#include "tools/bench/bench_stages.hpp"

#include <algorithm>
#include <memory>

#include "formats/base/status.hpp"
#include "formats/nif/file_memory.hpp"
#include "formats/nif/reader.hpp"
#include "kernels/cpu/spherical/single_weights.hpp"
#include "kernels/reference/batch.hpp"

namespace nif::tools {
namespace {

using kernels::cpu::StageSeconds;

kernels::SegmentBatch to_batch(std::span<const kernels::Segment> segments) {
  kernels::SegmentBatch batch;
  batch.count = uint32_t(segments.size());
  for (uint32_t i = 0; i < segments.size(); ++i) kernels::set_segment(batch, i, segments[i]);
  return batch;
}

/// The rays of a field in batches, laid out once.
class StagedField {
 public:
  StagedField(const kernels::SphericalField& field, const bake::RaysWithTruth& rays)
      : field_(kernels::cpu::with_single_weights(field, weights_)), rays_(rays) {
    const std::span<const kernels::Segment> all(rays.segments);
    for (size_t first = 0; first < all.size(); first += kernels::kBatchRays)
      batches_.push_back(
          to_batch(all.subspan(first, std::min<size_t>(kernels::kBatchRays, all.size() - first))));
  }

  size_t rays() const { return rays_.segments.size(); }

  /// Adds to `seconds`; returns the number of wrong answers.
  uint64_t ask(void* scratch, StageSeconds& seconds) const {
    auto answers = std::make_unique<kernels::AnswerBatch>();
    uint64_t wrong = 0;
    for (size_t b = 0; b < batches_.size(); ++b) {
      if (!kernels::cpu::time_spherical(field_, batches_[b], *answers, scratch, seconds))
        throw Error(Status::usage,
                    "--stages: this machine lacks the instruction sets that stages can be timed for");
      const uint8_t* labels = rays_.visible.data() + b * kernels::kBatchRays;
      for (uint32_t i = 0; i < batches_[b].count; ++i) wrong += (answers->logit[i] >= 0) != (labels[i] != 0);
    }
    return wrong;
  }

 private:
  kernels::cpu::SharedCopies weights_;
  kernels::SphericalField field_;
  const bake::RaysWithTruth& rays_;
  std::vector<kernels::SegmentBatch> batches_;
};

}  // namespace

std::optional<StageTimes> time_stages(const std::string& asset,
                                      const std::vector<const bake::RaysWithTruth*>& rays, size_t rounds,
                                      uint64_t wrong) {
  const format::FileMemory file = format::FileMemory::load(asset, format::FileMemory::Mode::read);
  const format::AssetView view = format::read_asset(file.bytes(), asset);
  std::vector<std::unique_ptr<StagedField>> fields;
  size_t count = 0;
  for (size_t i = 0; i < view.objects.size(); ++i) {
    if (!view.objects[i].is<kernels::SphericalField>()) continue;
    fields.push_back(
        std::make_unique<StagedField>(view.objects[i].as<kernels::SphericalField>(), *rays.at(i)));
    count += fields.back()->rays();
  }
  if (count == 0) return std::nullopt;

  struct alignas(64) Scratch {
    std::byte bytes[kernels::kKernelScratchBytes];
  };
  const auto scratch = std::make_unique<Scratch>();
  std::array<std::vector<double>, kernels::cpu::kSphericalStages> nanoseconds;
  // The first round warms up.
  for (size_t round = 0; round <= rounds; ++round) {
    StageSeconds seconds{};
    uint64_t missed = 0;
    for (const auto& field : fields) missed += field->ask(scratch.get(), seconds);
    if (fields.size() == view.objects.size() && missed != wrong)
      throw Error(Status::internal, "the answers timed by stages differ from those whose error was measured");
    if (round == 0) continue;
    for (size_t s = 0; s < seconds.size(); ++s) nanoseconds[s].push_back(seconds[s] * 1e9 / double(count));
  }
  StageTimes times;
  for (size_t s = 0; s < times.size(); ++s) times[s] = spread_of(nanoseconds[s]);
  return times;
}

}  // namespace nif::tools
