// The `segment` kernels, run by the emulator on rays of the host.
#pragma once

#include <algorithm>
#include <vector>

#include "kernels/hip/segment_kernels.hpp"
#include "tests/gpu/emulated.hpp"

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
