// Codes features (docs/format.md, "Features"). They are nearly random: the small gain comes from some values
// being more common than others. Neighbouring corners tell nothing about each other (docs/results/planes.md).
#pragma once

#include <array>

#include "formats/base/range_coder.hpp"
#include "kernels/reference/network/network_field.hpp"

namespace nif::format {

/// Codes `count` values, one channel of each corner after the other. `truth` holds the bytes to encode; a
/// decoder does not read it. `to` receives the values in either case, and may be `truth`.
template <class Coder>
void code_features(Coder& coder, uint64_t count, uint32_t channels, const int8_t* truth, int8_t* to) {
  std::array<SymbolModel<8>, kernels::kMaxFeatures> models;
  for (uint64_t i = 0; i < count; ++i)
    to[i] = int8_t(uint8_t(models[i % channels].code(coder, uint8_t(truth[i]))));
}

}  // namespace nif::format
