// Holds all outputs of a query, so that two calls can be compared.
#pragma once

#include <nif/nif.h>

#include <cstdint>
#include <vector>

namespace nif::test {

/// In arrays of their exact lengths, filled with what no query writes.
struct Answers {
  explicit Answers(size_t count)
      : visible(count, 0xcc),
        bits((count + 7) / 8, 0xcc),
        certain(count, 0xcc),
        probability(count, -1),
        logit(count) {}
  NifAnswers outputs() {
    NifAnswers to{};
    to.struct_size = sizeof(to);
    to.visible = visible.data();
    to.visible_bits = bits.data();
    to.certain = certain.data();
    to.probability = probability.data();
    to.logit = logit.data();
    return to;
  }
  bool operator==(const Answers&) const = default;

  std::vector<uint8_t> visible, bits, certain;
  std::vector<float> probability;
  std::vector<int32_t> logit;
};

}  // namespace nif::test
