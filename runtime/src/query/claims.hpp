// Lets threads share a fixed supply without a lock: each claims one of the numbers 0 .. count - 1, and
// returns it.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory_resource>
#include <vector>

namespace nif::runtime {

class Claims {
 public:
  static constexpr uint32_t kNone = 0xffffffffu;

  Claims(uint32_t count, std::pmr::memory_resource* memory) : taken_(count, memory) {}

  /// Returns a free number, or kNone.
  uint32_t try_claim() {
    // The latest number is most likely free again, and its memory in this thread's caches.
    static thread_local uint32_t latest = 0;
    const auto count = uint32_t(taken_.size());
    for (uint32_t k = 0; k < count; ++k) {
      const uint32_t i = (latest + k) % count;
      if (taken_[i].taken.load()) continue;
      if (taken_[i].taken.exchange(true)) continue;
      latest = i;
      return i;
    }
    return kNone;
  }

  /// Waits until a number is free.
  uint32_t claim() {
    uint32_t i = try_claim();
    if (i != kNone) return i;
    waiting_.fetch_add(1);
    for (;;) {
      const uint32_t seen = returned_.load();
      i = try_claim();
      if (i != kNone) break;
      returned_.wait(seen);
    }
    waiting_.fetch_sub(1);
    return i;
  }

  void give_back(uint32_t i) {
    taken_[i].taken.store(false);
    if (waiting_.load() == 0) return;
    returned_.fetch_add(1);
    returned_.notify_all();
  }

  uint32_t count() const { return uint32_t(taken_.size()); }

 private:
  /// One cache line each, so that threads do not share lines.
  struct alignas(64) Flag {
    std::atomic<bool> taken = false;
  };
  std::pmr::vector<Flag> taken_;
  std::atomic<uint32_t> waiting_ = 0, returned_ = 0;
};

}  // namespace nif::runtime
