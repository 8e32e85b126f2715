// Keeps a device's work areas ready, so that queries allocate nothing.
#pragma once

#include "query/claims.hpp"
#include "query/work_area.hpp"

namespace nif::runtime {

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
