// Writes numbers of triangles and vertices, packed in as few bits as the largest one may need. The reader is
// in numbers.cpp; they are separate because the runtime only reads.
#include "formats/base/size.hpp"
#include "formats/nif/asset.hpp"

namespace nif::format {
namespace {

std::vector<uint32_t> packed(const Numbers& numbers) {
  const uint32_t bits = kernels::source_bits(numbers.below);
  std::vector<uint32_t> words(memory_size(kernels::source_words(numbers.values.size(), bits)));
  uint64_t at = 0;
  for (const uint32_t number : numbers.values) {
    const auto word = size_t(at / 32);
    words[word] |= number << at % 32;
    if (at % 32 + bits > 32) words[word + 1] |= number >> (32 - at % 32);
    at += bits;
  }
  return words;
}

}  // namespace

bool NumbersRecords::has(const Object& object) { return !object.numbers.empty(); }

std::vector<NumbersRecord> NumbersRecords::write(const Object& object, uint32_t number, Section& payloads) {
  std::vector<NumbersRecord> records;
  for (const auto& [kind, numbers] : object.numbers)
    records.push_back({number, kind, numbers.below, 0, payloads.add_payload(packed(numbers))});
  return records;
}

Numbers to_numbers(const NumbersView& view) {
  Numbers numbers{view.below, {}};
  numbers.values.reserve(view.field.count);
  for (uint32_t i = 0; i < view.field.count; ++i)
    numbers.values.push_back(kernels::source_triangle(view.field, i));
  return numbers;
}

}  // namespace nif::format
