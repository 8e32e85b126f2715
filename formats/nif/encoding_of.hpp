// What the format knows of an encoding, by the type of the field that kernels query.
//
// A folder for each encoding (formats/nif/segment and so on) specialises this in its encoding.hpp. The list
// of them is that of kernels::AnyField; formats/nif/encodings.hpp includes them all.
// docs/adding-an-encoding.md shows how to add one.
#pragma once

#include <cstdint>

namespace nif::format {

/// A specialisation has:
/// - kNumber, kName: in the file and in texts;
/// - kSections: the types of its sections, that of the records first. All are in a file where an object has
///   the encoding, and none of them elsewhere;
/// - Data: one object that owns its memory; Shared: what the objects of an asset share (networks);
/// - View: one object as views into a file: `field`, ready to be queried; `network`, its index into what is
///   shared; parts(), its bytes as an array of PartBytes; drop_bytes(), for when the file's bytes go;
/// - SharedView: what is shared, likewise; made with a memory resource; network_count(), network_bytes() in
///   the file, view_bytes() of its own memory, drop_bytes();
/// - Reader: made with the sections, the file's name and SharedView; count() of records; read(index, bounds)
///   makes a View; finish() comes last. It checks every byte;
/// - Writer: the reverse, made with the sections and Shared; add(Data);
/// - static functions: field(Data, Shared, Bounds), to_data(View), to_shared(SharedView).
template <class Field>
struct EncodingOf;

/// How many bytes of a file some part of it takes, and of memory beside it where it is coded; names are those
/// of the tools' JSON.
struct PartBytes {
  const char* name;
  uint64_t bytes;
  uint64_t decoded = 0;
};

}  // namespace nif::format
