// The list of parts that objects in a .nif file may have, and what is built from it. docs/adding-a-part.md
// shows how to add one.
//
// Each structure in the list is in formats/nif/<part>/part.hpp and has
// - kName: the part's name in texts;
// - kSections: the types of its sections, that of the records first. If any object has the part, a file has
//   all of them, else none; kPayloads: those of them that hold payloads;
// - Data: the part of one object, in memory that it owns;
// - View: the part of one object, as views into a file: `field`, ready to be queried; parts(), its bytes as
//   an array of PartBytes; drop_bytes(), called when the file's bytes go;
// - Reader: made from the sections, the file's name and the AssetView, into which it reads what objects
//   share; count() of records; read(index, object) makes the View of an object whose parts earlier in the
//   list have been read; finish() comes last. It checks every byte;
// - Writer: the reverse, made from the sections and the Asset; add(Data, Object);
// - of(): the member for that part in an ObjectRecord, an Object or an ObjectView.
#pragma once

#include <tuple>

#include "formats/nif/network/part.hpp"
#include "formats/nif/planes/part.hpp"
#include "formats/nif/spherical/part.hpp"
#include "formats/nif/triangles/part.hpp"
#include "kernels/reference/encodings.hpp"

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
