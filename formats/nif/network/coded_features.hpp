// How features are coded. They are nearly random: what little they take less, they take because some values
// are more common than others. Neighbouring corners say nothing of one another (docs/results/planes.md).
#pragma once

#include <array>

#include "formats/base/range_coder.hpp"
#include "kernels/reference/network/field.hpp"

namespace nif::format {

/// Codes count values, one channel after the other of each corner. `truth` are those to be encoded, as bytes;
/// a decoder does not look at them. `to` gets them in either case, and may be `truth`.
template <class Coder>
void code_features(Coder& coder, uint64_t count, uint32_t channels, const int8_t* truth, int8_t* to) {
  std::array<SymbolModel<8>, kernels::kMaxFeatures> models;
  for (uint64_t i = 0; i < count; ++i)
    to[i] = int8_t(uint8_t(models[i % channels].code(coder, uint8_t(truth[i]))));
}

}  // namespace nif::format
