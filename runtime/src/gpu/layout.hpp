// Computes a fingerprint of the structures that the runtime and its GPU module exchange: two binaries with
// different fingerprints were built from different sources, and must not be used together.
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>

namespace nif::runtime {

/// FNV-1a over sizes, alignments and offsets, in the order of the calls.
class LayoutHash {
 public:
  /// A member, a base class, or a word shared by bit fields.
  struct Part {
    size_t size, alignment;
    template <class Structure, class Member>
    constexpr Part(Member Structure::*) : size(sizeof(Member)), alignment(alignof(Member)) {}
    constexpr Part(size_t bytes, size_t aligned_to) : size(bytes), alignment(aligned_to) {}
  };
  template <class T>
  static constexpr Part part() {
    return {sizeof(T), alignof(T)};
  }

  /// Adds a structure and all of its parts, in order. Does not compile if a part that takes space is missing.
  template <class T>
  constexpr void structure(std::initializer_list<Part> parts) {
    number(sizeof(T));
    number(alignof(T));
    size_t end = 0;
    for (const Part& part : parts) {
      const size_t offset = round_up(end, part.alignment);
      number(offset);
      number(part.size);
      number(part.alignment);
      end = offset + part.size;
    }
    if (round_up(end, alignof(T)) != sizeof(T)) throw "the parts do not make up the structure";
  }
  constexpr void number(uint64_t value) {
    for (uint32_t shift = 0; shift < 64; shift += 8)
      value_ = (value_ ^ (value >> shift & 255)) * 0x100000001b3u;
  }
  constexpr uint64_t value() const { return value_; }

 private:
  static constexpr size_t round_up(size_t n, size_t to) { return (n + to - 1) / to * to; }
  uint64_t value_ = 0xcbf29ce484222325u;
};

}  // namespace nif::runtime
