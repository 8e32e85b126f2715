// Writes numbers of triangles and vertices, packed in as few bits as the largest one may need. The reader is
// in numbers.cpp; they are separate because the runtime only reads.
#include "formats/nif/asset.hpp"
#include "formats/nif/triangles/pack_numbers.hpp"

namespace nif::format {

bool NumbersRecords::has(const Object& object) { return !object.numbers.empty(); }

std::vector<NumbersRecord> NumbersRecords::write(const Object& object, uint32_t number, Section& payloads) {
  std::vector<NumbersRecord> records;
  for (const auto& [kind, numbers] : object.numbers)
    records.push_back({number, kind, numbers.below, 0,
                       payloads.add_payload(packed(numbers.values, kernels::source_bits(numbers.below)))});
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
