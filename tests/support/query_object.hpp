// Gives the reference's answer for an object of any encoding, and makes rays to query it with.
#pragma once

#include "formats/nif/reader.hpp"
#include "tests/support/random_asset.hpp"

namespace nif::test {

inline kernels::Answer query_object(const format::ObjectView& object, const kernels::Segment& segment) {
  return kernels::query(format::field_of(object), segment);
}

inline kernels::Segment random_segment(Random& random, const format::ObjectView& object) {
  return std::visit([&](const auto& field) { return random_segment(random, field); },
                    format::field_of(object));
}

}  // namespace nif::test
