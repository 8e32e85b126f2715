// All memory that one thread needs to answer a batch of rays. Queries allocate nothing: the memory comes from
// the caller (scratch) or from the device, which keeps some ready.
#pragma once

#include "kernels/cpu/top_level/ray_stream.hpp"
#include "kernels/reference/object_kernel.hpp"
#include "kernels/reference/scene_hit.hpp"
#include "kernels/reference/scene_query.hpp"
#include "kernels/reference/top_level.hpp"
#include "query/claims.hpp"

namespace nif::runtime {

using kernels::Cursor;
using kernels::kBatchRays;
using kernels::kBatchRoom;

/// Streams within streams, at most: of rays that may meet the box of an inner node, and so on.
inline constexpr uint32_t kStreamLevels = 3;

/// A ray of the batch, and an instance to test it against.
struct Pair {
  uint32_t object, instance, ray;
};

/// Nothing in it is initialised, and a batch touches only what it needs.
struct alignas(64) WorkArea {
  kernels::SegmentBatch rays;  ///< the batch, in world space
  uint32_t mask[kBatchRoom];   ///< the rays' masks, if the query has any

  // The batch's answers. The sign of a logit is always valid, its value only if details are wanted.
  kernels::AnswerBatch answers;
  float probability[kBatchRoom];
  uint8_t visible[kBatchRoom];
  uint64_t fallback_rays[kBatchRoom];  ///< numbers within the query

  // For scenes of several instances. By ray:
  uint8_t misses[kBatchRoom];   ///< 1: it certainly meets nothing, if it meets no instance's box
  uint8_t decided[kBatchRoom];  ///< 1: no further instance is asked
  // In streams:
  kernels::cpu::RayStream streams[kStreamLevels];
  uint32_t narrowed[kStreamLevels][kBatchRoom];  ///< [level][entry] its number a level above
  uint32_t entries[kBatchRoom];                  ///< [object_rays] its number in the stream
  uint32_t numbers[kBatchRoom];                  ///< [object_rays] its number in the batch
  // In rounds:
  float inverse[3][kBatchRoom];  ///< BoxRay
  Cursor cursors[kBatchRoom];
  uint16_t active[kBatchRoom];           ///< undecided rays
  kernels::BatchPart parts[kBatchRays];  ///< of object_rays
  // In both:
  Pair pairs[2][kBatchRoom];
  kernels::CombinedAnswer combined[kBatchRoom];

  // Rays in one object's space, and its answers.
  kernels::SegmentBatch object_rays;
  kernels::AnswerBatch object_answers;

  // The intervals in which rays stay open: of the batch, and according to one object.
  kernels::OpenBatch open, object_open;
  uint32_t open_rays[kBatchRoom];      ///< numbers within the query
  uint32_t open_instance[kBatchRoom];  ///< the only one with the ray open; kernels::kNoInstance: several

  // First hits: of the batch, and of one object.
  kernels::HitBatch hits, object_hits;
  uint32_t hit_instance[kBatchRoom];  ///< kernels::kNoInstance: none
  float hit_limit[kBatchRoom];        ///< [as object_hits]

  alignas(64) std::byte kernel_scratch[kernels::kKernelScratchBytes];
};

/// Keeps a device's work areas ready, so that queries allocate nothing.
class WorkAreas {
 public:
  WorkAreas(uint32_t count, std::pmr::memory_resource* memory)
      : memory_(memory),
        claims_(count, memory),
        areas_(static_cast<WorkArea*>(memory->allocate(count * sizeof(WorkArea), alignof(WorkArea)))) {}
  WorkAreas(const WorkAreas&) = delete;
  WorkAreas& operator=(const WorkAreas&) = delete;
  ~WorkAreas() { memory_->deallocate(areas_, claims_.count() * sizeof(WorkArea), alignof(WorkArea)); }

 private:
  friend class ClaimedArea;
  std::pmr::memory_resource* memory_;
  Claims claims_;
  WorkArea* areas_;  ///< not initialised, so only memory that queries touch becomes resident
};

/// Holds a work area for its lifetime: the caller's scratch, or one of the device's, for which it waits if
/// all are in use.
class ClaimedArea {
 public:
  ClaimedArea(WorkAreas& areas, void* scratch)
      : areas_(areas),
        number_(scratch ? Claims::kNone : areas.claims_.claim()),
        area_(scratch ? static_cast<WorkArea*>(scratch) : areas.areas_ + number_) {}
  ClaimedArea(const ClaimedArea&) = delete;
  ClaimedArea& operator=(const ClaimedArea&) = delete;
  ~ClaimedArea() {
    if (number_ != Claims::kNone) areas_.claims_.give_back(number_);
  }
  WorkArea& operator*() const { return *area_; }

 private:
  WorkAreas& areas_;
  uint32_t number_;
  WorkArea* area_;
};

}  // namespace nif::runtime
