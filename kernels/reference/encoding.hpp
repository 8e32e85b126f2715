// What the file of each encoding says of it: its name, and the parts that its objects have. The list of
// encodings finds both here (kernels/reference/reference_encodings.hpp).
#pragma once

#include <cstdint>

namespace nif::kernels {

/// The user's name of an encoding; the number is that of NifEncoding.
struct EncodingName {
  uint32_t number;
  const char* name;
};

/// The fields of the parts that objects of an encoding have, in the order in which its own field takes them.
template <class... Part>
struct MadeOf {};

/// For the field of each encoding: its kName, and what it is MadeOf.
template <class Field>
struct EncodingOf;

}  // namespace nif::kernels
