// The reference's answer for an object of either encoding, and rays to ask it.
#pragma once

#include "formats/nif/reader.hpp"
#include "tests/support/random_asset.hpp"

namespace nif::test {

inline kernels::Answer query_object(const format::ObjectView& object, const kernels::Segment& segment) {
  return object.encoding == format::kBvh ? kernels::query_bvh(object.bvh, segment)
                                         : kernels::query_segment(object.field, segment);
}

inline kernels::Segment random_segment(Random& random, const format::ObjectView& object) {
  return object.encoding == format::kBvh ? random_segment(random, object.bvh)
                                         : random_segment(random, object.field);
}

}  // namespace nif::test
