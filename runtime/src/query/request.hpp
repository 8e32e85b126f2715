// A query, cut into blocks, with or without a fallback for its uncertain rays.
#pragma once

#include "api/object.hpp"
#include "query/block.hpp"

namespace nif::runtime {

struct Request {
  NifQuery query{};
  NifFallback fallback = nullptr;
  void* fallback_user = nullptr;
  float confidence = 0;
  uint32_t block_rays = kBatchRays;  ///< a multiple of 8

  uint64_t blocks() const { return query.count / block_rays + (query.count % block_rays != 0); }
};

/// Reads, answers and writes one block. Threads may answer different blocks at the same time.
void answer_block_of(const NifSceneObject& scene, const Request& request, uint64_t block, WorkArea& area);

}  // namespace nif::runtime
