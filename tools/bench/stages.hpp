// Times each stage of an asset's `spherical` objects.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "bake/oracle/ray_sets.hpp"
#include "kernels/cpu/spherical/stages.hpp"
#include "tools/bench/rounds.hpp"

namespace nif::tools {

/// By kernels::cpu::SphericalStage: nanoseconds a ray of the set, on one thread.
using StageTimes = std::array<Spread, kernels::cpu::kSphericalStages>;

/// Asks each `spherical` object of an asset its rays, `rounds` times. None where there is no such object.
/// `rays` has an entry for each object. Throws nif::Error where the file cannot be read, and Error(internal)
/// where the answers are not what `wrong` says of all rays: how many are not their labels.
std::optional<StageTimes> time_stages(const std::string& asset,
                                      const std::vector<const bake::LabelledRays*>& rays, size_t rounds,
                                      uint64_t wrong);

}  // namespace nif::tools
