// The reference's answer for an object of any encoding, and rays to ask it.
#pragma once

#include "formats/nif/reader.hpp"
#include "tests/support/random_asset.hpp"

namespace nif::test {

inline kernels::Answer query_object(const format::ObjectView& object, const kernels::Segment& segment) {
  switch (object.encoding) {
    case format::kBvh:
      return kernels::query(object.bvh, segment);
    case format::kSpherical:
      return kernels::query(*object.spherical, segment);
    case format::kSegment:
      break;
  }
  return kernels::query(object.field, segment);
}

inline kernels::Segment random_segment(Random& random, const format::ObjectView& object) {
  switch (object.encoding) {
    case format::kBvh:
      return random_segment(random, object.bvh);
    case format::kSpherical:
      return random_segment(random, *object.spherical);
    case format::kSegment:
      break;
  }
  return random_segment(random, object.field);
}

}  // namespace nif::test
