// Writes the numbers that triangles have in the source mesh, packed in as few bits as its number of triangles
// needs. The reader is in source_triangles.cpp; they are separate because the runtime only reads.
#include "formats/base/size.hpp"
#include "formats/nif/triangles/source_triangles.hpp"

namespace nif::format {

SourceTrianglesWriter::SourceTrianglesWriter(Sections& sections)
    : records_(&sections.add(kSourceRecords, 0)), numbers_(&sections.add(kSourceNumbers, 0)) {}

void SourceTrianglesWriter::add(const SourceTriangles& source, uint32_t object) {
  const uint32_t bits = kernels::source_bits(source.triangles);
  std::vector<uint32_t> words(memory_size(kernels::source_words(source.numbers.size(), bits)));
  uint64_t at = 0;
  for (const uint32_t number : source.numbers) {
    const auto word = size_t(at / 32);
    words[word] |= number << at % 32;
    if (at % 32 + bits > 32) words[word + 1] |= number >> (32 - at % 32);
    at += bits;
  }
  SourceRecord record{};
  record.object = object;
  record.triangles = source.triangles;
  record.numbers = numbers_->begin_payload();
  numbers_->append(words);
  numbers_->end_payload(record.numbers);
  records_->append(&record, 1);
}

SourceTriangles to_source_triangles(const SourceTrianglesView& view) {
  SourceTriangles source{view.triangles, {}};
  source.numbers.reserve(view.count);
  for (uint32_t i = 0; i < view.count; ++i) source.numbers.push_back(kernels::source_triangle(view.field, i));
  return source;
}

}  // namespace nif::format
