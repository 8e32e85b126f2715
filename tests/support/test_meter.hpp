// A memory resource that measures how much memory is used.
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory_resource>

namespace nif::test {

/// Records the most bytes that were held at a time.
class Meter : public std::pmr::memory_resource {
 public:
  size_t most() const { return most_; }

 private:
  void* do_allocate(size_t bytes, size_t alignment) override {
    most_ = std::max(most_, held_ += bytes);
    return std::pmr::new_delete_resource()->allocate(bytes, alignment);
  }
  void do_deallocate(void* memory, size_t bytes, size_t alignment) override {
    held_ -= bytes;
    std::pmr::new_delete_resource()->deallocate(memory, bytes, alignment);
  }
  bool do_is_equal(const memory_resource& other) const noexcept override { return this == &other; }

  size_t held_ = 0, most_ = 0;
};

}  // namespace nif::test
