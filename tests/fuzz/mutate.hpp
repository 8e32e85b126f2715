// Changes to a .nif file that know its structure: what most of the reader and all of the kernels see is a
// file whose offsets, lengths and checksums are right.
#pragma once

#include "tests/format/damaged.hpp"
#include "tests/support/random.hpp"

namespace nif::test {

/// Changes up to `size` bytes in place, at most `room` in the end, and returns how many there are now: what
/// the fuzzer does to plain bytes.
using MutateBytes = size_t (*)(uint8_t* data, size_t size, size_t room);

/// The file with one part of its structure changed: a field of a record, a bit of a table, the order or the
/// length of pieces, the objects that it has. The same file where it cannot be told apart into sections.
Bytes mutate_structure(const Bytes& file, Random& random, MutateBytes mutate_bytes);

/// The objects of both files in one; an empty file where one of them is refused.
Bytes join_assets(const Bytes& one, const Bytes& other);

}  // namespace nif::test
