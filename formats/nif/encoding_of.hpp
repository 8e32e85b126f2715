// What the format knows of an encoding, by the type of the field that kernels query.
//
// A folder for each encoding (formats/nif/segment and so on) specialises this in its encoding.hpp. The list
// of them is that of kernels::AnyField; formats/nif/encodings.hpp includes them all.
// docs/adding-an-encoding.md shows how to add one.
#pragma once

#include <cstdint>

namespace nif::format {

/// A specialisation has:
/// - kNumber, kName: in the file and in texts; kSections: the types of its sections, all of which are in a
/// file where
///   an object has the encoding, and none of them elsewhere;
/// - Data: one object that owns its memory; Shared: what the objects of an asset share (networks);
/// - View: one object as views into a file, with `field` ready to be queried; SharedView likewise;
/// - Reader: makes views from a file's sections, and checks every byte of them;
/// - Writer: the reverse, from Data and Shared.
template <class Field>
struct EncodingOf;

/// How many bytes of a file some part of it takes; names are those of the tools' JSON.
struct PartBytes {
  const char* name;
  uint64_t bytes;
};

}  // namespace nif::format
