// Packs numbers from the lowest bit of the first word on.
#include "formats/nif/triangles/pack_numbers.hpp"

#include "formats/base/size.hpp"
#include "kernels/reference/triangles/source_triangles.hpp"

namespace nif::format {

std::vector<uint32_t> packed(const std::vector<uint32_t>& numbers, uint32_t bits) {
  std::vector<uint32_t> words(memory_size(kernels::source_words(numbers.size(), bits)));
  uint64_t at = 0;
  for (const uint32_t number : numbers) {
    const auto word = size_t(at / 32);
    words[word] |= number << at % 32;
    if (at % 32 + bits > 32) words[word + 1] |= number >> (32 - at % 32);
    at += bits;
  }
  return words;
}

}  // namespace nif::format
