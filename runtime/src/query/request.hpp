// A query of any kind after its checks, divided into batches.
#pragma once

#include <optional>

#include "kernels/reference/batch.hpp"
#include "nif/nif.h"

namespace nif::runtime {

struct Request {
  NifRays rays{};
  NifAnswers answers{};
  NifFallback fallback = nullptr;
  void* fallback_user = nullptr;
  float confidence = 0;
  std::optional<NifOpenRays> open;            ///< lists for the rays that proofs leave open
  std::optional<NifHits> hits;                ///< wanted instead of answers
  uint32_t batch_rays = kernels::kBatchRays;  ///< a multiple of 8

  uint64_t batches() const { return rays.count / batch_rays + (rays.count % batch_rays != 0); }
};

}  // namespace nif::runtime
