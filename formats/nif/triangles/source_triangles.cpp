// Reads source triangles. Numbers are packed in as few bits as the source mesh needs; each is checked, and so
// are the bits left over. The writer is in write_source_triangles.cpp, because the runtime does not need it.
#include "formats/nif/triangles/source_triangles.hpp"

namespace nif::format {
namespace {

SourceTrianglesView read_one(const SourceRecord& record, uint32_t count, Payloads& payloads,
                             const Place& place) {
  SourceTrianglesView view;
  view.object = record.object;
  view.triangles = record.triangles;
  view.count = count;
  place.require(all_zero(record.reserved), Rule::reserved_not_zero);
  view.field.bits = kernels::source_bits(record.triangles);
  view.field.count = count;
  view.bytes = source_bytes(count, record.triangles);
  const Bytes payload = payloads.next(record.numbers, view.bytes, "numbers", place);
  view.field.words = reinterpret_cast<const uint32_t*>(payload.data());
  for (uint32_t i = 0; i < count; ++i)
    if (kernels::source_triangle(view.field, i) >= record.triangles)
      place.damaged(Rule::triangle_number, "triangle " + std::to_string(i) + " is none of the source mesh");
  const uint32_t used = uint32_t(uint64_t{count} * view.field.bits % 32);
  place.require(used == 0 || view.field.words[view.bytes / 4 - 1] >> used == 0, Rule::bits_after_numbers);
  return view;
}

}  // namespace

uint64_t source_bytes(uint64_t numbers, uint32_t triangles) {
  return kernels::source_words(numbers, kernels::source_bits(triangles)) * sizeof(uint32_t);
}

void read_source_triangles(const SectionTable& sections, bool present, std::string_view file,
                           std::span<const std::optional<uint32_t>> counts,
                           std::pmr::vector<SourceTrianglesView>& views) {
  const Records<SourceRecord> records(sections[kSourceRecords], "SRCT", file);
  Payloads payloads(sections[kSourceNumbers]);
  if (present && records.count() == 0) refuse(Rule::section_unused, file, "section SRCT");
  views.reserve(records.count());
  for (uint32_t i = 0; i < records.count(); ++i) {
    const SourceRecord record = records[i];
    const Place place{file, "SRCT", i};
    place.require(record.object < counts.size(), Rule::object_range);
    place.require(i == 0 || record.object > views.back().object, Rule::optional_order);
    const std::optional<uint32_t>& count = counts[record.object];
    place.require(count.has_value(), Rule::no_triangles);
    views.push_back(read_one(record, *count, payloads, place));
  }
  payloads.finish("SNUM", file);
}

}  // namespace nif::format
