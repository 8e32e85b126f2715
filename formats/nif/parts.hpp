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
// - of(): the member for that part in an ObjectRecord, an Object or an ObjectView;
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

#include "formats/nif/network/network_part.hpp"
#include "formats/nif/planes/planes_part.hpp"
#include "formats/nif/spherical/spherical_part.hpp"
#include "formats/nif/triangles/triangles_part.hpp"
#include "kernels/reference/reference_encodings.hpp"

namespace nif::format {

/// T<...> of all parts, in the order in which they are read: a network needs planes first.
template <template <class...> class T>
using OfParts = T<PlanesPart, TrianglesPart, NetworkPart, SphericalPart>;
using Parts = OfParts<std::tuple>;

/// Calls ask(Part()) for each part, in the order of the list.
template <class Ask>
constexpr void for_each_part(const Ask& ask) {
  std::apply([&](const auto&... part) { (ask(part), ...); }, Parts());
}

/// The encoding of an object with these parts; every object in a file has one.
template <class Object>
const kernels::EncodingName& encoding_of(const Object& object) {
  return *kernels::encoding_with(object.planes ? true : false, object.triangles ? true : false,
                                 object.network ? true : false, object.spherical ? true : false);
}

}  // namespace nif::format
