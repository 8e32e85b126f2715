// Seeds for the rays that a bake draws beside those that it trains on. They are added to the user's, and
// differ from the default of `nif eval`, from training's streams and from each other.
#pragma once

#include <cstdint>

namespace nif::bake {

inline constexpr uint64_t kMeasuringSeed = 0x6d65617375726564, kChoosingSeed = 0x63686f6f73696e67,
                          kThresholdSeed = 0x6c65616e696e67;

}  // namespace nif::bake
