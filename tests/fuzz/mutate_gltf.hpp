// Changes to a .glb that know its structure: what lies behind the JSON is only seen where that is valid, and
// where the lengths of the container are right.
#pragma once

#include <cstddef>
#include <cstdint>

#include "tests/fuzz/mutate.hpp"

namespace nif::test {

/// Changes a .glb of `size` bytes in place: a value of its JSON, the JSON's text, or its binary data. Returns
/// the new size, at most `room`.
size_t mutate_glb(uint8_t* data, size_t size, size_t room, unsigned seed, MutateBytes mutate_bytes);

}  // namespace nif::test
