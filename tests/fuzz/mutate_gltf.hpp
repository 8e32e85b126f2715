// Changes to a .glb that know its structure: what lies behind the JSON is only seen where that is valid, and
// where the lengths of the container are right.
#pragma once

#include <cstddef>
#include <cstdint>

#include "tests/fuzz/mutate.hpp"

namespace nif::test {

/// Changes a .glb of `size` bytes in place, to `room` at most, and returns how many there are then: a value
/// of its JSON, the text of it, or its binary data.
size_t mutate_glb(uint8_t* data, size_t size, size_t room, unsigned seed, MutateBytes mutate_bytes);

}  // namespace nif::test
