// The parts that objects in a .nif file have: this list, and what is built from it. docs/adding-a-part.md
// shows how to add one.
//
// A structure of the list is in formats/nif/<part>/part.hpp and has
// - kName: of the part, in texts;
// - kSections: the types of its sections, that of the records first. All are in a file where an object has the
//   part, and none of them elsewhere; kPayloads: those of them that hold payloads;
// - Data: of one object, in memory that it owns;
// - View: of one object, as views into a file: `field`, ready to be queried; parts(), its bytes as an array of
//   PartBytes; drop_bytes(), for when the file's bytes go;
// - Reader: made with the sections, the file's name and the AssetView, into which it reads what objects share;
//   count() of records; read(index, object) makes the View of an object whose parts before this one in the
//   list are read; finish() comes last. It checks every byte;
// - Writer: the reverse, made with the sections and the Asset; add(Data, Object);
// - of(): the member of that part in an ObjectRecord, an Object or an ObjectView.
#pragma once

#include <tuple>

#include "formats/nif/network/part.hpp"
#include "formats/nif/planes/part.hpp"
#include "formats/nif/spherical/part.hpp"
#include "formats/nif/triangles/part.hpp"
#include "kernels/reference/encodings.hpp"

namespace nif::format {

/// T<...> of all parts, in the order in which they are read: a network stands on planes.
template <template <class...> class T>
using OfParts = T<PlanesPart, TrianglesPart, NetworkPart, SphericalPart>;
using Parts = OfParts<std::tuple>;

/// Calls ask(Part()) for each part, in the order of the list.
template <class Ask>
constexpr void for_each_part(const Ask& ask) {
  std::apply([&](const auto&... part) { (ask(part), ...); }, Parts());
}

/// What users call an object with these parts; objects of a file all have a name.
template <class Object>
const kernels::EncodingName& encoding_of(const Object& object) {
  return *kernels::encoding_with(object.planes ? true : false, object.triangles ? true : false,
                                 object.network ? true : false, object.spherical ? true : false);
}

}  // namespace nif::format
