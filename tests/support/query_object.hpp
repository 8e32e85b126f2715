// Gives the reference's answer for an object of any encoding, and makes rays to query it with. An object that
// this build cannot answer gets an empty one.
#pragma once

#include "formats/nif/reader.hpp"
#include "tests/support/random_asset.hpp"

namespace nif::test {

inline kernels::Answer query_object(const format::ObjectView& object, const kernels::Segment& segment) {
  if (object.unsupported) return {};
  return kernels::query(format::field_of(object), segment);
}

inline kernels::Segment random_segment(Random& random, const format::ObjectView& object) {
  if (object.unsupported) return {};
  return std::visit([&](const auto& field) { return random_segment(random, field); },
                    format::field_of(object));
}

}  // namespace nif::test
