// Copies data that several objects of an asset share into the layout of SIMD kernels, once for all of them: a
// small file may have very many objects.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory_resource>
#include <utility>
#include <vector>

namespace nif::kernels::cpu {

/// What is copied.
enum class Copied : uint8_t { weights, triangles };

class SharedCopies {
 public:
  using Words = std::pmr::vector<uint32_t>;
  /// The addresses of all that a copy depends on; the rest is null.
  using Originals = std::array<const void*, 3>;

  explicit SharedCopies(std::pmr::memory_resource* memory = std::pmr::get_default_resource())
      : copies_(memory) {}

  /// The copy of data at `originals`; its address does not change. If there is none yet, fill(copy) makes it.
  template <class Fill>
  const Words& get(Copied kind, const Originals& originals, const Fill& fill) {
    if (const auto at = copies_.find({kind, originals}); at != copies_.end()) return at->second;
    Words words(copies_.get_allocator().resource());
    fill(words);
    return copies_.emplace(std::pair(kind, originals), std::move(words)).first->second;
  }

  size_t resident_bytes(Copied kind) const {
    size_t bytes = 0;
    for (const auto& [key, copy] : copies_)
      if (key.first == kind) bytes += kEntryBytes + copy.capacity() * sizeof(copy[0]);
    return bytes;
  }

 private:
  using Copies = std::pmr::map<std::pair<Copied, Originals>, Words>;
  static constexpr size_t kEntryBytes = sizeof(Copies::value_type) + 4 * sizeof(void*);

  Copies copies_;
};

}  // namespace nif::kernels::cpu
