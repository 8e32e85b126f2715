// Rays of the named sets, answered by the emulated kernels and by the reference.
#pragma once

#include <span>
#include <vector>

#include "tests/gpu/object_on_gpu.hpp"

namespace nif::test {

/// The ways that differ for an object of this encoding.
std::vector<EmulatedWay> ways_for(const format::ObjectView& object);

/// How many answers differ: another logit, or certain in one and not in the other. In parallel.
uint64_t count_different(const format::ObjectView& object, std::span<const kernels::Segment> segments,
                         const EmulatedWay& way);

}  // namespace nif::test
