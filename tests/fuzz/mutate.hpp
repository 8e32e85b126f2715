// Changes to a .nif file that know its structure: what most of the reader and all of the kernels see is a
// file whose offsets, lengths and checksums are right.
#pragma once

#include "tests/format/damaged.hpp"
#include "tests/support/test_random.hpp"

namespace nif::test {

/// Mutates `size` bytes in place, like the fuzzer does with plain bytes. Returns their new number, at most
/// `room`.
using MutateBytes = size_t (*)(uint8_t* data, size_t size, size_t room);

/// The file with one change of its structure: a field of a record, a bit of a table, the order or length of
/// arrays, the objects. If its sections cannot be found, the same file.
Bytes mutate_structure(const Bytes& file, Random& random, MutateBytes mutate_bytes);

/// One file with the objects of both; an empty one if one of them is refused.
Bytes join_assets(const Bytes& one, const Bytes& other);

}  // namespace nif::test
