// The `segment` kernels, run by the emulator on rays of the host.
#pragma once

#include <algorithm>
#include <vector>

#include "kernels/hip/emulator.hpp"
#include "kernels/hip/segment_kernels.hpp"

namespace nif::test {

/// The matrix instructions that segment_network() can be made with, and the waves that go with them.
enum class MatrixKind { dot32, dot64, wmma, mfma16, mfma32, imma };
inline constexpr MatrixKind kMatrixKinds[] = {MatrixKind::dot32,  MatrixKind::dot64,  MatrixKind::wmma,
                                              MatrixKind::mfma16, MatrixKind::mfma32, MatrixKind::imma};
constexpr const char* name_of(MatrixKind kind) {
  constexpr const char* kNames[] = {"dot32", "dot64", "wmma", "mfma16", "mfma32", "imma"};
  return kNames[size_t(kind)];
}
constexpr uint32_t wave_of(MatrixKind kind) {
  return kind == MatrixKind::dot64 || kind == MatrixKind::mfma16 || kind == MatrixKind::mfma32 ? 64 : 32;
}

/// Rays as kernels take them, and their answers, which start as what no kernel writes.
class EmulatedBatch {
 public:
  explicit EmulatedBatch(const std::vector<kernels::Segment>& segments)
      : logit(segments.size(), kUnanswered), certain(segments.size(), 2) {
    for (int a = 0; a < 3; ++a)
      for (const kernels::Segment& s : segments) {
        origin_[a].push_back(s.origin[a]);
        direction_[a].push_back(s.direction[a]);
      }
    for (const kernels::Segment& s : segments) {
      tmin_.push_back(s.tmin);
      tmax_.push_back(s.tmax);
    }
  }

  static constexpr int32_t kUnanswered = 0x55555555;
  uint32_t count() const { return uint32_t(tmin_.size()); }
  kernels::hip::RayArrays rays() const {
    return {{origin_[0].data(), origin_[1].data(), origin_[2].data()},
            {direction_[0].data(), direction_[1].data(), direction_[2].data()},
            tmin_.data(),
            tmax_.data(),
            count()};
  }
  kernels::hip::AnswerArrays answers() { return {logit.data(), certain.data()}; }
  kernels::Segment segment(uint32_t i) const { return kernels::hip::load_ray(rays(), i); }

  std::vector<int32_t> logit;
  std::vector<uint8_t> certain;

 private:
  std::vector<float> origin_[3], direction_[3], tmin_, tmax_;
};

inline uint32_t blocks_for(uint32_t count, uint32_t threads = kernels::hip::kBlockThreads) {
  return (count + threads - 1) / threads;
}

/// What a launch is made with, besides its kernel.
struct EmulatedLaunch {
  uint64_t order = 0;
  uint32_t most_blocks = 3;  ///< of kernels that take any number: so that threads go round
};

inline kernels::hip::EmulatedGrid grid_for(uint32_t blocks, uint32_t shared_bytes, uint32_t wave,
                                           uint64_t order, uint32_t threads = kernels::hip::kBlockThreads) {
  return {.blocks = blocks, .threads = threads, .shared_bytes = shared_bytes, .wave = wave, .order = order};
}

template <uint32_t kFeatures>
void emulate_whole(const kernels::SegmentField& field, EmulatedBatch& batch,
                   const kernels::hip::RayList& list, uint32_t wave, const EmulatedLaunch& launch) {
  namespace hip = kernels::hip;
  const hip::SegmentLayout layout = hip::make_layout(field);
  const uint32_t blocks = std::min(launch.most_blocks, blocks_for(batch.count(), hip::kWholeThreads));
  hip::emulate(grid_for(blocks, layout.whole_bytes, wave, launch.order, hip::kWholeThreads),
               [&](const hip::EmulatedThread& thread) {
                 hip::segment_whole<kFeatures>(thread, field, layout, batch.rays(), list, batch.answers());
               });
}

/// Answers a batch by one kernel.
inline void answer_whole(const kernels::SegmentField& field, EmulatedBatch& batch,
                         const kernels::hip::RayList& list = {}, uint32_t wave = 32,
                         const EmulatedLaunch& launch = {}) {
  if (field.features_per_corner == 2)
    emulate_whole<2>(field, batch, list, wave, launch);
  else
    emulate_whole<0>(field, batch, list, wave, launch);
}

template <class Matrix, uint32_t kFeatures>
void emulate_network(const kernels::SegmentField& field, EmulatedBatch& batch,
                     const kernels::hip::OpenItems& items, uint32_t wave, const EmulatedLaunch& launch) {
  namespace hip = kernels::hip;
  const hip::SegmentLayout layout = hip::make_layout(field);
  const uint32_t blocks = std::min(launch.most_blocks, blocks_for(batch.count()));
  hip::emulate(
      grid_for(blocks, layout.tiled_bytes, wave, launch.order), [&](const hip::EmulatedThread& thread) {
        hip::segment_network<Matrix, kFeatures>(thread, field, layout, batch.rays(), items, batch.answers());
      });
}

template <class Matrix>
void emulate_network(const kernels::SegmentField& field, EmulatedBatch& batch,
                     const kernels::hip::OpenItems& items, uint32_t wave, const EmulatedLaunch& launch) {
  if (field.features_per_corner == 2)
    emulate_network<Matrix, 2>(field, batch, items, wave, launch);
  else
    emulate_network<Matrix, 0>(field, batch, items, wave, launch);
}

struct PipelineCounts {
  uint32_t open, hard;
};

/// Answers a batch by walk, network, and the one kernel for rays of many runs.
inline PipelineCounts answer_by_pipeline(const kernels::SegmentField& field, EmulatedBatch& batch,
                                         MatrixKind kind, const EmulatedLaunch& launch = {}) {
  namespace hip = kernels::hip;
  const uint32_t capacity = batch.count(), wave = wave_of(kind);
  PipelineCounts counts{};
  std::vector<uint32_t> hard(capacity), ray(capacity), about(capacity);
  std::vector<float> begin(size_t(capacity) * hip::kKeptRuns), end(begin.size());
  const hip::OpenItems items{&counts.open, &counts.hard, hard.data(), ray.data(),
                             about.data(), begin.data(), end.data(),  capacity};
  hip::emulate(grid_for(blocks_for(capacity), hip::kWalkSharedBytes, wave, launch.order),
               [&](const hip::EmulatedThread& thread) {
                 hip::segment_walk(thread, field, batch.rays(), items, batch.answers());
               });
  if (hip::make_layout(field).tiled) {
    switch (kind) {
      case MatrixKind::dot32:
      case MatrixKind::dot64:
        emulate_network<hip::DotMatrix>(field, batch, items, wave, launch);
        break;
      case MatrixKind::wmma:
        emulate_network<hip::WmmaMatrix>(field, batch, items, wave, launch);
        break;
      case MatrixKind::mfma16:
        emulate_network<hip::Mfma16Matrix>(field, batch, items, wave, launch);
        break;
      case MatrixKind::mfma32:
        emulate_network<hip::Mfma32Matrix>(field, batch, items, wave, launch);
        break;
      case MatrixKind::imma:
        emulate_network<hip::ImmaMatrix>(field, batch, items, wave, launch);
        break;
    }
  } else {
    answer_whole(field, batch, {ray.data(), &counts.open}, wave, launch);
  }
  answer_whole(field, batch, {hard.data(), &counts.hard}, wave, launch);
  return counts;
}

}  // namespace nif::test
