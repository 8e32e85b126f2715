// Copies data that several objects of an asset share into the layout of SIMD kernels, once for all of them: a
// small file may have very many objects.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory_resource>
#include <utility>
#include <vector>

namespace nif::kernels::cpu {

/// What is copied.
enum class Shared { network, alpha_map };

class SharedCopies {
 public:
  explicit SharedCopies(std::pmr::memory_resource* memory = std::pmr::get_default_resource())
      : copies_(memory) {}

  /// The copy of `words` words at `original`; its address does not change. If there is none yet, fill(copy)
  /// makes it.
  template <class Fill>
  const uint32_t* get(Shared what, const void* original, size_t words, const Fill& fill) {
    const auto [at, is_new] = copies_.try_emplace({original, what});
    if (is_new) {
      at->second.resize(words);
      fill(at->second.data());
    }
    return at->second.data();
  }

  size_t resident_bytes(Shared what) const {
    size_t bytes = 0;
    for (const auto& [original, copy] : copies_)
      bytes += original.second == what ? copy.capacity() * sizeof(copy[0]) : 0;
    return bytes;
  }

 private:
  std::pmr::map<std::pair<const void*, Shared>, std::pmr::vector<uint32_t>> copies_;
};

}  // namespace nif::kernels::cpu
