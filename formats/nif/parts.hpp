// The list of parts that objects in a .nif file may have, and what is built from it. docs/adding-a-part.md
// shows how to add one.
//
// Each structure in the list is in formats/nif/<part>/<part>_part.hpp and has
// - kName: the part's name in texts;
// - Record, and kRecords: the type of the section of its records. If any object has the part, a file has the
//   section, else not;
// - Data: the part of one object, in memory that it owns;
// - View: the part of one object, as views into a file: `field`, ready to be queried; parts(), its bytes as
//   an array of PartBytes; drop_bytes(), called when the file's bytes go;
// - Member: a structure with the member for that part in an Object or an ObjectView;
// - of(): that member, also in an ObjectRecord;
// - kFlag, if it came after the first version of the format: one of ObjectFlags that nothing else has;
// - Shared, if its objects share something: a structure with Record, kRecords and of(), the member of an Asset
//   or an AssetView.
// There are also
// - read_record(Record, ObjectView, Reading), which makes the View of an object whose parts earlier in the list
//   have been read, and checks every byte; for what is shared, read_record(Record, Reading);
// - write_record(Data, Object, payloads), the reverse, which makes the record and adds its payloads; for what is
//   shared, write_record(Data, payloads).
// Both take payloads in the order in which the format has them. All else is the work of reader.cpp and
// writer.cpp.
#pragma once

#include <tuple>

#include "formats/nif/holes/holes_part.hpp"
#include "formats/nif/network/network_part.hpp"
#include "formats/nif/planes/planes_part.hpp"
#include "formats/nif/spherical/spherical_part.hpp"
#include "formats/nif/triangles/triangles_part.hpp"
#include "kernels/reference/reference_encodings.hpp"

namespace nif::format {

/// T<...> of all parts, in the order in which they are read: a network needs planes first, holes triangles.
template <template <class...> class T>
using OfParts = T<PlanesPart, TrianglesPart, NetworkPart, SphericalPart, HolesPart>;
using Parts = OfParts<std::tuple>;

/// Calls ask(Part()) for each part, in the order of the list.
template <class Ask>
constexpr void for_each_part(const Ask& ask) {
  std::apply([&](const auto&... part) { (ask(part), ...); }, Parts());
}

/// A part that came after the first version of the format. Readers that do not know its flag cannot answer an
/// object that has it, but can read the file.
template <class Part>
concept CameLater = requires {
  Part::kFlag;
};
template <class Part>
inline constexpr uint32_t kRecordsFlags = CameLater<Part> ? 0u : uint32_t{kRequired};

/// The flag in an ObjectRecord that says that an object has the part; 0 if none does.
template <class Part>
constexpr uint32_t flag_of(Part) {
  if constexpr (CameLater<Part>) return Part::kFlag;
  return 0;
}

/// Calls ask(Part()...) with all parts at once.
template <class Ask>
constexpr auto with_all_parts(const Ask& ask) {
  return std::apply(ask, Parts());
}

template <class Part>
using FieldOf = decltype(Part::View::field);

/// The encoding of an object with these parts; null if there is none. `has` says of a part's member in the object, a
/// view or a record whether it has the part.
template <class Object, class Has>
constexpr const kernels::EncodingName* encoding_with_parts_of(const Object& object, const Has& has) {
  return with_all_parts([&]<class... Part>(Part...) {
    return kernels::encoding_with<FieldOf<Part>...>({has(Part::of(object))...});
  });
}

/// The same of an object that this build can answer; every object in a file that it writes is one.
template <class Object>
const kernels::EncodingName& encoding_of(const Object& object) {
  return *encoding_with_parts_of(object, [](const auto& part) { return part ? true : false; });
}

}  // namespace nif::format
