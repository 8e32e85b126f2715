// Reads numbers of triangles and vertices. They are packed in as few bits as the largest one may need; each
// is checked, and so are the bits left over. The writer is in write_numbers.cpp, because the runtime does not
// need it.
#include "formats/nif/triangles/numbers.hpp"

#include "formats/nif/reader.hpp"

namespace nif::format {

std::optional<NumbersView> read_record(const NumbersRecord& record, const ObjectView& object,
                                       const Reading& reading) {
  const Place& place = reading.place;
  if (record.kind < kSourceTriangles || record.kind > kSourceVertices) return std::nullopt;
  place.require(object.triangles != nullptr, Rule::no_triangles);
  const kernels::TrianglesField& triangles = object.triangles->field;
  const uint32_t count = record.kind == kSourceVertices ? triangles.vertex_count : triangles.triangle_count;
  place.require(record.reserved == 0, Rule::reserved_not_zero);
  NumbersView view{record.object,
                   record.kind,
                   record.below,
                   {nullptr, kernels::source_bits(record.below), count},
                   numbers_bytes(count, record.below)};
  const Bytes payload = reading.payloads.next(record.numbers, view.bytes, "numbers", place);
  view.field.words = reinterpret_cast<const uint32_t*>(payload.data());
  for (uint32_t i = 0; record.below != 0 && i < count; ++i)
    if (kernels::source_triangle(view.field, i) >= record.below)
      place.damaged(Rule::triangle_number,
                    "number " + std::to_string(i) + " is not below " + std::to_string(record.below));
  const uint32_t used = uint32_t(uint64_t{count} * view.field.bits % 32);
  place.require(used == 0 || view.field.words[view.bytes / 4 - 1] >> used == 0, Rule::bits_after_numbers);
  return view;
}

}  // namespace nif::format
