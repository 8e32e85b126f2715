// Golden files: assets of every version of the format that was ever released, kept for good, each with rays
// and the answers that it gave. v2-NAME.nif goes with v2-NAME.answers, an array of GoldenAnswer.
#pragma once

#include <cstdint>

#include "kernels/reference/encodings/segment.hpp"

namespace nif::test {

struct GoldenAnswer {
  uint32_t object;
  kernels::Segment ray;
  int32_t logit;
  uint8_t visible, certain;
  uint16_t zero;
};
static_assert(sizeof(GoldenAnswer) == 44);

}  // namespace nif::test
