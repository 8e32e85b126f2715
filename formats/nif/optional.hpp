// The list of what objects may have besides their parts: records that name the object, in sections that a
// reader may skip.
//
// Each structure in the list has
// - kRecords, kValues: the types of its sections, of records and of their payloads. A file has both or none;
// - Record, and rank(record), by which records ascend; a file that breaks that breaks the rule kOrder;
// - of(): the member with the views of an AssetView;
// - has(object), and write(object, number, payloads): the records of an object, in their order.
// There is also read_record(Record, ObjectView, Reading), which makes a view, or nothing where this build does
// not know what the record is about.
#pragma once

#include <tuple>

#include "formats/nif/planes/colors_section.hpp"
#include "formats/nif/spherical/primary_section.hpp"
#include "formats/nif/triangles/numbers.hpp"
#include "formats/nif/triangles/skin_section.hpp"

namespace nif::format {

/// Calls ask(Kind()) for each, in the order of their sections in a file.
template <class Ask>
constexpr void for_each_optional(const Ask& ask) {
  std::apply([&](const auto&... kind) { (ask(kind), ...); },
             std::tuple<PrimaryRecords, NumbersRecords, ColorsRecords, SkinRecords>());
}

}  // namespace nif::format
