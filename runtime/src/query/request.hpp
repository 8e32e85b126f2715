// A query, cut into batches, with or without a fallback for its uncertain rays.
#pragma once

#include <optional>

#include "api/object.hpp"
#include "query/batch.hpp"

namespace nif::runtime {

struct Request {
  NifRays rays{};
  NifAnswers answers{};
  NifFallback fallback = nullptr;
  void* fallback_user = nullptr;
  float confidence = 0;
  std::optional<NifOpenRays> open;   ///< where rays go that proofs leave open
  std::optional<NifHits> hits;       ///< what is asked for in place of answers
  uint32_t batch_rays = kBatchRays;  ///< a multiple of 8

  uint64_t batches() const { return rays.count / batch_rays + (rays.count % batch_rays != 0); }
};

/// Reads, answers and writes one batch. Threads may answer different batches at the same time.
void answer_batch_of(const NifSceneObject& scene, const Request& request, uint64_t batch, WorkArea& area);

}  // namespace nif::runtime
