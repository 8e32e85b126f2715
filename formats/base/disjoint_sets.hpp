// Groups connected items (union-find). Queries are allowed while connections are still being added.
#pragma once

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace nif {

/// The numbers 0..count-1, each initially in its own set. Takes four bytes per number. Not thread-safe.
class DisjointSets {
 public:
  explicit DisjointSets(size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0u); }
  /// The smallest number in i's set.
  uint32_t find(uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  /// The smaller number remains the representative, so that sets are numbered by their first member.
  void unite(uint32_t a, uint32_t b) {
    a = find(a), b = find(b);
    parent_[a < b ? b : a] = a < b ? a : b;
  }

 private:
  std::vector<uint32_t> parent_;
};

}  // namespace nif
